"""Files of heights, for tests: written by root, read by all, and what is said of bad ones."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from numpy.typing import NDArray

from parcontact.errors import InputError
from parcontact.parallel.slab import Slab
from parcontact.physics import surface

NX, NY = 7, 5

KINDS = ["npy", "h5", "txt"]


def write(path: Path, values: NDArray[Any]) -> None:
    if path.suffix == ".npy":
        np.save(path, values)
    elif path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            file["heights"] = values
            file.create_group("other")
    else:
        np.savetxt(path, values, fmt="%.17g", header="made by a test")


def made(comm: MPI.Intracomm, path: Path, make: Callable[[Path], object]) -> Path:
    """A file that root has made, seen by all."""
    if comm.rank == 0:
        make(path)
    comm.Barrier()
    return path


def complaint(comm: MPI.Intracomm, path: Path, dataset: str = "heights") -> str:
    """What reading says, the same on every rank, in one line that names the file."""
    with pytest.raises(InputError) as caught:
        surface.read_heights(path, dataset, Slab(comm, NX, NY))
    said = str(caught.value)
    assert comm.allgather(said) == [said] * comm.size
    assert str(path) in said
    assert "\n" not in said
    return said
