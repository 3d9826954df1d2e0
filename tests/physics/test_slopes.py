"""The tangential force of a pressure on the body's own surface."""

import math

import numpy as np
import pytest
from mpi4py import MPI

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.physics.slopes import friction_by_energy

WEIGHTS = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
DIRECTIONS = [(1.0, 0.0), (0.6, 0.8), (0.0, -1.0)]


def pressure_and_displacement(n: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(n)
    return random.random((n, n)) * (random.random((n, n)) < 0.4), random.random((n, n))


@pytest.mark.mpi
@pytest.mark.parametrize("cyclic", [True, False])
@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("n", [3, 7, 32])
def test_differences_of_the_eighth_order(
    comm: MPI.Intracomm, n: int, direction: tuple[float, float], cyclic: bool
) -> None:
    """The sums written out with numpy, also where ranks have fewer rows than a difference is wide; to round-off."""
    slab, (p, u) = Slab(comm, n, n), pressure_and_displacement(n)
    wide = np.pad(u, 4, mode="wrap" if cyclic else "edge")
    inside = slice(4, n + 4)
    along_x = sum(w * (wide[inside, 5 + k :][:, :n] - wide[inside, 3 - k :][:, :n]) for k, w in enumerate(WEIGHTS))
    along_y = sum(w * (wide[5 + k :][:n] - wide[3 - k :][:n])[:, inside] for k, w in enumerate(WEIGHTS))
    expected = -(p * (direction[0] * along_x / 0.5 + direction[1] * along_y / 0.25)).sum() / p.sum()
    rows = slab.rows
    found = friction_by_energy(slab, p[rows].copy(), u[rows].copy(), (0.5, 0.25), direction, cyclic)
    assert found == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_an_elastic_body_has_no_friction(direction: tuple[float, float], free: bool) -> None:
    """As its operator commutes with differences: 0 to round-off for any pressure, away from the edge of a free box."""
    slab, (p, _) = Slab.alone(32, 32), pressure_and_displacement(32)
    if free:
        p[:4], p[-4:], p[:, :4], p[:, -4:] = 0.0, 0.0, 0.0, 0.0
    u = HalfSpace((1.0, 1.0), free=free).operator(FFT(slab)).apply(p, slab.empty())
    found = friction_by_energy(slab, p, u, (1 / 32, 1 / 32), direction, not free)
    assert abs(found) < 1e-13 * abs(np.diff(u)).max() * 32


def test_a_wave_of_eight_cells() -> None:
    """The slope of a wave is wrong by the eighth order, (q dx)^8/630: 0.023 % of it; 1 % of that for the next."""
    n, q = 32, 8 * math.pi
    x = np.arange(n) / n
    p, u = (np.tile(1.0 + wave, (n, 1)) for wave in (np.cos(q * x), -np.sin(q * x)))
    found = friction_by_energy(Slab.alone(n, n), p, u, (1 / n, 1 / n), (1.0, 0.0), True)
    assert found == pytest.approx(0.5 * q * (1.0 - (q / n) ** 8 / 630), rel=3e-4 * 0.2)


def test_no_load_has_no_friction() -> None:
    slab = Slab.alone(8, 8)
    assert math.isnan(friction_by_energy(slab, slab.zeros(), slab.zeros(), (1.0, 1.0), (1.0, 0.0), True))
