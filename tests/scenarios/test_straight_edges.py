"""The corrected area of cylinders, whose edges of contact follow the grid, and its estimated error."""

import numpy as np
import pytest
from marching import marched

from parcontact.job import Job
from parcontact.storage.row import StepRow

FINER = 16


def pressed(radius: float, cells: int) -> StepRow:
    job = Job.model_validate(
        {
            "grid": {"points": [4, cells], "size": [4e-3 / cells, 1e-3]},
            "surface": {"shape": "cylinder", "radius": radius, "axis": "x"},
            "material": {"model": "elastic", "shear_modulus": 1e6},
            "history": [{"pressure": 1e4}],
            "numerics": {"tolerance": 1e-6},
        }
    )
    return marched(job)[1][-1]


@pytest.mark.parametrize("radius", np.geomspace(1e-3, 5e-2, 8))
def test_estimate_covers_the_error(radius: float) -> None:
    """At least half of it, in contacts of 5 to 30 of 48 cells. The error, of half a cell at each of two edges at most,
    is taken against 16 times finer cells, of which it is known to a sixteenth."""
    row, fine = pressed(radius, 48), pressed(radius, 48 * FINER)
    exact = fine.measures.contact_area_corrected
    error = abs(row.measures.contact_area_corrected / exact - 1.0)
    assert row.errors is not None
    assert row.errors.area.total > 0.5 * error
    assert row.errors.area.total < 4.0 / (48 * exact)  # half a cell at each edge is 1 of these, and the estimate 3
