"""measures.csv: one row per step and one for the initial state, written by root."""

import math
import os
import zlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NoReturn

from ..errors import InputError
from . import files
from .checkpoint import Table
from .growing import GrowingTable
from .row import Row

SOLVED = ("iterations", "residual", "penetration", "operator_calls")
COLUMNS = (
    *("step", "time", "distance", "pressure", "force_x", "force_y", "friction", "contact_area", "approach", "mean_gap"),
    *("max_pressure", *SOLVED, "work", "stored", "dissipated", "seconds"),
)
# columns that came later stand at the end: nothing before them shifts
LAST = ("friction_x", "contact_area_corrected", "error_friction", "error_area")
UNITS = {
    **dict.fromkeys(("time", "seconds"), "s"),
    **dict.fromkeys(("distance", "approach", "mean_gap"), "m"),
    **dict.fromkeys(("pressure", "max_pressure"), "Pa"),
    **dict.fromkeys(("force_x", "force_y"), "N"),
    **dict.fromkeys(("work", "stored", "dissipated"), "J"),
}  # of those that have one
MEND = "mend the line, or move the file away to go on without its rows"
MAX_LINE = 1 << 20  # bytes: a longer one is none of ours


def columns(branches: int, added: Sequence[str] = ()) -> list[str]:
    """Names of the columns when the dissipation of so many branches is asked for, and effects have added some.

    Raises InputError for a name that is there twice.
    """
    names = [*COLUMNS, *(f"dissipated_{k}" for k in range(branches)), *LAST, *added]
    if twice := {name for name in added if names.count(name) > 1}:
        raise InputError(f"measures.csv has a column {', '.join(sorted(twice))}: an effect must name its own otherwise")
    return names


def numbers(row: Row, branches: int) -> list[float]:
    """The numbers of a row, in the order of `columns`; NaN for what was not asked for."""
    m, c = row.measures, row.certificate
    forces = (m.pressure, m.force_x, m.force_y, m.friction)
    lengths = (m.contact_area, m.approach, m.mean_gap, m.max_pressure)
    solve = (row.iterations, c.worst, c.penetration, row.operator_calls)
    energies = (row.work, row.stored, row.dissipated)
    shown = [row.step, row.time, row.distance, *forces, *lengths, *solve, *energies, round(row.seconds, 6)]
    last = (m.friction_x, m.contact_area_corrected, *_errors(row))
    return [*shown, *row.branch_dissipation[:branches], *last, *row.added]


def _errors(row: Row) -> tuple[float, float]:
    """Of friction and area, relative; NaN where there is none."""
    if row.errors is None:
        return math.nan, math.nan
    friction, area = row.errors.friction, row.errors.area
    return friction.total if friction else math.nan, area.total


def _text(value: float) -> str:
    """Shortest text that reads back to the same number; nothing for what was not asked for."""
    return "" if value != value else repr(value)


class MeasuresFile:
    """The growing file; a line that does not end in a newline is none."""

    def __init__(
        self,
        path: Path,
        branches: int,
        table: Table = Table(),  # noqa: B008  # frozen
        added: Sequence[str] = (),
    ) -> None:
        """Continue the file, which holds this `table`, or begin it."""
        self.path, self.table, self._branches, self._names = path, table, branches, columns(branches, added)
        self._file = GrowingTable(path, self._names)
        self.sync, self.close = self._file.sync, self._file.close

    def write(self, row: Row) -> None:
        """Append a row; on an error the file is as it was before, but `table` has the row, which the next run adds."""
        cells = [_text(value) for value in numbers(row, self._branches)]
        checksum = _checksum(self.table.checksum, self._names, cells)
        self.table = Table(self.table.rows + 1, checksum, ",".join(cells))
        self._file.append(cells)


def cut_back(path: Path, step: int, branches: int, then: Table, added: Sequence[str] = ()) -> tuple[Table, list[str]]:
    """Remove the rows after `step`, and one that is incomplete; the columns become those of the present job.

    `then` is what the file held when the checkpoint was written. Returns what it holds now, and what is lost. Raises
    InputError, and changes nothing, for a file that others have made unreadable.
    """
    if not path.exists():
        return Table(), [f"{path} is missing: the rows up to step {step} are lost"]
    found, wanted = _rows(path), columns(branches, added)
    names = next(found, [])
    if "step" not in names:
        raise InputError(f"{path}, line 1, does not name the columns, step among them; move it away or mend it")
    last, lines, checksum, renewed = -1, 0, 0, 0
    with files.replaced(path) as new:
        new.write(f"{','.join(wanted)}\n".encode())
        line = ""
        for number, cells in enumerate(found, 2):
            if (at := _step(path, number, names, cells, last)) > step:
                break
            last, lines, checksum = at, lines + 1, _checksum(checksum, names, cells)
            row = dict(zip(names, cells, strict=True))
            kept_cells = [row.get(name, "") for name in wanted]
            renewed, line = _checksum(renewed, wanted, kept_cells), ",".join(kept_cells)
            new.write(f"{line}\n".encode())
        kept = Table(lines, renewed, line)
        problems = _compared(path, step, last, Table(lines, checksum), then)
        if last < step and lines + 1 == then.rows and names == wanted:  # a full disk had no room for it
            new.write(f"{then.last}\n".encode())
            kept, problems = then, []
        new.flush()
        os.fsync(new.fileno())
    return kept, problems


def _compared(path: Path, step: int, last: int, found: Table, then: Table) -> list[str]:
    """What a table up to a step, ending with step `last`, lacks of what it held then."""
    if last < step:
        return [f"{path} ends with step {last}: the rows up to step {step} are lost"]
    if then.rows > found.rows:
        return [f"{path} lacks {then.rows - found.rows} of the {then.rows} rows up to step {step}"]
    if then.rows and (found.rows, found.checksum) != (then.rows, then.checksum):
        return [f"{path} was changed by hand: its {found.rows} rows up to step {step} are not those that were written"]
    return []


def _step(path: Path, number: int, names: Sequence[str], cells: Sequence[str], last: int) -> int:
    """The step of a line, which must be later than the last one."""
    text = cells[names.index("step")]
    if not text.isascii() or not text.isdecimal() or len(text) > 18:
        raise InputError(f"{path}, line {number}: the step {text[:20]!r} is not a whole number; {MEND}")
    if int(text) <= last:
        raise InputError(f"{path}, line {number}: step {text} comes after step {last}; {MEND}")
    return int(text)


def _checksum(before: int, names: Sequence[str], cells: Sequence[str]) -> int:
    """CRC-32 of the rows up to this one, without their wall time, which is another at every run."""
    text = ",".join(cell for name, cell in zip(names, cells, strict=True) if name != "seconds")
    return zlib.crc32(text.encode(), before)


def _rows(path: Path) -> Iterator[list[str]]:
    """The cells of each whole line, the names of the columns first, all as many; raises InputError."""
    count = 0
    with path.open("rb") as file:
        for number in range(1, 1 << 62):
            line = file.readline(MAX_LINE)
            if not line.endswith(b"\n"):
                if len(line) == MAX_LINE:
                    raise InputError(f"{path}, line {number}, has more than {MAX_LINE} bytes; {MEND}")
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
    """Columns of a table by name, also of one that still grows; NaN for what was not asked for.

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
