"""Tables of numbers and arrays that users give, as instruments and laboratories write them.

Numbers are separated by semicolons, tabs, commas or blanks, with decimal points, or with decimal commas between
semicolons, tabs or blanks. A mark at the end of every row, or at its beginning, is no cell. Words such as No Data,
--- and #N/A, and empty cells, are missing numbers (NaN). Lines that begin with #, % or // are comments.

The header is the last line above the numbers, or a comment, that has enough names of columns. Units are in brackets,
`Frequency (Hz)`, `f[Hz]`, behind a slash, `E'/MPa`, or in a row of their own below the names. A long name and a symbol
may stand together: `Storage Modulus E' (MPa)`. Other lines, such as the name of the laboratory, may stand above it.

Files .npy that users give are read, too; heights out of range and damaged files raise InputError.
"""

from __future__ import annotations

import codecs
import csv
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from .columns import NAMES, NUMBERS, MeasuredColumn, plain_unit, read_cell
from .errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LARGEST_TEXT = 50_000_000  # largest file of a table with names [bytes]
TO_DECODE = 1_000_000  # tuning: bytes from which the encoding of a file is found
LONGEST_HEAD = 200  # tuning: most lines before the first row of numbers
SAMPLED = 50  # tuning: lines of a map from which its dialect is found
MARKS = ";\t,"
MISSING = {"", "-", "--", "---", "nan", "n/a", "#n/a", "na", "null", "none", "nodata", "no_data", "no data"}
MISSING |= {"bad", "missing", "masked", "invalid", "#value!", "#num!", "#div/0!"}
TWO_WORDS = re.compile(r"\bno data\b", re.IGNORECASE)
COMMENT = re.compile(r"(?:^|(?<=\s))(?:#(?!N/A|VALUE!|NUM!|DIV/0!)|%|//).*", re.IGNORECASE | re.DOTALL)
WITH_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")
WITH_POINT = re.compile(r"[-+]?(\d+\.\d*|\.\d+)([eE][-+]?\d+)?")
AMBIGUOUS = "{path}: commas may be between numbers or within them: {row}; use semicolons"
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")


def open_text(path: Path) -> TextIO:
    """Open a text file: UTF-8, UTF-16 with a byte-order mark, or Latin-1."""
    with path.open("rb") as file:
        start = file.read(TO_DECODE)
    encoding = "utf-8-sig"
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encoding = "utf-16"
    else:
        try:
            codecs.getincrementaldecoder("utf-8")().decode(start)
        except UnicodeDecodeError:
            encoding = "latin-1"
    return path.open(encoding=encoding, errors="replace")


@dataclass(frozen=True)
class Dialect:
    """Form of the rows of a file: the `mark` between cells (None for blanks), decimal commas, and whether every row
    begins or ends with a mark."""

    mark: str | None
    commas: bool = False
    begins: bool = False
    ends: bool = False

    def cells(self, line: str) -> list[str]:
        """Return the cells of a row. A cell may be quoted; a quote inside a cell, as in G", belongs to the cell."""
        line = TWO_WORDS.sub("nan", COMMENT.sub("", line))
        if self.mark is None:
            return line.split()
        if '"' in line:
            found = next(csv.reader([line], delimiter=self.mark, skipinitialspace=True), [])
        else:
            found = line.split(self.mark)
        found = [cell.strip() for cell in found]
        return found[self.begins and not found[0] : len(found) - (self.ends and not found[-1])]

    def numbers(self, line: str) -> list[float]:
        """Return the numbers of a row, none for a comment. Raises ValueError for any other text."""
        if not self.begins and not self.ends and "_" not in line and not (self.commas and "." in line):
            try:  # most rows hold numbers only, and maps have many rows
                return list(map(float, (line.replace(",", ".") if self.commas else line).split(self.mark)))
            except ValueError:
                pass
        return [self.number(cell) for cell in self.cells(line)] if COMMENT.sub("", line) else []

    def number(self, cell: str) -> float:
        """Return the number in a cell, NaN if it is missing. Raises ValueError for any other text."""
        if cell.lower() in MISSING:
            return math.nan
        if "_" in cell or (self.commas and "." in cell):
            raise ValueError(f"not a number: {cell!r}")
        return float(cell.replace(",", ".") if self.commas else cell)


