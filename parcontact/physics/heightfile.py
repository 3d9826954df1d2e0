"""Heights from a file: each rank reads its own rows."""

import os
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from .. import datafiles
from ..errors import InputError
from ..parallel.slab import Array, Slab

Values = NDArray[Any]  # as they stand in the file
LINE_PER_NUMBER, LINE_MORE = 64, 100_000  # characters of a line of text, at most, and of its comments
MANY_TIMES = 4  # as many rows as the grid has: then no more are counted
MAX_LINKS = 30  # from a name in an HDF5 file to what it means
LOWEST, HIGHEST = 1e-70, 1e70  # of the largest height: its fourth power is a number of double precision


def read(path: Path, dataset: str, slab: Slab, scale: float = 1.0) -> Array:
    """This rank's rows of the map of shape (ny, nx) in a .npy, .h5 or text file, times `scale`; collective.

    Raises InputError on every rank when a rank cannot read its rows, the shape is another one, or a value is no finite
    real number.
    """
    rows, problem = _attempt(path, dataset, slab)
    problem = next((text for text in slab.from_all(problem) if text), "")
    if not problem:
        wrong, largest = slab.reduce(
            [float(np.count_nonzero(~np.isfinite(rows)))], [float(np.abs(rows, dtype=np.float64).max(initial=0.0))]
        )
        problem = f"{path}: {wrong:.0f} of its {slab.points} heights are not finite numbers" if wrong else ""
        largest *= abs(scale)
        if not problem and largest and not LOWEST <= largest <= HIGHEST:
            problem = f"{path}: its largest height is {largest:.3g} m, which cannot be computed with"
    if problem:
        raise InputError(problem)
    heights = rows.astype(np.float64)
    heights *= scale
    return heights


def _attempt(path: Path, dataset: str, slab: Slab) -> tuple[Values, str]:
    """This rank's rows, and what is wrong with them."""
    try:
        rows = _rows(path, dataset, slab)
        datafiles.refuse_no_numbers(path, rows.dtype)
    except InputError as error:
        return np.empty(0), str(error)
    except Exception as error:  # numpy reads a header as Python; every rank must learn of it, whatever it is
        number = getattr(error, "errno", None)
        reason = os.strerror(number) if number else str(error).partition("\n")[0]
        return np.empty(0), f"{path} cannot be read: {reason}"
    return rows, ""


def _rows(path: Path, dataset: str, slab: Slab) -> Values:
    if path.suffix == ".npy":
        whole = datafiles.open_numbers(path)
        _check(path, whole.shape, slab)
        return whole[slab.rows]
    if path.suffix == ".h5":
        with h5py.File(path) as file:
            _refuse_elsewhere(path, file, dataset)
            found = file.get(dataset)
            if not isinstance(found, h5py.Dataset):
                raise InputError(f"{path} has no dataset {dataset!r}; it has {', '.join(file) or 'none'}")
            if found.external or found.is_virtual:
                raise InputError(f"{path}: the heights of {dataset!r} lie in other files; copy them into this one")
            _check(path, found.shape, slab)
            return np.asarray(found[slab.rows])
    return _text(path, slab)


def _refuse_elsewhere(path: Path, file: h5py.File, name: str) -> None:
    """Links from one name to the next are followed within the file only, and not in circles."""
    parts, place, links = [part for part in name.split("/") if part], "/", 0
    while parts:
        part = parts.pop(0)
        group = file.get(place)
        known = isinstance(group, h5py.Group) and group.id.links.exists(part.encode())  # `in` would follow it
        link = group.get(part, getlink=True) if known else None
        if isinstance(link, h5py.ExternalLink):
            raise InputError(
                f"{path}: {name!r} is a link into another file, {link.filename!r}; copy the heights into this one"
            )
        if isinstance(link, h5py.SoftLink):
            links += 1
            if links > MAX_LINKS:
                raise InputError(f"{path}: {name!r} is a link that leads to itself")
            place = "/" if link.path.startswith("/") else place
            parts = [each for each in link.path.split("/") if each] + parts
        else:
            place = f"{place.rstrip('/')}/{part}"


def _text(path: Path, slab: Slab) -> Values:
    """A line is a row, its numbers separated by blanks; what follows a # does not count."""
    mine, count = np.empty(slab.shape), 0
    limit = LINE_PER_NUMBER * slab.nx + LINE_MORE
    with path.open() as lines:
        for number, line in enumerate(iter(lambda: lines.readline(limit), ""), 1):
            if len(line) == limit:
                raise InputError(
                    f"{path}:{number} is longer than {limit} characters, which is no row of {slab.nx} numbers"
                )
            words = line.partition("#")[0].split()
            if words and len(words) != slab.nx:
                raise InputError(f"{path}:{number} has {len(words)} numbers, but the grid has nx = {slab.nx}")
            if words and slab.rows.start <= count < slab.rows.stop:
                mine[count - slab.rows.start] = words
            count += bool(words)
            if count > MANY_TIMES * slab.ny:
                raise InputError(f"{path} has more than {MANY_TIMES * slab.ny} rows, but the grid has ny = {slab.ny}")
    _check(path, (count, slab.nx), slab)
    return mine


def _check(path: Path, shape: tuple[int, ...], slab: Slab) -> None:
    if shape != (slab.ny, slab.nx):
        raise InputError(f"{path} has shape {shape}, but the grid has (ny, nx) = {slab.ny, slab.nx}")
