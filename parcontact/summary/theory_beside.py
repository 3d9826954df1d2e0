"""Persson's theory beside a run: highest and dynamic friction and the contact area of both, from their tables."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from ..job import Stage
from ..storage import tables
from . import slide, theory_settings

RUN = "measures.csv"
Columns = Mapping[str, Sequence[float]]


class Beside(NamedTuple):
    """A result [-] of the theory, and that of the run, None where there is no run."""

    name: str
    theory: float
    run: float | None


def compare(directory: Path, history: Sequence[Stage]) -> list[Beside]:
    """Return results of theory.csv and of measures.csv in a directory; nothing without the former.

    They are mu_max, mu_dyn and the mean contact area of the slide (`slide.measure`), the run's as corrected for its
    edges; without a slide the contact area of the last instant. Raises InputError for damaged tables.
    """
    predicted = _results(directory / theory_settings.TABLE, history)
    found = _results(directory / RUN, history)
    return [Beside(name, value, found.get(name)) for name, value in predicted.items()]


def _results(path: Path, history: Sequence[Stage]) -> dict[str, float]:
    columns = tables.read(path) if path.is_file() else {}
    if not columns.get("time"):
        return {}
    area = columns.get(slide.CORRECTED, columns["contact_area"])
    found = slide.measure(history, {**columns, "contact_area": area})
    if found is None:
        return {"contact area": area[-1]}
    return {"mu_max": found.mu_max, "mu_dyn": found.mu_dyn, "contact area": found.contact_area}


def describe(directory: Path, history: Sequence[Stage]) -> Iterator[str]:
    """Yield a sentence, if there is a theory. Raises InputError for damaged tables."""
    results = compare(directory, history)
    if results:
        pairs = (f"{one.name} {one.theory:.3g}{_run(one)}" for one in results)
        yield f"Persson's theory predicts {', '.join(pairs)}"


def _run(one: Beside) -> str:
    return "" if one.run is None else f" (run: {one.run:.3g})"
