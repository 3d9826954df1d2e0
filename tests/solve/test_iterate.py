"""Sums over a pressure and its certificate, also for a body that is stiffer along lines of points."""

import math

import numpy as np
import pytest
from mpi4py import MPI

from parcontact.contact.certificate import Lines, certify, form_iterate
from parcontact.contact.problem import ROUNDINGS, Box, reachable_certificate
from parcontact.parallel.slab import Slab

ROUNDING = 1e-12  # of sums over some hundred points


@pytest.mark.mpi
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize(("along", "between"), [(1.0, 0.0), (0.0, 1.0), (0.03, 1.0), (2.0, 0.5)])
def test_share_of_length(comm: MPI.Intracomm, axis: int, along: float, between: float) -> None:
    """Waves of amplitudes a along the lines and b between them have the share `(a^2 + b^2/c^2)/(a^2 + b^2)` of the
    variance. Points without pressure, whose displacements are large, do not count."""
    slab = Slab(comm, 32, 24)
    y, x = np.mgrid[0:24, 0:32]
    inside = (x < 16) & (y < 12)
    wave, other = np.sin(2 * np.pi * x / 8), np.cos(2 * np.pi * y / 6)
    first, second = (along, between) if axis else (between, along)
    u = np.where(inside, 5.0 + first * wave + second * other, 1e3)
    p, u = np.where(inside, 2.0, 0.0)[slab.rows], u[slab.rows].copy()
    iterate = form_iterate(slab, Box(), p, u, 0.0 * u, 0.0)
    share = Lines(axis, 50.0).share_of_length(slab, p, u, iterate)
    expected = math.sqrt((along**2 + between**2 / 50.0**2) / (along**2 + between**2))
    assert share == pytest.approx(expected, rel=ROUNDING, abs=0.0)


@pytest.mark.parametrize("highest", [math.inf, 0.8])
def test_settled(highest: float) -> None:
    """The sums are those at the new approach, at which the free points have no work of the gap."""
    slab, chance = Slab.alone(6, 5), np.random.default_rng(1)
    p, u, h = np.clip(chance.uniform(-0.5, 1.5, (5, 6)), 0.0, highest), *chance.uniform(size=(2, 5, 6))
    found = form_iterate(slab, Box(highest=highest), p, u, h, 0.25).settled()
    expected = form_iterate(slab, Box(highest=highest), p, u, h, found.d)
    assert list(vars(found).values())[:7] == pytest.approx(
        list(vars(expected).values())[:7], rel=ROUNDING, abs=ROUNDING
    )
    assert abs(found.free_gaps) <= ROUNDING


def test_members() -> None:
    """Points with pressure or penetration, also those that yield and are held there: 2 + 1 + 3 of 20."""
    slab, p, u = Slab.alone(20, 1), np.zeros((1, 20)), np.ones((1, 20))
    p[0, :2], p[0, 2:5], u[0, 2:5], u[0, 5] = 0.3, 0.8, -0.5, -0.1
    box, h, working = Box(highest=0.8), np.zeros((1, 20)), np.zeros((1, 20), bool)
    members, _, certificate = certify(slab, box, p, u, h, form_iterate(slab, box, p, u, h, 0.0), None, 1.0, working)
    assert (members, certificate.members) == (3.0, 0.3)
    assert np.flatnonzero(working).tolist() == [0, 1, 5]


@pytest.mark.parametrize(("largest", "compliance"), [(0.2, 0.1), (0.1, 2.0)])
def test_reachable_certificate(largest: float, compliance: float) -> None:
    """Rounding of the largest length: 0.2 of a map, or of a pressure of 0.1 that moves the body by 0.2."""
    maps = np.full((3, 4), -largest), np.full((3, 4), 0.05)
    found = reachable_certificate(Slab.alone(4, 3), maps, np.full((3, 4), 0.1), compliance, 0.5)
    assert found == pytest.approx(ROUNDINGS * np.finfo(float).eps * 0.2 / 0.5, rel=ROUNDING, abs=0.0)
