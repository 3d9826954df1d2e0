"""Heights from a file: each rank reads its own rows."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

import h5py
import numpy as np
from numpy.typing import NDArray

from .. import datafiles, text_tables
from ..errors import InputError
from ..parallel.slab import Array, Slab

LONGEST_NUMBER = 1000  # tuning: characters in a line of text for each number
Values = NDArray[Any]  # of any type, as in the file


def read_heights(path: Path, dataset: str, slab: Slab, scale: float = 1.0) -> Array:
    """Return the rows of this rank of a map of shape (ny, nx) in a .npy, .h5 or text file, times `scale`; collective.

    Raises InputError on every rank if a rank cannot read its rows, the shape differs, or a value is not a finite
    real number.
    """
    rows, problem = _attempt(path, dataset, slab)
    problem = next((text for text in slab.from_all(problem) if text), "")
    if not problem:
        wrong, largest = slab.reduce(
            [float(np.count_nonzero(~np.isfinite(rows)))], [float(np.abs(rows, dtype=np.float64).max(initial=0.0))]
        )
        problem = f"{path}: {wrong:.0f} of its {slab.points} heights are not finite numbers" if wrong else ""
    if problem:
        raise InputError(problem)
    datafiles.refuse_extreme(path, largest * abs(scale))
    heights = rows.astype(np.float64)
    heights *= scale
    return heights


def _attempt(path: Path, dataset: str, slab: Slab) -> tuple[Values, str]:
    """Return the rows of this rank, or a sentence on an error."""
    try:
        rows = _rows(path, dataset, slab)
        datafiles.refuse_no_numbers(path, rows.dtype)
    except InputError as error:
        return np.empty(0), str(error)
    except Exception as error:  # numpy evaluates headers; every rank must report any error
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
            found = file.get(dataset)
            if not isinstance(found, h5py.Dataset):
                raise InputError(f"{path} has no dataset {dataset!r}; it has {', '.join(file) or 'none'}")
            _check(path, found.shape, slab)
            return np.asarray(found[slab.rows])
    return _text(path, slab)


def _text(path: Path, slab: Slab) -> Values:
    """Read the rows of this rank from a text file with one row per line, see `text_tables`."""
    mine, count = np.empty(slab.shape), 0
    with text_tables.open_text(path) as file:
        head, rows = text_tables.number_rows(path, _short_lines(path, file, slab.nx))
        if wrong := [line for line in head if text_tables.COMMENT.sub("", line).strip()]:
            raise InputError(f"{path}: {slab.nx} numbers a line were expected, got {wrong[0].strip()[:60]!r}")
        for number, row in rows:
            if len(row) != slab.nx:
                raise InputError(f"{path}:{number} has {len(row)} numbers, but the grid has nx = {slab.nx}")
            if slab.rows.start <= count < slab.rows.stop:
                mine[count - slab.rows.start] = row
            count += 1
    _check(path, (count, slab.nx), slab)
    return mine


def _short_lines(path: Path, file: TextIO, count: int) -> Iterator[str]:
    """Yield the lines of a file. Raises InputError for a line too long for `count` numbers."""
    longest = LONGEST_NUMBER * (1 + count)
    for number, line in enumerate(iter(lambda: file.readline(longest), ""), 1):
        if len(line) == longest:
            raise InputError(f"{path}:{number} has {longest} characters or more; {count} numbers were expected")
        yield line


def _check(path: Path, shape: tuple[int, ...], slab: Slab) -> None:
    if shape != (slab.ny, slab.nx):
        raise InputError(f"{path} has shape {shape}, but the grid has (ny, nx) = {slab.ny, slab.nx}")
