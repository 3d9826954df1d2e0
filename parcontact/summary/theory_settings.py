"""theory.yaml: with which settings the predictions in theory.csv beside it were made."""

import re
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from .. import __version__
from ..errors import InputError
from ..job.text import yamltext
from ..storage import files

TABLE, FILE = "theory.csv", "theory.yaml"
TEXT = """\
# With which settings `parcontact theory` made theory.csv, whose CRC-32 is {checksum:08x}.
gamma: {gamma!r}  # corrects friction in partial contact
waves: {waves}  # continuum: those of the job's spectrum; lattice: those of the surface in its box
program: parcontact {version}
"""
CHECKSUM = re.compile(rb"# With which settings `parcontact theory` made theory.csv, whose CRC-32 is ([0-9a-f]{8})\.")


class TheorySettings(NamedTuple):
    """The factor that corrects friction in partial contact, and which waves: continuum or lattice."""

    gamma: float
    waves: str

    def __str__(self) -> str:
        return f"γ = {self.gamma:g}, {self.waves}"


def write(directory: Path, settings: TheorySettings) -> None:
    """Leave the settings beside the table; raises OSError."""
    known = {**settings._asdict(), "version": __version__, "checksum": _checksum(directory)}
    with files.replaced(directory / FILE, is_ours) as file:
        file.write(TEXT.format(**known).encode())


def is_ours(path: Path) -> bool:
    """Whether this program wrote a file of settings; raises OSError."""
    return path.read_bytes().startswith(TEXT.partition("{")[0].encode())


def is_own_table(path: Path) -> bool:
    """Whether a table is the one that the settings beside it are of; raises OSError."""
    return _told_checksum(path.with_name(FILE).read_bytes()) == _checksum(path.parent)


def _told_checksum(text: bytes) -> int | None:
    found = CHECKSUM.match(text)
    return int(found[1], 16) if found else None


def _checksum(directory: Path) -> int:
    """Of the table in a directory; 0 if there is none."""
    table = directory / TABLE
    return zlib.crc32(table.read_bytes()) if table.is_file() else 0


def read(directory: Path) -> TheorySettings | None:
    """The settings of the table in a directory; None if there are none, or those of another table.

    Raises InputError for a damaged file.
    """
    path = directory / FILE
    try:
        text = path.read_bytes()
        if _told_checksum(text) not in (None, _checksum(directory)):
            return None
        data = yamltext.parse(text, FILE).data
        return TheorySettings(float(data["gamma"]), str(data["waves"]))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from error
    except (InputError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path} is damaged: it does not say gamma and waves") from error


def shared(directories: Iterable[Path]) -> TheorySettings | None:
    """The settings that the tables in these directories have in common; None if there are none. Raises as `read`."""
    found = {read(directory) for directory in directories if (directory / TABLE).is_file()}
    return found.pop() if len(found) == 1 else None


def describe(directory: Path) -> str:
    """The settings of the theory in a directory, or in the cases of a sweep there, or why they cannot be read; '' if
    there are none."""
    try:
        settings = shared([directory, *directory.glob("cases/*")])
    except InputError as error:
        return f"theory of unknown settings: {error}"
    return f"theory: {settings}" if settings else ""
