"""HDF5 files laid out with places for all maps before the first is written.

What is not a map is written once, by root; what is one has its place and changes nothing else, so that a run killed
while it writes leaves a readable file. HDF5 does not survive a disk that is full when it writes what is not a map: it
does that in memory, from where plain writing takes it to the disk.
"""

import io
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..parallel.slab import Array, Slab
from . import hdf5
from .hdf5 import overwrite

PIECE = 1 << 16  # bytes read at a time


def lay_out(path: Path, slab: Slab, build: Callable[[h5py.File], None], block: int = 0) -> None:
    """Root makes the file with `build(file)`, after an empty `block` of bytes; collective. The name must be unused."""

    def make() -> None:
        memory = _Memory()
        with h5py.File(memory, "w", userblock_size=block) as file:
            build(file)
            found = regions(file)
        with path.open("xb") as target, _removed_after_an_error(path):
            target.truncate(memory.size)
            for start, stop in outside(memory.size, found):
                overwrite(target, memory.piece(start, stop - start), start)

    hdf5.on_root(slab, make, f"cannot make {path}")


def change(path: Path, slab: Slab, act: Callable[[h5py.File], None]) -> None:
    """Root changes a file, but neither its maps nor its length, with `act(file)`; collective."""

    def apply() -> None:
        with h5py.File(path, "r", locking=False) as file:
            found = regions(file)
        with path.open("r+b") as target:
            memory, size = _Memory(), os.fstat(target.fileno()).st_size
            memory.truncate(size)
            spans = list(outside(size, found))
            for start, stop in spans:
                memory.put(os.pread(target.fileno(), stop - start, start), start)
            with h5py.File(memory, "r+") as file:
                act(file)
            if memory.size != size:
                raise ValueError("its length may not change")
            for start, stop in spans:
                overwrite(target, memory.piece(start, stop - start), start)

    hdf5.on_root(slab, apply, f"cannot write {path}")


def put(path: Path, values: Mapping[str, NDArray[Any]]) -> None:
    """Write whole datasets that are no maps; root only."""
    with h5py.File(path, "r", locking=False) as file:
        places = {name: file[name].id.get_offset() for name in values}
        types = {name: file[name].dtype for name in values}
    with path.open("r+b") as target:
        for name, numbers in values.items():
            overwrite(target, numbers.astype(types[name]).tobytes(), places[name])


def regions(file: h5py.File) -> list[tuple[int, int]]:
    """Where in a file its maps are, from byte to byte, in order; those next to each other as one."""
    names: list[str] = []
    file.visit(names.append)
    items = (file[name] for name in names)
    maps = [item for item in items if isinstance(item, h5py.Dataset) and item.ndim > 1]
    places = [(item.id.get_offset(), item.nbytes) for item in maps if item.id.get_offset() is not None]
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


@contextmanager
def _removed_after_an_error(path: Path) -> Iterator[None]:
    try:
        yield
    except BaseException:
        path.unlink(missing_ok=True)
        raise


class _Memory(io.RawIOBase):
    """A file in memory for HDF5, which crashes where a write fails; the places of maps, never written, take no room."""

    def __init__(self) -> None:
        self.size, self._at = 0, 0
        self._pages: dict[int, bytearray] = {}

    def put(self, data: bytes | memoryview, start: int) -> None:
        """Write from a place on."""
        done = 0
        while done < len(data):
            number, first = divmod(start + done, PIECE)
            count = min(PIECE - first, len(data) - done)
            page = self._pages.setdefault(number, bytearray(PIECE))
            page[first : first + count] = data[done : done + count]
            done += count
        self.size = max(self.size, start + len(data))

    def piece(self, start: int, length: int) -> bytes:
        """Read from a place on."""
        stop = min(start + length, self.size)
        numbers = range(start // PIECE, -(-stop // PIECE))
        whole = b"".join(self._pages.get(number, bytes(PIECE)) for number in numbers)
        return whole[start % PIECE : start % PIECE + max(0, stop - start)]

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        self._at = offset + {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self.size}[whence]
        return self._at

    def readinto(self, buffer: Any) -> int:
        data = self.piece(self._at, len(buffer))
        buffer[: len(data)] = data
        self._at += len(data)
        return len(data)

    def write(self, data: Any) -> int:
        self.put(memoryview(data), self._at)
        self._at += len(data)
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        self.size = self._at if size is None else size
        return self.size


def fixed(file: h5py.File, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> h5py.Dataset:
    """A dataset whose space is set aside at once, so that writing to it never changes the file's structure."""
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
    """Add a coordinate of the maps of a file."""
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
