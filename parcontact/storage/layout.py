"""HDF5 files laid out with places for all maps before the first is written.

What is not a map is written once, by root; what is one has its place and changes nothing else, so that a run killed
while it writes leaves a readable file.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..parallel.slab import Array, Slab
from . import hdf5
from .hdf5 import overwrite

PIECE = 1 << 16  # bytes read at a time
DOUBLE = 8  # bytes of a number in a map
RESERVE = 1 << 20  # bytes: more than HDF5 writes of what is not a map; it does not survive a disk that is full


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

    hdf5.on_root(slab, make, f"cannot make {path}")


def change(path: Path, slab: Slab, act: Callable[[h5py.File], None]) -> None:
    """Change attributes of a file, which keep their size, on root with `act(file)`; collective."""

    def apply() -> None:
        with h5py.File(path, "r+", locking=False) as file:
            act(file)

    hdf5.on_root(slab, apply, f"cannot write {path}")


def put(path: Path, values: Mapping[str, NDArray[Any]]) -> None:
    """Write whole datasets that are no maps; root only."""
    with h5py.File(path, "r", locking=False) as file:
        places = {name: file[name].id.get_offset() for name in values}
        types = {name: file[name].dtype for name in values}
    with path.open("r+b") as target:
        for name, numbers in values.items():
            overwrite(target.fileno(), numbers.astype(types[name]).tobytes(), places[name])


def regions(file: h5py.File) -> list[tuple[int, int]]:
    """Return where in a file its maps are, from byte to byte, in order; those next to each other as one."""
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
    """Yield all that is not in these regions of a file of `size` bytes, from `start` on, in pieces."""
    for first, last in [*found, (size, size)]:
        for position in range(start, first, PIECE):
            yield position, min(position + PIECE, first)
        start = last


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
