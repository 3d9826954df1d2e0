"""Maps in HDF5 files: by MPI-IO where h5py has it, else by the ranks in turn; the file is the same either way.

A file is laid out with places for all maps before the first is written. What is not a map is written once, by root; the
rows of a map go to their place and change nothing else, so that a run killed while it writes leaves a readable file. An
error on one rank is raised on all, as a RunError in one sentence.
"""

import errno
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import h5py
import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..errors import InputError, RunError
from ..parallel import root
from ..parallel.mpi import MPI
from ..parallel.slab import Array, Slab

T = TypeVar("T")
MPI_IO = h5py.get_config().mpi  # else ranks act in turn
FAILURES = (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError, OverflowError)  # of a damaged file
TOO_LARGE = "file too large for its file system, or for the limit that ulimit -f shows"
MEND = "put the whole file in its place, or move it away to go on without its maps"
FULL = 1 << 16  # tuning: bytes: MPI-IO does not say why it failed, but with less than this left the file system is full
DOUBLE = 8  # bytes of a number in a map
RESERVE = 1 << 20  # tuning: bytes: more than HDF5 writes of what is not a map; it does not survive a disk that is full


class Slice(NamedTuple):
    """This rank's rows of one map in a dataset `name`, below the leading indices `at`."""

    name: str
    at: tuple[int, ...]
    rows: Array


def write_rows(path: Path, slab: Slab, parts: Iterable[Slice]) -> None:
    """Write the rows of every rank; collective."""
    _move(path, slab, list(parts), True)


def read_rows(path: Path, slab: Slab, parts: Iterable[Slice]) -> None:
    """Read the rows of every rank into `part.rows`; collective."""
    _move(path, slab, list(parts), False)


def open_results(path: Path) -> h5py.File:
    """Open a file of results to read it. Raises InputError where it is damaged, or one of its members is that of
    another file, which whoever made the file chose, and FileNotFoundError."""
    try:
        file = h5py.File(path, "r", locking=False)
    except FileNotFoundError:
        raise
    except FAILURES as error:
        raise InputError(f"{path} cannot be read: {reason(error)}; {MEND}") from error
    for name in file:
        if isinstance(file.get(name, getlink=True), h5py.ExternalLink) or _has_outside_data(file[name]):
            file.close()
            raise InputError(f"{path}: {name} is stored in another file, which is not read: copy it into this one")
    return file


def _has_outside_data(item: Any) -> bool:
    return isinstance(item, h5py.Dataset) and (item.is_virtual or item.external is not None)


def sync(path: Path, slab: Slab) -> None:
    """Wait until what any rank has written is on the disk; collective."""
    problem = ""
    try:
        sync_one(path)
    except OSError as error:
        problem = f"cannot write {path}: {reason(error)}"
    raise_first(slab, problem)


