"""Rows of maps in HDF5 files: by MPI-IO where h5py has it, else by the ranks in turn; the file is the same either way.

Every rank writes into the places that a file has been laid out with, which changes nothing else in it. An error on one
rank is raised on all, as a RunError in one sentence.
"""

import errno
import os
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import h5py
import numpy as np

from ..errors import InputError, RunError
from ..parallel.slab import Array, Slab

FAILURES = (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError, OverflowError)  # of a damaged file
TOO_LARGE = "file too large for its file system, or for the limit that ulimit -f shows"
FULL = 1 << 16  # bytes: MPI-IO does not say why it failed, but with less than this left the file system is full


class Part(NamedTuple):
    """This rank's rows of one map in a dataset `name`, below the leading indices `at`."""

    name: str
    at: tuple[int, ...]
    rows: Array


def write(path: Path, slab: Slab, parts: Iterable[Part], in_turn: bool = False) -> None:
    """Every rank writes its rows; collective. `in_turn` forgoes MPI-IO."""
    _move(path, slab, list(parts), "r+", in_turn)


def read(path: Path, slab: Slab, parts: Iterable[Part], in_turn: bool = False) -> None:
    """Every rank reads its rows into `part.rows`; collective. `in_turn` forgoes MPI-IO."""
    _move(path, slab, list(parts), "r", in_turn)


def sync(path: Path, slab: Slab) -> None:
    """Wait until what any rank has written is on the disk; collective."""
    problem = ""
    try:
        sync_one(path)
    except OSError as error:
        problem = f"cannot write {path}: {reason(error)}"
    raise_first(slab, problem)


def sync_one(path: Path) -> None:
    """Wait until a file or directory is on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def overwrite(target: BinaryIO, data: bytes | memoryview, position: int) -> None:
    """Write all of `data` to its place in a file: the system may take less at a time."""
    rest = memoryview(data)
    while rest:
        done = os.pwrite(target.fileno(), rest, position)
        rest, position = rest[done:], position + done


def on_root(slab: Slab, action: Callable[[], Any], what: str, kind: type[Exception] = RunError) -> None:
    """Do something on root; collective. Its failure is an error of this kind on every rank, beginning with `what`."""
    problem = ""
    if slab.root:
        try:
            action()
        except (InputError, RunError) as error:
            problem = str(error)
        except FAILURES as error:
            problem = f"{what}: {reason(error)}"
    if problem := slab.agree(problem):
        raise kind(problem)


def raise_first(slab: Slab, problem: str) -> None:
    """Raise the first rank's problem on all of them; collective."""
    if problem := next((text for text in slab.from_all(problem) if text), ""):
        raise RunError(problem)


def reason(error: BaseException) -> str:
    """Why it failed, in a few words: HDF5 tells the whole story of its own calls."""
    text = str(error)
    if found := re.search(r"error message = '([^']+)'", text):
        return found.group(1)
    if isinstance(error, OSError) and error.strerror and error.errno:
        return TOO_LARGE if error.errno == errno.EFBIG else os.strerror(error.errno)
    return text.splitlines()[0] if text else type(error).__name__


def _move(path: Path, slab: Slab, parts: Sequence[Part], mode: str, in_turn: bool) -> None:
    together = h5py.get_config().mpi and not in_turn and slab.comm.size > 1
    _see(path, slab, mode)
    problem = (_together if together else _by_turns)(path, slab, parts, mode)
    if problem:
        problem = f"cannot {'read' if mode == 'r' else 'write'} {path}: {_explained(problem, path, mode)}"
    raise_first(slab, problem)


def _see(path: Path, slab: Slab, mode: str) -> None:
    """A file that one rank cannot open must not be opened together by the others."""
    problem = ""
    try:
        os.close(os.open(path, os.O_RDONLY if mode == "r" else os.O_RDWR))
    except OSError as error:
        problem = f"cannot open {path}: {reason(error)}"
    raise_first(slab, problem)


def _explained(problem: str, path: Path, mode: str) -> str:
    try:
        space = os.statvfs(path)
    except OSError as error:
        return reason(error)
    full = mode != "r" and space.f_bavail * space.f_frsize < FULL
    return os.strerror(28) if full else problem


def _by_turns(path: Path, slab: Slab, parts: Sequence[Part], mode: str) -> str:
    """One rank after the other; those without rows only wait."""
    problem = ""
    for rank in range(slab.comm.size):
        if rank == slab.comm.rank and slab.shape[0]:
            try:
                _alone(path, slab, parts, mode)
            except FAILURES as error:
                problem = reason(error)
        slab.comm.Barrier()
    return problem


def _alone(path: Path, slab: Slab, parts: Sequence[Part], mode: str) -> None:
    with h5py.File(path, "r", locking=mode == "r") as file:  # what is written to is in a directory of ours
        moves = [_Move(file, part, slab) for part in parts]
        if mode == "r":
            for move in moves:
                move.read()
            return
        places = [move.place for move in moves]
    with path.open("r+b") as target:
        for part, place in zip(parts, places, strict=True):
            overwrite(target, part.rows.data.cast("B"), place)


def _together(path: Path, slab: Slab, parts: Sequence[Part], mode: str) -> str:
    """All ranks at once. Who cannot take part must be known before, and who fails goes on with the rest."""
    problem = ""
    how = h5py.h5p.create(h5py.h5p.DATASET_XFER)
    how.set_dxpl_mpio(h5py.h5fd.MPIO_COLLECTIVE)
    try:
        file = h5py.File(path, mode, driver="mpio", comm=slab.comm)
    except FAILURES as error:
        return reason(error)
    moves = []
    try:
        moves = [_Move(file, part, slab) for part in parts]
    except FAILURES as error:
        problem = reason(error)
    if not any(slab.from_all(problem)):
        for move in moves:
            try:
                move.read(how) if mode == "r" else move.write(how)
            except FAILURES as error:
                problem = problem or reason(error)
    try:
        file.close()
    except FAILURES as error:
        problem = problem or reason(error)
    return problem


class _Move:
    """This rank's rows in memory and in a file; safe for ranks without rows."""

    def __init__(self, file: h5py.File, part: Part, slab: Slab) -> None:
        dataset = file[part.name]
        if (dataset.dtype, dataset.shape[-2:], slab.shape) != (part.rows.dtype, (slab.ny, slab.nx), part.rows.shape):
            kinds = f"{dataset.dtype} {dataset.shape}, not of {part.rows.dtype} {part.rows.shape} and its like"
            raise ValueError(f"{part.name} is of {kinds}")
        self.rows, self._id, self._space = part.rows, dataset.id, dataset.id.get_space()
        count = (1,) * len(part.at) + part.rows.shape
        if part.rows.size:
            self._memory = h5py.h5s.create_simple(count)
            self._space.select_hyperslab((*part.at, slab.rows.start, 0), count)
            index = int(np.ravel_multi_index((*part.at, slab.rows.start, 0), dataset.shape))
            self.place = int(dataset.id.get_offset()) + index * dataset.dtype.itemsize
        else:
            self._memory = h5py.h5s.create_simple((1,))
            self._memory.select_none()
            self._space.select_none()

    def read(self, how: h5py.h5p.PropDXID | None = None) -> None:
        self._id.read(self._memory, self._space, self.rows, dxpl=how)

    def write(self, how: h5py.h5p.PropDXID) -> None:
        self._id.write(self._memory, self._space, self.rows, dxpl=how)