def find_dialect(path: Path, rows: Sequence[str]) -> Dialect:
    """Return the form of the rows of a file (`Dialect`), found from some of its rows of numbers. Raises InputError if
    commas are ambiguous."""
    mark = next((mark for mark in MARKS if 2 * sum(mark in row for row in rows) >= len(rows)), None)
    if mark == "," and all(_has_decimal_commas(row) for row in rows):
        mark = None
    whole = [Dialect(mark).cells(row) for row in rows]
    if mark == "," and _have_mixed_commas(rows):
        raise InputError(AMBIGUOUS.format(path=path, row=rows[0].strip()[:40]))
    with_comma = [cell for cells in whole for cell in cells if mark != "," and WITH_COMMA.fullmatch(cell)]
    if with_comma and any(WITH_POINT.fullmatch(cell) for cells in whole for cell in cells):
        raise InputError(f"{path}: some numbers have decimal commas, such as {with_comma[0]}, others points; use one")
    if with_comma and all(THOUSANDS.fullmatch(cell) for cell in with_comma):
        raise InputError(
            f"{path}: {with_comma[0]} may be {with_comma[0].replace(',', '')} or {with_comma[0].replace(',', '.')}; "
            "write numbers with decimal points"
        )
    return Dialect(
        mark,
        bool(with_comma),
        begins=_are_empty(whole, 0) and not _are_empty(whole, 1),
        ends=_are_empty(whole, -1) and not _are_empty(whole, -2),
    )


def _have_mixed_commas(rows: Sequence[str]) -> bool:
    """Return True if blanks follow some commas, and numbers the others: 1,5, 2,5."""
    return any(re.search(r",[ \t]+[-+.\d]", row) and re.search(r"\d,\d", row) for row in rows)


def _are_halves(rows: Sequence[Sequence[str]]) -> bool:
    """Return True if cells seem to be numbers before and behind decimal commas in turn: 1,05,-2,5."""
    pairs = [pair for row in rows for pair in zip(row[::2], row[1::2], strict=False)]
    if any(len(row) % 2 for row in rows) or not all(pair[0] and WITH_COMMA.fullmatch(",".join(pair)) for pair in pairs):
        return False
    return any(not whole.isdigit() or not part.isdigit() or re.match(r"0\d", part) for whole, part in pairs)


def _are_empty(rows: Sequence[Sequence[str]], at: int) -> bool:
    return all(len(cells) > 2 and not cells[at] for cells in rows)


def _has_decimal_commas(row: str) -> bool:
    parts = TWO_WORDS.sub("nan", row).split()
    return len(parts) > 1 and all(
        WITH_COMMA.fullmatch(part) or part.lower() in MISSING or re.fullmatch(r"[-+]?\d+([eE][-+]?\d+)?", part)
        for part in parts
    )


def is_row(line: str) -> bool:
    """Return True if a line holds numbers and words for missing numbers only."""
    words = [word for word in re.split(r"[;,\s]+", TWO_WORDS.sub("nan", COMMENT.sub("", line))) if word]
    return bool(words) and all(word.lower() in MISSING or _is_number(word) for word in words)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def number_rows(path: Path, lines: Iterable[str]) -> tuple[list[str], Iterator[tuple[int, list[float]]]]:
    """Return the lines above the first row of numbers, and each row with the number of its line.

    Blank lines and comments between rows are passed over. If the first LONGEST_HEAD lines have no row, no rows are
    returned. The iterator of rows raises InputError for a text that is not a number.
    """
    numbered = enumerate(lines, start=1)
    start = list(islice(numbered, LONGEST_HEAD))
    first = next((k for k, (_, line) in enumerate(start) if is_row(line)), len(start))
    head, start = [line for _, line in start[:first]], start[first:]
    if not start:
        return head, iter(())
    sample = [line for _, line in start[:SAMPLED] if is_row(line)]
    dialect = find_dialect(path, sample)
    if dialect.mark == "," and _are_halves([dialect.cells(line) for line in sample]):
        raise InputError(AMBIGUOUS.format(path=path, row=sample[0].strip()[:40]))
    return head, _rows(path, dialect, chain(start, numbered))


def _rows(path: Path, dialect: Dialect, lines: Iterable[tuple[int, str]]) -> Iterator[tuple[int, list[float]]]:
    for number, line in lines:
        line = line.strip(" \r\n" if dialect.mark == "\t" else " \t\r\n")
        try:
            if row := dialect.numbers(line):
                yield number, row
        except ValueError as error:
            raise InputError(
                f"{path}:{number}: a number was expected, got {str(error).partition(': ')[2][:60]}"
            ) from None


@dataclass(frozen=True)
class Table:
    """Columns of numbers by name, their units, and the line of each row."""

    path: Path
    columns: dict[str, list[float]]
    units: dict[str, str]
    lines: list[int]

    def unit(self, name: str, known: dict[str, float]) -> float:
        """Return `unit_size` of a column of this table."""
        return unit_size(self.path, name, self.units[name], known)


