"""Numbers in files of others: .npy files, opened without reading what a damaged header claims, and lines of text."""

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

HEADER_BYTES = 1_000_000
TEXTS = (".txt", ".xyz", ".csv", ".dat", ".asc")
OWN_FORMATS = (".npy", *TEXTS)  # of maps; others are read by SurfaceTopography
LOWEST, HIGHEST = 1e-70, 1e70  # accuracy: of the largest height [m], whose fourth power is still a number
LARGEST_TEXT = 50_000_000  # bytes


def open_numbers(path: Path) -> NDArray[Any]:
    """A file's array, mapped into memory. Raises InputError for what holds no real numbers, and what numpy raises."""
    import numpy as np  # slow, for those who read text only

    with path.open("rb") as file:
        start = file.read(12)
    if not start:
        raise InputError(f"{path} cannot be read: it is empty")
    if start[6:7] in (b"\2", b"\3") and int.from_bytes(start[8:12], "little") > HEADER_BYTES:  # numpy would read them
        raise InputError(f"{path} cannot be read: its header claims to be larger than {HEADER_BYTES / 1e6:g} MB")
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
    """Raise InputError for maps whose largest height or gap [m] overflows, or vanishes, in what follows from it."""
    if largest and not LOWEST <= largest <= HIGHEST:
        raise InputError(f"{what}: its largest value is {largest:.3g} m, which cannot be computed with")


def refuse_no_numbers(path: Path, kind: np.dtype[Any]) -> None:
    """Raise InputError for values that are no real numbers."""
    if kind.kind not in "iuf":
        raise InputError(f"{path} holds values of type {kind}, which are no heights")


def foreign_numbers(path: Path) -> str:
    """Return why a file of text is no map that can be read, and what to do; '' where nothing is seen at its start."""
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
    """Return whether a line holds several numbers like 0,1 with something else than commas between them."""
    parts = [part for part in re.split(r"[;\s]+", line) if part]
    return (
        len(parts) > 1 and "," in line and all(re.fullmatch(r"[-+]?\d+(,\d+)?([eE][-+]?\d+)?", part) for part in parts)
    )


def read_lines(path: Path, expected: str) -> list[tuple[int, str]]:
    """Return the lines of a text file that hold more than a comment, with their numbers.

    Texts are UTF-8, UTF-16 with its mark, or Latin-1, as instruments write them. Raises InputError, also where no such
    line is.
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
    """Return the cells of a line, between semicolons, tabs or commas, whichever comes first in this list, or blanks.

    A cell may be quoted; a quote inside a cell, as in G", belongs to it.
    """
    mark = next((mark for mark in (";", "\t", ",") if mark in line), None)
    if mark is None:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=mark, skipinitialspace=True))]
