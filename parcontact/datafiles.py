"""Reading of .npy files and tables of text that users give; damaged files raise InputError."""

from __future__ import annotations

import codecs
import csv
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

HEADER_BYTES = 1_000_000  # largest header of an .npy file [bytes]
TEXTS = (".txt", ".xyz", ".csv", ".dat", ".asc")
OWN_FORMATS = (".npy", *TEXTS)  # formats of maps; SurfaceTopography reads others
LOWEST, HIGHEST = 1e-70, 1e70  # rounding: range of the largest height [m] whose fourth power does not overflow
LARGEST_TEXT = 50_000_000  # largest text file that is read [bytes]


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


def foreign_numbers(path: Path) -> str:
    """Return why a text file is not a readable map, from its first bytes, and the remedy; '' if nothing is wrong."""
    with path.open("rb") as file:
        start = file.read(1000)
    if path.suffix.lower() not in (".txt", ".csv", ".dat", ".asc"):
        return ""
    lines = (line for line in start.decode("latin-1").splitlines() if line.strip() and not line.startswith("#"))
    first = next(lines, "")
    if has_decimal_commas(first):
        return "its numbers have decimal commas; write them with points, separated by blanks as .txt, or as .npy"
    mark = next((name for letter, name in ((";", "semicolons"), (",", "commas")) if first.count(letter) > 2), "")
    return f"its numbers are separated by {mark}; save them separated by blanks as .txt, or as .npy" if mark else ""


def has_decimal_commas(line: str) -> bool:
    """Return True if a line holds several numbers with decimal commas (0,1), separated by blanks or semicolons."""
    parts = [part for part in re.split(r"[;\s]+", line) if part]
    return (
        len(parts) > 1 and "," in line and all(re.fullmatch(r"[-+]?\d+(,\d+)?([eE][-+]?\d+)?", part) for part in parts)
    )


def read_lines(path: Path, expected: str) -> list[tuple[int, str]]:
    """Return the number and text of each line of a file that is neither blank nor a comment.

    Files are UTF-8, UTF-16 with a byte-order mark, or Latin-1. Raises InputError, also for a file without such lines.
    """
    try:
        if not path.is_file():
            raise InputError(f"{path} is not a file; {expected} was expected")
        if path.stat().st_size > LARGEST_TEXT:
            raise InputError(f"{path} has more than {LARGEST_TEXT / 1e6:g} MB; {expected} was expected")
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read as text: {error}") from error
    encoding = "utf-16" if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8-sig"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\0" in text:
        raise InputError(f"{path} cannot be read as text: it holds bytes of 0; {expected} was expected")
    lines = [(number, line) for number, line in enumerate(text.splitlines(), start=1) if line.strip(" \t,;")]
    lines = [(number, line) for number, line in lines if not line.lstrip().startswith("#")]
    if not lines:
        raise InputError(f"{path} is empty; {expected} was expected")
    return lines


def split_cells(line: str) -> list[str]:
    """Return the cells of a line, separated by semicolons, else tabs, else commas, else blanks.

    A cell may be quoted; a quote inside a cell, as in G", belongs to the cell.
    """
    mark = next((mark for mark in (";", "\t", ",") if mark in line), None)
    if mark is None:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=mark, skipinitialspace=True))]