def unit_size(path: Path, name: str, unit: str, known: dict[str, float]) -> float:
    """Return the size of a column's unit in SI. Raises InputError if the unit is not one of `known`."""
    if unit not in known:
        raise InputError(f"{path}: the unit of {name} must be one of {', '.join(known)}, got {unit or 'none'!r}")
    return known[unit]


def read_named_columns(
    path: Path,
    expected: str,
    example: str,
    names: Set[str],
    enough: Callable[[set[str]], bool],
    plain: Set[str] = NUMBERS,
) -> Table:
    """Return the columns of a table whose columns have names.

    Columns with a name in `names` must contain numbers. Other columns are ignored. `enough` takes the names in a line,
    and returns True if a line with these names is a header. Columns with a name in `plain` need no unit. Raises
    InputError with file and line; its message says that a file of the kind `expected`, with a header such as `example`,
    was expected.
    """
    lines = _read_lines(path, expected)
    rows = [(number, text) for number, text in lines if COMMENT.sub("", text).strip(" \t,;")]
    if not rows:
        raise InputError(f"{path} is empty; {expected} was expected")
    dialect = find_dialect(path, [text for _, text in rows if is_row(text)] or [rows[-1][1]])
    columns, last = _header(path, lines, dialect, example, names, enough, plain)
    rows = [(number, text) for number, text in rows if number > last]
    columns = [each if each.name in names else MeasuredColumn("", None) for each in columns]
    values = [_numbers(path, number, text, columns, dialect) for number, text in rows]
    given = [column.name for column in columns]
    for name in sorted(names):
        if given.count(name) > 1:
            raise InputError(f"{path}: two columns mean the same: {name} is given twice; remove one")
    found = {name: [row[k] for row in values] for k, name in enumerate(given) if name}
    units = {each.name: each.unit or "" for each in columns if each.name}
    return Table(path, found, units, [number for number, _ in rows])


def _read_lines(path: Path, expected: str) -> list[tuple[int, str]]:
    """Return the number and text of each line that is not blank."""
    try:
        if not path.is_file():
            raise InputError(f"{path} is not a file; {expected} was expected")
        if path.stat().st_size > LARGEST_TEXT:
            raise InputError(f"{path} has more than {LARGEST_TEXT / 1e6:g} MB; {expected} was expected")
        with open_text(path) as file:
            lines = [(number, line.strip("\r\n")) for number, line in enumerate(file, start=1)]
    except (OSError, UnicodeError) as error:
        raise InputError(f"{path} cannot be read as text: {error}") from error
    if any("\0" in line for _, line in lines):
        raise InputError(f"{path} cannot be read as text: it holds bytes of 0; {expected} was expected")
    return [(number, line) for number, line in lines if line.strip(" \t,;")]


def _header(
    path: Path,
    lines: Sequence[tuple[int, str]],
    dialect: Dialect,
    example: str,
    names: Set[str],
    enough: Callable[[set[str]], bool],
    plain: Set[str],
) -> tuple[list[MeasuredColumn], int]:
    """Return the columns and the number of the last line of the header."""
    texts = {at: re.sub(r"^\s*(#|%|//)+", "", text) for at, (_, text) in enumerate(lines) if not is_row(text)}
    heads = _candidates(texts, dialect, enough)
    if not heads:
        raise InputError(f"{path}:{lines[0][0]}: names and units of the columns were expected, such as {example}")
    first_row = next((at for at in range(min(heads), len(lines)) if is_row(lines[at][1])), len(lines))
    at = max(at for at in heads if at < first_row)
    number, head = lines[at][0], heads[at]
    for other, columns in heads.items():
        if columns != head:
            raise InputError(f"{path}:{lines[other][0]}: its names of columns differ from those in line {number}")
    if any(each.unit is not None for each in head):
        without = [each.name for each in head if each.unit is None and each.name in names - plain]
        if without:
            raise InputError(f"{path}:{number}: {without[0]} must be a name with its unit in brackets, such as f[Hz]")
        return head, number
    if at + 1 not in texts and not {each.name for each in head} & NAMES <= plain:
        raise InputError(
            f"{path}:{number}: names and units of the columns were expected, such as {example}, or two rows with names "
            "and units"
        )
    units = _split_like(texts.get(at + 1, ""), dialect, len(head))
    return [MeasuredColumn(each.name, plain_unit(unit)) for each, unit in zip(head, units, strict=True)], lines[
        at + (at + 1 in texts)
    ][0]


def _candidates(
    texts: dict[int, str], dialect: Dialect, enough: Callable[[set[str]], bool]
) -> dict[int, list[MeasuredColumn]]:
    """Return the lines that name enough columns, or else the one that names most, for the message."""
    heads = {
        at: max(([read_cell(cell) for cell in cells] for cells in _splits(text, dialect)), key=_known)
        for at, text in texts.items()
    }
    if found := {at: head for at, head in heads.items() if enough({column.name for column in head})}:
        return found
    most = max(heads, key=lambda at: _known(heads[at]), default=-1)
    return {most: heads[most]} if most >= 0 and _known(heads[most]) else {}


