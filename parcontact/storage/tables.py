"""Tables of numbers in csv files: reading, also while they grow, and appending."""

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

from ..errors import InputError
from . import files

MEND = "correct the line, or move the file away to continue without its rows"


class GrowingTable:
    """A csv table that grows while others read it; a last line without newline is incomplete."""

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        """Open the file to append, or create it with the names of the columns; raises OSError."""
        self.path = path
        self._file = files.open_to_append(path)
        if self._file.tell() == 0:
            self.append(names)

    def append(self, cells: Sequence[str]) -> None:
        """Append a line; after an error the file is unchanged."""
        rest, size = memoryview(f"{','.join(cells)}\n".encode()), self._file.tell()
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError:
            with suppress(OSError):
                self._file.truncate(size)
            raise

    def sync(self) -> None:
        """Flush all lines to disk."""
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file; raises nothing."""
        with suppress(OSError):
            self._file.close()


def whole_lines(path: Path) -> Iterator[list[str]]:
    """Yield the cells of each whole line, first the names of the columns; raises InputError for unequal lengths."""
    count = 0
    with path.open("rb") as file:
        for number, line in enumerate(file, 1):
            if not line.endswith(b"\n"):
                return
            cells = line.decode(errors="replace").rstrip("\r\n").split(",")
            if len(cells) != (count or len(cells)):
                raise InputError(f"{path}, line {number}, has {len(cells)} values instead of {count}; {MEND}")
            count = len(cells)
            yield cells


class Columns(dict[str, list[float]]):
    """Columns by name; a missing column raises InputError."""

    def __init__(self, path: Path, found: Iterable[tuple[str, list[float]]]) -> None:
        super().__init__(found)
        self.path = path

    def __missing__(self, name: str) -> NoReturn:
        raise InputError(f"{self.path}, line 1, has no column {name}; correct it, or move the file away")


def read_columns(path: Path) -> Columns:
    """Read the columns of a table by name, also of a growing one; empty cells are NaN.

    Raises InputError with the line for anything but numbers.
    """
    rows = whole_lines(path)
    names = next(rows, [])
    if not names:
        raise InputError(f"{path} is empty; a line with the names of columns was expected")
    series: list[list[float]] = [[] for _ in names]
    for number, cells in enumerate(rows, 2):
        for name, text, values in zip(names, cells, series, strict=True):
            try:
                values.append(float(text or "nan"))
            except ValueError:
                raise InputError(f"{path}, line {number}: {name} is {text[:20]!r}, not a number; {MEND}") from None
    return Columns(path, zip(names, series, strict=True))
