"""Comparison of a run with Persson's theory: highest and dynamic friction and contact area."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from ..job import Stage
from ..printed import with_error
from . import slide, theory_settings
from .results import Results

RUN = "measures.csv"


class ComparedResult(NamedTuple):
    """A result [-] of the theory, the result of the run (None without a run), and its error (NaN if unknown)."""

    name: str
    theory: float
    run: float | None
    error: float = math.nan


def compare_with_theory(directory: Path, history: Sequence[Stage], cell: float) -> list[ComparedResult]:
    """Return results of theory.csv and of measures.csv in a directory, none without the former; `cell` is the spacing
    of the grid along x [m].

    Results are mu_max, mu_dyn and the mean contact area of the slide (`slide.measure_slide`), for the run the corrected
    area; without a slide the contact area of the last instant. Raises InputError for damaged tables.
    """
    predicted, found = (_results(directory / name, history, cell) for name in (theory_settings.TABLE, RUN))
    nothing = None, math.nan
    return [ComparedResult(name, value, *found.get(name, nothing)) for name, (value, _) in predicted.items()]


def _results(path: Path, history: Sequence[Stage], cell: float) -> dict[str, tuple[float, float]]:
    """Return results and their errors by name."""
    columns = Results(path.parent).read(path.name)
    if not columns.get("time"):
        return {}
    columns.setdefault(slide.CORRECTED, columns["contact_area"])
    found = slide.measure_slide(history, columns)
    if found is None:
        area = columns[slide.CORRECTED][-1]
        return {"contact area": (area, columns.get(slide.ERRORS[1], [math.nan])[-1] * area)}
    within = slide.absolute_errors(history, columns, cell)
    values = {"mu_max": found.mu_max, "mu_dyn": found.mu_dyn, "contact area": found.contact_area_corrected}
    defined = {name: value for name, value in values.items() if value == value}
    return {name: (value, within.get(name.replace(" ", "_"), math.nan)) for name, value in defined.items()}


def describe_theory(directory: Path, history: Sequence[Stage], cell: float) -> Iterator[str]:
    """Yield a sentence on the predictions, if there is a theory.csv. Raises InputError for damaged tables."""
    results = compare_with_theory(directory, history, cell)
    if results:
        pairs = (f"{one.name} {one.theory:.3g}{_run(one)}" for one in results)
        yield f"Persson's theory predicts {', '.join(pairs)}"


def _run(one: ComparedResult) -> str:
    return "" if one.run is None else f" (run: {with_error(one.run, one.error)})"