def _known(columns: Sequence[MeasuredColumn]) -> int:
    return len({column.name for column in columns} & NAMES)


def _splits(text: str, dialect: Dialect) -> Iterator[list[str]]:
    """Yield the cells of a header for each way in which it may be separated, first the way of the rows."""
    glued = re.sub(r"\s+(?=[\[(])", "", text.strip())
    for mark in dict.fromkeys((dialect.mark, *MARKS)):
        if mark is not None and mark in text:
            yield Dialect(mark, begins=dialect.begins, ends=dialect.ends).cells(text)
    yield re.split(r"\s{2,}", text.strip())
    if re.fullmatch(r"(?:[^\[(]+[\[(][^\])]*[\])])+", text.strip()):
        yield [cell.strip() for cell in re.findall(r"[^\[(]+[\[(][^\])]*[\])]", text)]
    yield glued.split()


def _split_like(text: str, dialect: Dialect, count: int) -> list[str]:
    """Return the `count` cells of a row of units; missing ones are empty."""
    cells = next((cells for cells in _splits(text, dialect) if len(cells) == count), None)
    cells = cells if cells is not None else next(_splits(text, dialect))
    return (cells + [""] * count)[:count]


def header_of(line: str, count: int) -> list[MeasuredColumn]:
    """Return the `count` columns that are named in a line above rows of numbers; [] if the line names none."""
    text = re.sub(r"^\s*(#|%|//)+", "", line)
    named = ([read_cell(cell) for cell in cells] for cells in _splits(text, Dialect(None)) if len(cells) == count)
    return max(named, key=_known, default=[])


def _numbers(path: Path, number: int, text: str, columns: Sequence[MeasuredColumn], dialect: Dialect) -> list[float]:
    """Return the numbers of a row; NaN in columns without a name."""
    cells = dialect.cells(text)
    while len(cells) > len(columns) and not cells[-1]:
        cells = cells[:-1]
    if len(cells) != len(columns):
        raise InputError(f"{path}:{number}: {len(cells)} values where {len(columns)} columns are named")
    return [
        _finite(path, number, cell, column.name, dialect) if column.name else math.nan
        for cell, column in zip(cells, columns, strict=True)
    ]


def _finite(path: Path, number: int, cell: str, name: str, dialect: Dialect) -> float:
    try:
        value = dialect.number(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{path}:{number}: {name} must be a finite number, got {cell!r}")
    return value


HEADER_BYTES = 1_000_000  # largest header of an .npy file [bytes]
TEXTS = (".txt", ".xyz", ".csv", ".dat", ".asc")
OWN_FORMATS = (".npy", ".h5", ".mat", *TEXTS)  # formats of maps; SurfaceTopography reads others
LOWEST, HIGHEST = 1e-70, 1e70  # rounding: range of the largest height [m] whose fourth power does not overflow


def open_numbers(path: Path) -> NDArray[Any]:
    """Return the array of an .npy file, mapped into memory. Raises InputError, and errors of numpy."""
    import numpy as np  # slow import, not needed to read text

    with path.open("rb") as file:
        start = file.read(12)
    if not start:
        raise InputError(f"{path} cannot be read: it is empty")
    if start[6:7] in (b"\2", b"\3") and int.from_bytes(start[8:12], "little") > HEADER_BYTES:  # numpy would read it all
        raise InputError(f"{path} cannot be read: its header has more than {HEADER_BYTES / 1e6:g} MB")
    try:
        values = np.lib.format.open_memmap(path, mode="r")
    except ValueError as error:
        if "mmap length" not in str(error):
            raise
        raise InputError(f"{path} cannot be read: it ends before the last of its values") from error
    refuse_no_numbers(path, values.dtype)
    if not values.size:
        raise InputError(f"{path} holds an array of shape {values.shape}, without values")
    return values


def refuse_extreme(what: Path | str, largest: float) -> None:
    """Raise InputError for a map whose largest height or gap [m] would overflow or underflow in calculations."""
    if largest and not LOWEST <= largest <= HIGHEST:
        raise InputError(f"{what}: its largest value is {largest:.3g} m; {LOWEST:g} to {HIGHEST:g} m were expected")


def refuse_no_numbers(path: Path, kind: np.dtype[Any]) -> None:
    """Raise InputError unless the values of a file are real numbers."""
    if kind.kind not in "iuf":
        raise InputError(f"{path} holds values of type {kind}; real numbers were expected")
