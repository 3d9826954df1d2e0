"""The table of a run so far, about which capabilities have sentences and headlines."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..job import Job
from ..job.added_sections import answers

SAME_LOAD = 1e-9  # rounding: relative difference below which loads are the same


class RunTable(NamedTuple):
    """Columns of measures.csv in a directory, with the job of the run, None if it is not stored there. Its surfaces
    may have `detached`."""

    directory: Path
    job: Job | None
    columns: Mapping[str, Sequence[float]]
    detached: bool


def find_telling_row(run: RunTable) -> int:
    """Return the row that shows the contact of a run: the last row; after a detachment the row that a capability names,
    else the last row of the largest load."""
    pressure, area = (np.asarray(run.columns[name], float) for name in ("pressure", "contact_area"))
    if area[-1] > 0.0 and not run.detached:
        return len(area) - 1
    named = (row for telling in answers("results", "telling_row") for row in telling(run))
    return next(named, int(np.flatnonzero(pressure >= (1.0 - SAME_LOAD) * pressure.max())[-1]))
