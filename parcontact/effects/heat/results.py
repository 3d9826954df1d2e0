"""Sentences on the temperatures of a run."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...results.slide import largest, mean_of_slide


def said_of_slide(columns: Mapping[str, Sequence[float]], rows: NDArray[np.intp]) -> Iterator[str]:
    """Yield a sentence on the temperatures of one slide. `rows` are the numbers of the slide's rows in `columns`."""
    if "flash_temperature" in columns:
        mean, _ = mean_of_slide(columns, rows, "flash_temperature")
        hottest = largest(columns["max_temperature"][row] for row in rows[1:])
        yield f"the mean flash temperature over the same distance is {mean:.3g} K, at most {hottest:.3g} K at a point"
