"""theory.yaml: the settings of the predictions in theory.csv."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from .. import __version__
from ..errors import InputError
from ..job.text import yamltext
from ..storage import files

TABLE, FILE = "theory.csv", "theory.yaml"
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
    """The factor that corrects friction in partial contact, and the kind of waves: continuum or lattice."""

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
    """Return True if this program wrote a file of settings; raises OSError."""
    return path.read_bytes().startswith(HEAD.encode())


def is_own_table(path: Path) -> bool:
    """Return True if a table has settings in its directory, and is therefore one of theory; raises OSError."""
    return path.with_name(FILE).is_file() and path.read_bytes().startswith(b"time,distance,pressure,")


def read_settings(directory: Path) -> TheorySettings | None:
    """Return the settings of the table in a directory, None if there are none; raises InputError for a damaged file."""
    path = directory / FILE
    try:
        text = path.read_bytes()
        data = yamltext.parse(text, FILE).data
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
    """Return the settings that the tables in these directories have in common, if any. Raises as `read`."""
    found = {read_settings(directory) for directory in directories if (directory / TABLE).is_file()}
    return found.pop() if len(found) == 1 else None


def describe_settings(directory: Path) -> str:
    """Return a sentence about the theory in a directory, or in the cases of a sweep there; '' if there is none."""
    try:
        settings = shared([directory, *directory.glob("cases/*")])
    except InputError as error:
        return f"theory of unknown settings: {error}"
    return f"Persson's theory: {settings.sentence}" if settings else ""
