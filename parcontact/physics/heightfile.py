"""Heights from a file: each rank reads its own rows."""

from pathlib import Path

import h5py
import numpy as np

from ..errors import InputError
from ..parallel.slab import Array, Slab


def read(path: Path, dataset: str, slab: Slab) -> Array:
    """This rank's rows of the map in a .npy, .h5 or .txt file of shape (ny, nx); collective.

    Raises InputError on every rank when the shape is another one or a value is not finite.
    """
    rows, problem = _rows(path, dataset, slab)
    bad = 0.0 if problem else float(np.count_nonzero(~np.isfinite(rows)))
    problem = next((text for text in slab.from_all(problem) if text), "")
    if not problem and (count := slab.sum(bad)[0]):
        problem = f"{path}: {int(count)} of its {slab.points} heights are not finite numbers"
    if problem:
        raise InputError(problem)
    return rows


def _rows(path: Path, dataset: str, slab: Slab) -> tuple[Array, str]:
    wanted = (slab.ny, slab.nx)
    try:
        if path.suffix == ".npy":
            whole = np.load(path, mmap_mode="r")
            shape, part = whole.shape, whole[slab.rows] if whole.shape == wanted else None
        elif path.suffix == ".h5":
            with h5py.File(path) as file:
                if dataset not in file:
                    return np.empty(0), f"{path} has no dataset {dataset!r}; it has {', '.join(file) or 'none'}"
                shape = file[dataset].shape
                part = file[dataset][slab.rows] if shape == wanted else None
        else:
            with path.open() as lines:
                data = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
            shape = (len(data), len(data[0].split()) if data else 0)
            mine = data[slab.rows]
            part = np.loadtxt(mine, ndmin=2) if mine and shape == wanted else np.empty((0, slab.nx))
            part = part if shape == wanted else None
    except (OSError, ValueError) as error:
        return np.empty(0), f"{path} cannot be read: {error}"
    if part is None:
        return np.empty(0), f"{path} has shape {shape}, but the grid has (ny, nx) = {wanted}"
    return np.asarray(part, dtype=np.float64), ""
