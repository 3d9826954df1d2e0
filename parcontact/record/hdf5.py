"""HDF5 files of which every rank writes and reads its rows: by MPI-IO where h5py has it, else by the ranks in turn.

The file is the same either way: root lays it out with places for all maps, then every rank writes into its own, which
changes nothing else, so that a run killed while it writes leaves a readable file. HDF5 does not survive a disk that is
full when it writes what is not a map: it does that in memory, from where plain writing takes it to the disk.

An error on one rank is raised on all, as a RunError in one sentence.
"""

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, TypeVar

import h5py
import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..errors import RunError
from ..parallel.slab import Array, Slab

T = TypeVar("T")
FAILURES = (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError, OverflowError)  # of a damaged file
PIECE = 1 << 20  # bytes read at a time
FULL = 1 << 16  # bytes: MPI-IO does not say why it failed, but with less than this left the file system is full


class Part(NamedTuple):
    """This rank's rows of one map in a dataset `name`, below the leading indices `at`."""

    name: str
    at: tuple[int, ...]
    rows: Array


def lay_out(path: Path, slab: Slab, build: Callable[[h5py.File], None], block: int = 0) -> None:
    """Root makes the file with `build(file)`, after an empty `block` of bytes; collective."""

    def make() -> None:
        with _memory() as memory:
            with h5py.File(memory, "w", userblock_size=block) as file:
                build(file)
                found = regions(file)
            size = os.fstat(memory.fileno()).st_size
            with path.open("wb") as target:
                target.truncate(size)
                _copy(memory, target, outside(size, found))

    on_root(slab, make, f"cannot make {path}")


def change(path: Path, slab: Slab, act: Callable[[h5py.File], None]) -> None:
    """Root changes a file, but neither its maps nor its length, with `act(file)`; collective."""

    def apply() -> None:
        with h5py.File(path, "r") as file:
            found = regions(file)
        with _memory() as memory, path.open("r+b") as target:
            size = os.fstat(target.fileno()).st_size
            memory.truncate(size)
            spans = list(outside(size, found))
            _copy(target, memory, spans)
            with h5py.File(memory, "r+") as file:
                act(file)
            if os.fstat(memory.fileno()).st_size != size:
                raise ValueError("its length may not change")
            _copy(memory, target, spans)

    on_root(slab, apply, f"cannot write {path}")


def put(path: Path, values: Mapping[str, NDArray[Any]]) -> None:
    """Write whole datasets that are no maps; root only."""
    with h5py.File(path, "r") as file:
        places = {name: file[name].id.get_offset() for name in values}
        types = {name: file[name].dtype for name in values}
    with path.open("r+b") as target:
        for name, numbers in values.items():
            _put(target, numbers.astype(types[name]).tobytes(), places[name])


def regions(file: h5py.File) -> list[tuple[int, int]]:
    """Where in a file its maps are, from byte to byte, in order; those next to each other as one."""
    names: list[str] = []
    file.visit(names.append)
    items = (file[name] for name in names)
    places = [(item.id.get_offset(), item.nbytes) for item in items if isinstance(item, h5py.Dataset) and item.ndim > 1]
    merged: list[tuple[int, int]] = []
    for start, length in sorted(place for place in places if place[1]):
        merged.append((merged.pop()[0] if merged and merged[-1][1] == start else start, start + length))
    return merged


def outside(size: int, found: Iterable[Sequence[int]], start: int = 0) -> Iterator[tuple[int, int]]:
    """All that is not in these regions of a file of `size` bytes, from `start` on, in pieces."""
    for first, last in [*found, (size, size)]:
        for position in range(start, first, PIECE):
            yield position, min(position + PIECE, first)
        start = last


def _memory() -> BinaryIO:
    """A file in memory, whose holes take none."""
    return open(os.memfd_create("hdf5"), "w+b", buffering=0)


def _copy(source: BinaryIO, target: BinaryIO, spans: Iterable[tuple[int, int]]) -> None:
    for start, stop in spans:
        _put(target, os.pread(source.fileno(), stop - start, start), start)


def _put(target: BinaryIO, data: bytes | memoryview, position: int) -> None:
    """Write all of it: the system may take less at a time."""
    rest = memoryview(data)
    while rest:
        done = os.pwrite(target.fileno(), rest, position)
        rest, position = rest[done:], position + done


def write(path: Path, slab: Slab, parts: Iterable[Part], in_turn: bool = False) -> None:
    """Every rank writes its rows; collective. `in_turn` forgoes MPI-IO."""
    _move(path, slab, list(parts), "r+", in_turn)


def read(path: Path, slab: Slab, parts: Iterable[Part], in_turn: bool = False) -> None:
    """Every rank reads its rows into `part.rows`; collective. `in_turn` forgoes MPI-IO."""
    _move(path, slab, list(parts), "r", in_turn)


def sync(path: Path, slab: Slab) -> None:
    """Wait until what any rank has written is on the disk; collective."""
    while_syncing(path, slab, lambda: None)


def while_syncing(path: Path, slab: Slab, meanwhile: Callable[[], T]) -> T:
    """As `sync`; returns what was done `meanwhile`."""
    problem = ""
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(sync_one, path)
        result = meanwhile()
        try:
            waiting.result()
        except OSError as error:
            problem = f"cannot write {path}: {reason(error)}"
    raise_first(slab, problem)
    return result


def sync_one(path: Path) -> None:
    """Wait until a file or directory is on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def on_root(slab: Slab, action: Callable[[], Any], what: str, kind: type[Exception] = RunError) -> None:
    """Do something on root; collective. Its failure is an error of this kind on every rank, beginning with `what`."""
    problem = ""
    if slab.root:
        try:
            action()
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
        return os.strerror(error.errno)
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
    with h5py.File(path, "r") as file:
        moves = [_Move(file, part, slab) for part in parts]
        if mode == "r":
            for move in moves:
                move.read()
            return
        places = [move.place for move in moves]
    with path.open("r+b") as target:
        for part, place in zip(parts, places, strict=True):
            _put(target, part.rows.data.cast("B"), place)


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


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """A temporary name to write to; on leaving without an error the file takes the place of `path`."""
    part = path.with_name(path.name + ".part")
    yield part
    part.replace(path)


def fixed(file: h5py.File, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> h5py.Dataset:
    """A dataset whose space is set aside at once, so that writing to it never changes the file's structure."""
    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_layout(h5py.h5d.CONTIGUOUS)
    plist.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    plist.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    space = h5py.h5s.create_simple(shape)
    group, _, leaf = name.rpartition("/")
    parent = file.require_group(group) if group else file
    h5py.h5d.create(parent.id, leaf.encode(), h5py.h5t.py_create(np.dtype(dtype)), space, dcpl=plist)
    return parent[leaf]
