"""Tables of numbers in csv files: read, also while they grow, and continued line by line."""

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

from ..errors import InputError
from . import files

MEND = "mend the line, or move the file away to go on without its rows"


class GrowingTable:
    """A csv table that grows line by line while others read it; a last line without a newline is not finished."""

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        """Continue the file, or begin it with the names of the columns; raises OSError."""
        self.path = path
        self._file = files.open_to_append(path)
        if self._file.tell() == 0:
            self.append(names)

    def append(self, cells: Sequence[str]) -> None:
        """Add a line; on an error the file is as it was before."""
        rest, size = memoryview(f"{','.join(cells)}\n".encode()), self._file.tell()
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError:
            with suppress(OSError):
                self._file.truncate(size)
            raise

    def sync(self) -> None:
        """Wait until all lines are on the disk."""
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file, whose lines have all been written; raises nothing."""
        with suppress(OSError):
            self._file.close()


def whole_lines(path: Path) -> Iterator[list[str]]:
    """Yield the cells of each whole line, the names of the columns first, all as many; raises InputError."""
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
    """Columns by name; asking for one that the file has not raises InputError."""

    def __init__(self, path: Path, found: Iterable[tuple[str, list[float]]]) -> None:
        super().__init__(found)
        self.path = path

    def __missing__(self, name: str) -> NoReturn:
        raise InputError(f"{self.path}, line 1, names no column {name}; mend it, or move the file away")


def read_columns(path: Path) -> Columns:
    """Read the columns of a table by name, also of one that still grows; NaN for what was not asked for.

    Raises InputError, which names the line, for what is no table of numbers.
    """
    rows = whole_lines(path)
    names = next(rows, [])
    if not names:
        raise InputError(f"{path} is empty: it does not even name its columns")
    series: list[list[float]] = [[] for _ in names]
    for number, cells in enumerate(rows, 2):
        for name, text, values in zip(names, cells, series, strict=True):
            try:
                values.append(float(text or "nan"))
            except ValueError:
                raise InputError(f"{path}, line {number}: {name} is {text[:20]!r}, not a number; {MEND}") from None
    return Columns(path, zip(names, series, strict=True))