def sync_one(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def write_on_root(slab: Slab, action: Callable[[], T], what: str, kind: type[Exception] = RunError) -> T:
    """Return what root does; collective. Its failure is an error of this kind on every rank, beginning with `what`."""

    def attempt() -> T:
        try:
            return action()
        except FAILURES as error:
            raise kind(f"{what}: {reason(error)}") from error

    return root.on_root(slab.comm, attempt)


def raise_first(slab: Slab, problem: str) -> None:
    """Raise the first rank's problem on all of them; collective."""
    if problem := next((text for text in slab.from_all(problem) if text), ""):
        raise RunError(problem)


def reason(error: BaseException) -> str:
    """Return the reason of a failure in a few words: HDF5 tells the whole story of its own calls."""
    text = str(error)
    if found := re.search(r"error message = '([^']+)'", text):
        return found.group(1)
    if found := re.search(r"truncated file: eof = (\d+), sblock->base_addr = (\d+), stored_eof = (\d+)", text):
        return f"it is cut off: {int(found[1]) + int(found[2])} of its {found[3]} bytes are there"
    if "file signature not found" in text:
        return "it is no HDF5 file, or cut off"
    if isinstance(error, OSError) and error.strerror and error.errno:
        return TOO_LARGE if error.errno == errno.EFBIG else os.strerror(error.errno)
    return text.splitlines()[0] if text else type(error).__name__


def _move(path: Path, slab: Slab, parts: Sequence[Slice], writes: bool) -> None:
    """Write or read the rows at their places; collective. One rank that cannot take part is an error of all before."""
    what, problem, places = f"cannot {'write' if writes else 'read'} {path}", "", list[int]()
    try:
        os.close(os.open(path, os.O_RDWR if writes else os.O_RDONLY))
        with h5py.File(path, "r", locking=False) as file:
            places = [_place(file[part.name], part, slab) for part in parts]
    except OSError as error:
        problem = f"cannot open {path}: {reason(error)}"
    except FAILURES as error:
        problem = f"{what}: {reason(error)}"
    raise_first(slab, problem)
    if problem := (_together if MPI_IO and slab.comm.size > 1 else _by_turns)(path, slab, parts, places, writes):
        space = os.statvfs(path)
        full = writes and space.f_bavail * space.f_frsize < FULL
        problem = f"{what}: {os.strerror(errno.ENOSPC) if full else problem}"
    raise_first(slab, problem)


def _place(dataset: h5py.Dataset, part: Slice, slab: Slab) -> int:
    """Return where in the file the rows of this rank begin; raises ValueError if they are of another kind."""
    if (dataset.dtype, dataset.shape[-2:], slab.shape) != (part.rows.dtype, (slab.ny, slab.nx), part.rows.shape):
        kinds = f"{dataset.dtype} {dataset.shape}, not of {part.rows.dtype} {part.rows.shape} and its like"
        raise ValueError(f"{part.name} is of {kinds}")
    if not part.rows.size:
        return 0
    index = int(np.ravel_multi_index((*part.at, slab.rows.start, 0), dataset.shape))
    return int(dataset.id.get_offset()) + index * dataset.dtype.itemsize


def _by_turns(path: Path, slab: Slab, parts: Sequence[Slice], places: Sequence[int], writes: bool) -> str:
    """Let one rank act after the other, those without rows only wait; returns what failed on this rank, or ''."""
    problem = ""
    for rank in range(slab.comm.size):
        if rank == slab.comm.rank and slab.shape[0]:
            try:
                with path.open("r+b") if writes else path.open("rb") as file:
                    for part, place in zip(parts, places, strict=True):
                        file.seek(place)
                        if (file.write if writes else file.readinto)(part.rows.data.cast("B")) < part.rows.nbytes:
                            raise ValueError("it ends early")
            except FAILURES as error:
                problem = reason(error)
        slab.comm.Barrier()
    return problem


def _together(path: Path, slab: Slab, parts: Sequence[Slice], places: Sequence[int], writes: bool) -> str:
    """Let all ranks act at once, by MPI-IO, also after a failure, which is returned."""
    problem = ""
    try:
        file = MPI.File.Open(slab.comm, str(path), MPI.MODE_RDWR if writes else MPI.MODE_RDONLY)
    except MPI.Exception as error:
        return str(error)
    for part, place in zip(parts, places, strict=True):
        try:
            (file.Write_at_all if writes else file.Read_at_all)(place, part.rows)
        except MPI.Exception as error:
            problem = problem or str(error)
    try:
        file.Close()
    except MPI.Exception as error:
        problem = problem or str(error)
    return problem


# -- files laid out with places for all maps before the first is written -----------------------------------------------


def lay_out(path: Path, slab: Slab, build: Callable[[h5py.File], None], size: int, block: int = 0) -> None:
    """Make the file on root with `build(file)`, after an empty `block` of bytes; collective. The name must be unused.

    All maps take `size` bytes. That there is room for the rest of the file, and no limit to its length, is tried first.
    """

    def make() -> None:
        try:
            with path.open("xb") as probe:
                probe.write(bytes(RESERVE))
                probe.truncate(RESERVE + size)
            with h5py.File(path, "w", userblock_size=block, locking=False) as file:
                build(file)
        except BaseException:
            path.unlink(missing_ok=True)
            raise

    write_on_root(slab, make, f"cannot make {path}")


def change(path: Path, slab: Slab, act: Callable[[h5py.File], None]) -> None:
    """Change attributes of a file, which keep their size, on root with `act(file)`; collective."""

    def apply() -> None:
        with h5py.File(path, "r+", locking=False) as file:
            act(file)

    write_on_root(slab, apply, f"cannot write {path}")


def put(path: Path, values: Mapping[str, NDArray[Any]]) -> None:
    """Write whole datasets that are no maps; root only."""
    with h5py.File(path, "r", locking=False) as file:
        places = {name: file[name].id.get_offset() for name in values}
        types = {name: file[name].dtype for name in values}
    with path.open("r+b") as target:
        for name, numbers in values.items():
            target.seek(places[name])
            target.write(numbers.astype(types[name]).tobytes())


def save_maps(path: Path, slab: Slab, index: int, maps: Mapping[str, Array], marks: Mapping[str, float]) -> None:
    """Put maps of one instant or point into their place, and then its coordinates, the `marks`; collective."""
    write_rows(
        path, slab, [Slice(name, (index,), np.ascontiguousarray(rows, np.float64)) for name, rows in maps.items()]
    )
    set_marks(path, slab, index, marks)


def set_marks(path: Path, slab: Slab, index: Any, marks: Mapping[str, Any]) -> None:
    """Set coordinates of instants or points, which tell that their maps are saved (NaN: not saved); collective."""

    def act() -> None:
        with h5py.File(path, "r", locking=False) as file:
            axes = {name: file[name][...] for name in marks}
        for name, value in marks.items():
            axes[name][index] = value
        put(path, axes)

    write_on_root(slab, act, f"cannot write {path}")


def fixed(file: h5py.File, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> h5py.Dataset:
    """Add a dataset whose space is set aside at once, so that writing to it never changes the structure of the file."""
    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_layout(h5py.h5d.CONTIGUOUS)
    plist.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    plist.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    plist.set_obj_track_times(False)  # the same data make the same bytes at any time
    space = h5py.h5s.create_simple(shape)
    group, _, leaf = name.rpartition("/")
    parent = file.require_group(group) if group else file
    h5py.h5d.create(parent.id, leaf.encode(), h5py.h5t.py_create(np.dtype(dtype)), space, dcpl=plist)
    return parent[leaf]


def add_coordinate(file: h5py.File, name: str, values: Array, unit: str) -> None:
    dataset = fixed(file, name, values.shape, np.float64)
    dataset[...] = values
    dataset.make_scale(name)
    dataset.attrs["units"] = unit


def add_maps(
    file: h5py.File, slab: Slab, size: tuple[float, float], units: Mapping[str, str], leading: Sequence[str]
) -> None:
    """Add x and y [m] of a box of this `size`, and maps of these `units` by name, of shape (n, y, x).

    `leading` names the coordinates along the first dimension, which are there.
    """
    for axis, length, points in zip("xy", size, (slab.nx, slab.ny), strict=True):
        add_coordinate(file, axis, np.arange(points) * (length / points), "m")
    for name, unit in units.items():
        dataset = fixed(file, name, (len(file[leading[0]]), slab.ny, slab.nx), np.float64)
        dataset.attrs["units"] = unit
        for dimension, axes in enumerate((leading, "y", "x")):
            for axis in axes:
                dataset.dims[dimension].attach_scale(file[axis])
