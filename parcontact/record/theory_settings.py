"""theory.yaml: with which settings the predictions in theory.csv beside it were made."""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from .. import __version__
from ..errors import InputError
from ..job import yamltext
from . import files

TABLE, FILE = "theory.csv", "theory.yaml"
TEXT = """\
# With which settings `parcontact theory` made theory.csv.
gamma: {gamma!r}  # corrects friction in partial contact
waves: {waves}  # continuum: those of the job's spectrum; lattice: those of the surface in its box
program: parcontact {version}
"""


class TheorySettings(NamedTuple):
    """The factor that corrects friction in partial contact, and which waves: continuum or lattice."""

    gamma: float
    waves: str

    def __str__(self) -> str:
        return f"γ = {self.gamma:g}, {self.waves}"


def write(directory: Path, settings: TheorySettings) -> None:
    """Leave the settings beside the table; raises OSError."""
    files.write(directory / FILE, TEXT.format(**settings._asdict(), version=__version__))


def read(directory: Path) -> TheorySettings | None:
    """The settings of the table in a directory; None if they are not known."""
    with suppress(OSError, InputError, KeyError, TypeError, ValueError):
        data = yamltext.parse((directory / FILE).read_bytes(), FILE).data
        return TheorySettings(float(data["gamma"]), str(data["waves"]))
    return None


def shared(directories: Iterable[Path]) -> TheorySettings | None:
    """The settings that the tables in these directories have in common; None if there are none."""
    found = {read(directory) for directory in directories if (directory / TABLE).is_file()}
    return found.pop() if len(found) == 1 else None


def describe(directory: Path) -> str:
    """The settings of the theory in a directory, or in the cases of a sweep there, if they are known; else ''."""
    settings = shared([directory, *directory.glob("cases/*")])
    return f"theory: {settings}" if settings else ""
