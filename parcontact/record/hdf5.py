"""HDF5 files of which every rank writes and reads its rows: by MPI-IO where h5py has it, else by the ranks in turn.

The file is the same either way: root alone lays it out, then every rank writes into what is there, which changes no
metadata. An error on one rank is raised on all, as a RunError.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

from ..errors import RunError
from ..parallel.slab import Array, Slab


class Part(NamedTuple):
    """This rank's rows of one map in a dataset `name`, below the leading indices `at`."""

    name: str
    at: tuple[int, ...]
    rows: Array


def lay_out(path: Path, slab: Slab, build: Callable[[h5py.File], None]) -> None:
    """Root makes the file with `build(file)`; collective."""

    def make() -> None:
        with h5py.File(path, "w") as file:
            build(file)

    on_root(slab, make, f"cannot make {path}")


def write(path: Path, slab: Slab, parts: Iterable[Part], in_turn: bool | None = None) -> None:
    """Every rank writes its rows; collective. `in_turn` overrides the choice between MPI-IO and turns."""
    parts = list(parts)

    def put(file: h5py.File) -> None:
        for part in parts:
            _select(file, part, slab, lambda dataset, *where, rows=part.rows: dataset.write(*where, rows))

    _with_file(path, slab, "r+", put, in_turn)


def read(path: Path, slab: Slab, parts: Iterable[Part], in_turn: bool | None = None) -> None:
    """Every rank reads its rows into `part.rows`; collective."""
    parts = list(parts)

    def get(file: h5py.File) -> None:
        for part in parts:
            _select(file, part, slab, lambda dataset, *where, rows=part.rows: dataset.read(*where, rows))

    _with_file(path, slab, "r", get, in_turn)


def on_root(slab: Slab, action: Callable[[], None], what: str) -> None:
    """Do something on root; collective. Its failure is a RunError on every rank, beginning with `what`."""
    problem = ""
    if slab.root:
        try:
            action()
        except OSError as error:
            problem = f"{what}: {error}"
    if problem := slab.agree(problem):
        raise RunError(problem)


def _with_file(path: Path, slab: Slab, mode: str, act: Callable[[h5py.File], None], in_turn: bool | None) -> None:
    problem = ""
    collective = h5py.get_config().mpi and not in_turn and slab.comm.size > 1
    options = {"driver": "mpio", "comm": slab.comm} if collective else {}
    for _ in range(1) if collective else _turns(slab):
        try:
            with h5py.File(path, mode, **options) as file:
                act(file)
        except (OSError, KeyError, RuntimeError) as error:
            problem = f"cannot {'read' if mode == 'r' else 'write'} {path}: {error}"
    if problem := next((text for text in slab.from_all(problem) if text), ""):
        raise RunError(problem)


def _turns(slab: Slab) -> Iterator[None]:
    """Yields once, when it is this rank's turn."""
    for rank in range(slab.comm.size):
        if rank == slab.comm.rank:
            yield None
        slab.comm.Barrier()


def _select(file: h5py.File, part: Part, slab: Slab, act: Callable[..., None]) -> None:
    """Call `act(dataset, memory space, file space)` for this rank's rows; safe for ranks without rows."""
    dataset = file[part.name].id
    space = dataset.get_space()
    count = (1,) * len(part.at) + part.rows.shape
    memory = h5py.h5s.create_simple(count)
    if part.rows.size:
        space.select_hyperslab((*part.at, slab.rows.start, 0), count)
    else:
        space.select_none()
        memory = h5py.h5s.create_simple((1,))
        memory.select_none()
    act(dataset, memory, space)


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """A temporary name to write to; on leaving without an error the file takes the place of `path`."""
    part = path.with_name(path.name + ".part")
    yield part
    part.replace(path)


def fixed(file: h5py.File, name: str, shape: tuple[int, ...], dtype: np.dtype) -> h5py.Dataset:
    """A dataset whose space is set aside at once, so that writing to it never changes the file's structure."""
    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_layout(h5py.h5d.CONTIGUOUS)
    plist.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    plist.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    space = h5py.h5s.create_simple(shape)
    group, _, leaf = name.rpartition("/")
    parent = file.require_group(group) if group else file
    h5py.h5d.create(parent.id, leaf.encode(), h5py.h5t.py_create(dtype), space, dcpl=plist)
    return parent[leaf]
