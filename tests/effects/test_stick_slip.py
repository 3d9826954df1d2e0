"""Stick and slip: closed forms of Cattaneo and Mindlin, full slip, energies, ranks and restarts."""

import math
from typing import Any

import numpy as np
import pytest
from marched_jobs import marched
from mpi4py import MPI

from parcontact.job import Job

G, RADIUS, FORCE, MU = 1e6, 1e-2, 1e-3, 0.5
A = (3.0 * FORCE * RADIUS / (16.0 * G)) ** (1.0 / 3.0)  # Hertz, one body that is incompressible
SHARES = (0.1, 0.3, 0.5, 0.7, 0.9)  # of the tangential force over mu times the load
RUBBER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 4e6, "relaxation_time": 1e-3}]}


def mindlin(share: float) -> float:
    """Tangential displacement of a sphere under a share of the force at which it slides (R. D. Mindlin, 1949)."""
    return 3.0 * MU * FORCE * 1.5 / (16.0 * G * A) * (1.0 - (1.0 - share) ** (2.0 / 3.0))


def sphere(stops: Any, points: int = 64, tolerance: float = 1e-4, **more: Any) -> Job:
    """A sphere pressed on, then moved to stops along x [m], one step each."""
    ways = np.diff([0.0, *stops])
    slides = [{"force": FORCE, "velocity": float(way), "duration": 1.0, "time_step": 1.0} for way in ways]
    return Job.model_validate(
        {
            "grid": {"points": points, "size": 4.0 * A, "boundary": "free"},
            "surface": {"shape": "sphere", "radius": RADIUS},
            "material": {"model": "elastic", "shear_modulus": G, "poisson": 0.5},
            "interface": {"coefficient": MU, "stick": True},
            "history": [{"force": FORCE}, *slides],
            "numerics": {"tolerance": tolerance},
            **more,
        }
    )


def rough(stick: Any, material: Any = RUBBER, points: int = 32, **more: Any) -> dict[str, Any]:
    """A rough surface that begins to slide over a box that repeats."""
    surface = {"shape": "rough", "hurst": 0.8, "long_wavelength": 5e-4, "short_wavelength": 1.25e-4, "seed": 3}
    slide = {"pressure": 1e5, "velocity": [0.02, 0.005], "duration": 1e-4, "time_step": 1e-5}
    return {
        "grid": {"points": points, "size": 1e-3},
        "surface": {**surface, "rolloff_wavelength": 5e-4, "rms_slope": 0.1},
        "material": material,
        "interface": stick,
        "history": [{"pressure": 1e5, "duration": 1e-3, "time_step": 2.5e-4}, slide],
        "numerics": {"tolerance": 1e-6},
        **more,
    }


def test_cattaneo_and_mindlin() -> None:
    """Displacement over force to 0.5 % with 16 cells in the radius, where Hertz's force is met to 0.2 %; the radius of
    the zone that sticks to one cell."""
    cell = 4.0 * A / 64
    rows = marched(sphere([mindlin(share) for share in SHARES]))[1][2:]
    for share, row in zip(SHARES, rows, strict=True):
        found = -row.measures.force_x / (MU * FORCE)
        assert mindlin(found) == pytest.approx(mindlin(share), rel=5e-3)
        sticking = math.sqrt(row.added[2] * 64 * 64 / math.pi) * cell
        assert sticking == pytest.approx(A * (1.0 - share) ** (1.0 / 3.0), abs=cell)


@pytest.mark.mpi(2, 4)
def test_ranks_agree(comm: MPI.Intracomm) -> None:
    """Forces, sticking areas and energies are those of one rank, to the digits that sums in other orders leave."""
    job = rough({"shear_stress": 2e5, "stick": True}, output={"energy": True})
    alone, together = (marched(job, comm=each)[1][-1] for each in (MPI.COMM_SELF, comm))
    assert together.added == pytest.approx(alone.added, rel=1e-6)
    assert together.measures.force_x == pytest.approx(alone.measures.force_x, rel=1e-6)
    assert 0.0 < alone.added[2] < alone.measures.contact_area
