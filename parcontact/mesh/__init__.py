"""Jobs whose grid is given by words: `points: auto`, and `from surface` for points and size of a measured map.

`load` and `load_cases` read a job like the functions of the same names in `job`, and replace these words by numbers.
"""

from functools import partial

from .. import job
from .chosen_mesh import fill_grid, find_shortest_wave, points_for

load = partial(job.load, fill_grid=fill_grid)
load_cases = partial(job.load_cases, fill_grid=fill_grid)

__all__ = ["find_shortest_wave", "load", "load_cases", "points_for"]
