"""Results of a run as an xarray.Dataset, read when needed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from ..columns import MEASURES, PER_BRANCH
from ..errors import InputError
from ..storage import fields, hdf5, read_back
from .given_jobs import path_of

if TYPE_CHECKING:
    import xarray

UNITS = {column.name: column.unit or "1" for column in MEASURES}
NO_XARRAY = "parcontact.open needs xarray, which is not installed: pip install xarray (see parcontact manual install)"


def open(directory: str | os.PathLike[str]) -> xarray.Dataset:
    """Return the results of a run, also of a running one, as a dataset.

    The columns of measures.csv along `step`, with the coordinate `time` [s]; maps of fields.h5 as `pressure_map`,
    `gap_map`, ..., of shape (t, y, x), read when used, with the coordinates `t` [s] and `map_step`:
    `friction.sel(step=map_step)` is the friction of each map. Variables have `units`, `1` if dimensionless; columns of
    other packages' effects have none. Values that were not requested are NaN. Raises InputError for a directory without
    results, ImportError without xarray.
    """
    try:
        import xarray
    except ImportError as error:
        raise ImportError(NO_XARRAY) from error
    path = path_of(directory)
    if not (path / "measures.csv").is_file():
        raise InputError(f"{path} has no measures.csv: it is not the output directory of a run")
    columns = read_back.read_results(path / "measures.csv")
    steps, times = np.array(columns["step"], dtype=int), columns["time"]
    found: dict[str, Any] = {name: ("step", values, _units(name)) for name, values in columns.items()}
    del found["step"], found["time"]
    coordinates: dict[str, Any] = {"step": ("step", steps, _units("step")), "time": ("step", times, _units("time"))}
    if (path / "fields.h5").is_file():
        _add_maps(path / "fields.h5", found, coordinates)
    return xarray.Dataset(found, coordinates)


def _units(name: str) -> dict[str, str]:
    unit = UNITS.get(PER_BRANCH if name.startswith("dissipated_") else name)
    return {"units": unit} if unit else {}


def _add_maps(path: Path, found: dict[str, Any], coordinates: dict[str, Any]) -> None:
    from xarray.core.indexing import LazilyIndexedArray

    from .lazy import SavedMap

    try:
        with h5py.File(path, "r") as file:
            layout = fields.SavedFields(file)
            saved = np.flatnonzero(~np.isnan(layout.times))
            coordinates["t"] = ("t", layout.times[saved], {"units": "s"})
            coordinates["map_step"] = ("t", file["step"][...][saved], _units("step"))
            coordinates |= {name: (name, file[name][...], {"units": "m"}) for name in ("y", "x")}
            maps = {name: SavedMap(path, name, file[name].shape, file[name].dtype, saved) for name in layout.names}
    except hdf5.FAILURES as error:
        raise InputError(f"{path} cannot be read: {hdf5.reason(error)}") from None
    for name, rows in maps.items():
        found[f"{name}_map"] = (("t", "y", "x"), LazilyIndexedArray(rows), {"units": fields.UNITS[name]})
