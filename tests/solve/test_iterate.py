"""Length of a certificate for a body that is stiffer along lines of points."""

import math

import numpy as np
import pytest
from mpi4py import MPI

from parcontact.contact.certificate import Lines, form_iterate
from parcontact.contact.problem import Box
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
