"""Persson's theory next to a run.

* Comparison of a run with Persson's theory: highest and dynamic friction and contact area.
* theory.yaml: the settings of the predictions in theory.csv.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from .. import __version__
from ..errors import InputError
from ..files import files, outputs
from ..job import Stage, yaml_text
from ..printed import with_error
from . import slide
from .results import Results

(FILE,) = outputs.THEORY.others
HEAD = "# Settings of `parcontact theory` for theory.csv"
TEXT = (
    f"{HEAD}.\n"
    """\
gamma: {gamma!r}  # corrects friction in partial contact
waves: {waves}  # continuum: the job's spectrum; lattice: the waves of the surface in its box
program: parcontact {version}
"""
)


OF_WAVES = {"continuum": "the spectrum of the surface", "lattice": "the waves of the surface in its box"}


class TheorySettings(NamedTuple):
    """Settings of a prediction: factor that corrects friction in partial contact, and kind of waves, continuum or
    lattice."""

    gamma: float
    waves: str

    @property
    def sentence(self) -> str:
        """Return the settings as text."""
        return f"gamma {self.gamma:g}, for {OF_WAVES.get(self.waves, self.waves)}"


def write_settings(directory: Path, settings: TheorySettings) -> None:
    """Write the settings; raises OSError."""
    with files.replaced(directory / FILE, is_our_settings) as file:
        file.write(TEXT.format(**settings._asdict(), version=__version__).encode())


def is_our_settings(path: Path) -> bool:
    """Return True if a file of settings was written by this program; raises OSError."""
    return path.read_bytes().startswith(HEAD.encode())


def is_own_table(path: Path) -> bool:
    """Return True if a table has settings in its directory, and is therefore a table of theory; raises OSError."""
    return path.with_name(FILE).is_file() and path.read_bytes().startswith(b"time,distance,pressure,")


def read_settings(directory: Path) -> TheorySettings | None:
    """Return the settings of the theory table in a directory, None without any; raises InputError for a damaged
    file."""
    path = directory / FILE
    try:
        text = path.read_bytes()
        data = yaml_text.parse(text, FILE).data
        if not text.endswith(b"\n") or "program" not in data:
            raise KeyError(FILE)
        return TheorySettings(float(data["gamma"]), str(data["waves"]))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from error
    except (InputError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path} is damaged: it does not say gamma and waves") from error


def shared(directories: Iterable[Path]) -> TheorySettings | None:
    """Return the settings that the theory tables in these directories share, or None. Raises as `read_settings`."""
    found = {read_settings(directory) for directory in directories if (directory / outputs.THEORY.table).is_file()}
    return found.pop() if len(found) == 1 else None


def describe_settings(directory: Path) -> str:
    """Return a sentence on the settings of Persson's theory in a directory, or in the cases of a sweep there; '' if
    there is no theory."""
    try:
        settings = shared([directory, *directory.glob("cases/*")])
    except InputError as error:
        return f"theory of unknown settings: {error}"
    return f"Persson's theory: {settings.sentence}" if settings else ""


class ComparedResult(NamedTuple):
    """A result [-] of the theory, the run's result (None without a run), and the error of the run's result (NaN if
    unknown)."""

    name: str
    theory: float
    run: float | None
    error: float = math.nan


def compare_with_theory(directory: Path, history: Sequence[Stage], cell: float) -> list[ComparedResult]:
    """Return results of theory.csv and of measures.csv in a directory, none without theory.csv. `cell` is the spacing
    of the grid along x [m].

    Results are mu_max, mu_dyn and the mean contact area of the slide (`slide.measure_slide`), with the corrected area
    for the run; without a slide, the contact area of the last instant. Raises InputError for damaged tables.
    """
    predicted, found = (_results(directory / name, history, cell) for name in (outputs.THEORY.table, outputs.RUN.table))
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
