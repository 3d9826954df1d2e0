"""Jobs of surfaces that stick, in units that make them comparable with theory."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

import parcontact as pc
from parcontact.door.simulation import Row

RADIUS, WORK, MODULUS = 1e-3, 0.05, 4e6  # of a sphere [m], of adhesion [J/m^2], E* of the relaxed body [Pa]
FORCE = 1.5 * np.pi * WORK * RADIUS  # pull-off of a sphere by JKR [N]
LENGTH = (RADIUS * (WORK / MODULUS) ** 2) ** (1 / 3)  # of approaches: Tabor's parameter is LENGTH over the range
UNLOADED = (9 * np.pi * WORK * RADIUS**2 / (2 * MODULUS)) ** (1 / 3)  # radius of a contact without load, by JKR
ELASTIC = {"model": "elastic", "shear_modulus": MODULUS / 4}
Job = dict[str, Any]
Map = NDArray[np.float64]


def ramp(start: float, end: float, steps: int, duration: float = 1.0) -> Job:
    """A stage that goes from an approach to another."""
    return {"approach": {"from": start, "to": end}, "duration": duration, "time_step": duration / steps}


def sphere(points: int, box: float, tabor: float, *history: Job, law: str = "exponential", **more: Any) -> Job:
    """A sphere in a free box of a given number of radii of its contact without load."""
    return {
        "grid": {"points": points, "size": box * UNLOADED, "boundary": "free"},
        "surface": {"shape": "sphere", "radius": RADIUS},
        "material": ELASTIC,
        "adhesion": {"work": WORK, "range": LENGTH / tabor, "law": law},
        "history": list(history),
        "numerics": {"tolerance": 1e-3},
        **more,
    }


def zone(job: Job) -> float:
    """Length of a process zone [m]."""
    return float(MODULUS * job["adhesion"]["range"] ** 2 / job["adhesion"]["work"])


def cells_per_zone(job: Job) -> float:
    nx, size = np.ravel(job["grid"]["points"])[0], np.ravel(job["grid"]["size"])[0]
    return zone(job) * float(nx / size)


def steps(job: Job, comm: MPI.Intracomm = MPI.COMM_SELF) -> Iterator[Row]:
    return pc.Simulation(job, comm=comm).steps()


def last_row(job: Job, comm: MPI.Intracomm = MPI.COMM_SELF) -> Row:
    *_, row = steps(job, comm)
    return row


def gathered(run: pc.Simulation, name: str) -> Map:
    """A copy of a map, of a run on one rank."""
    found = run.gather(name)
    assert found is not None
    return np.array(found, dtype=np.float64)


def nominal_area(job: Job) -> float:
    """Area of the box [m^2]."""
    return float(np.prod(np.broadcast_to(job["grid"]["size"], 2)))


def pull_off(job: Job) -> float:
    """The lowest force of a run [N], which must be reached before its end."""
    forces = [row.pressure * nominal_area(job) for row in steps(job)]
    assert 0 < int(np.argmin(forces)) < len(forces) - 1
    return min(forces)
