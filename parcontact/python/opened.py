"""Results of a directory, for notebooks and scripts."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from ..errors import InputError
from ..results.results import Results
from .given_jobs import path_of

if TYPE_CHECKING:
    import xarray


def open(directory: str | os.PathLike[str]) -> xarray.Dataset:
    """Return the results of a run, also of a running one, as a dataset.

    The columns of measures.csv along `step`, with the coordinate `time` [s]; maps of fields.h5 as `pressure_map`,
    `gap_map`, ..., of shape (t, y, x), read when used, with the coordinates `t` [s] and `map_step`:
    `friction.sel(step=map_step)` is the friction of each map. Variables have `units`, `1` if dimensionless; columns of
    other packages' effects have none. Values that were not requested are NaN. Raises InputError for a directory without
    results, ImportError without xarray.
    """
    run = Results(path_of(directory), "run")
    if "run" not in run.kinds:
        raise InputError(f"{run.path} has no measures.csv: it is not the output directory of a run")
    return run.dataset
