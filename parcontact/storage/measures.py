"""measures.csv: one row per step and one for the initial state, written by root; and csv tables of numbers, read."""

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NoReturn

from ..errors import InputError
from . import files
from .checkpoint import Table
from .files import GrowingTable
from .row import Row, columns, numbers

MEND = "mend the line, or move the file away to go on without its rows"


def texts(values: Iterable[float]) -> list[str]:
    """Return the cells of a line: the shortest that read back to the same numbers, '' for what was not asked for."""
    return ["" if value != value else repr(value) for value in values]


class MeasuresFile(GrowingTable):
    """The growing file of a run; `table` is what it holds."""

    def __init__(self, path: Path, table: Table, branches: int = 0, added: Sequence[str] = ()) -> None:
        """Continue the file, which holds this `table`, or begin it."""
        super().__init__(path, columns(branches, added))
        self.table, self._branches = table, branches

    def write(self, row: Row) -> None:
        """Append a row; on an error the file is as it was before, but `table` has the row, which the next run adds."""
        cells = texts(numbers(row, self._branches))
        self.table = Table(self.table.rows + 1, ",".join(cells))
        self.append(cells)


def cut_back(
    path: Path, step: int, then: Table, branches: int = 0, added: Sequence[str] = ()
) -> tuple[Table, list[str]]:
    """Remove the rows after `step`, and one that is incomplete; the columns become those of the present job.

    `then` is what the file held when the checkpoint was written: a last row for which the disk had no room is added.
    Returns what the file holds now, and what is lost. Raises InputError, and changes nothing, for a damaged file.
    """
    if not path.exists():
        return Table(), [f"{path} is missing: the rows up to step {step} are lost"]
    found, wanted = _rows(path), columns(branches, added)
    names = next(found, [])
    if "step" not in names:
        raise InputError(f"{path}, line 1, does not name the columns, step among them; move it away or mend it")
    last, kept, problems = -1, Table(), list[str]()
    with files.replaced(path) as new:
        new.write(f"{','.join(wanted)}\n".encode())
        for number, cells in enumerate(found, 2):
            row = dict(zip(names, cells, strict=True))
            if not row["step"].isdecimal():
                raise InputError(f"{path}, line {number}: the step {row['step']!r} is not a whole number; {MEND}")
            if int(row["step"]) > step:
                break
            last, kept = int(row["step"]), Table(kept.rows + 1, ",".join(row.get(name, "") for name in wanted))
            new.write(f"{kept.last}\n".encode())
        if last < step and kept.rows + 1 == then.rows and names == wanted:
            kept = then
            new.write(f"{then.last}\n".encode())
        elif last < step:
            problems = [f"{path} ends with step {last}: the rows up to step {step} are lost"]
        new.flush()
        os.fsync(new.fileno())
    return kept, problems


def _rows(path: Path) -> Iterator[list[str]]:
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


def read(path: Path) -> Columns:
    """Read the columns of a table by name, also of one that still grows; NaN for what was not asked for.

    Raises InputError, which names the line, for what is no table of numbers.
    """
    rows = _rows(path)
    names = next(rows, [])
    if not names:
        raise InputError(f"{path} is empty: it does not even name its columns")
    series: list[list[float]] = [[] for _ in names]
    for number, cells in enumerate(rows, 2):
        for name, text, values in zip(names, cells, series, strict=True):
            try:
                values.append(float(text or "nan"))
            except ValueError:
                raise InputError(f"{path}, line {number}: {name} is {text[:20]!r}, not a number") from None
    return Columns(path, zip(names, series, strict=True))
