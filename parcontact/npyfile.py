"""Arrays of numbers in .npy files, opened without reading what a damaged header claims."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import InputError

HEADER_BYTES = 1_000_000


def open_numbers(path: Path) -> NDArray[Any]:
    """A file's array, mapped into memory. Raises InputError for what holds no real numbers, and what numpy raises."""
    with path.open("rb") as file:
        start = file.read(12)
    if start[6:7] in (b"\2", b"\3") and int.from_bytes(start[8:12], "little") > HEADER_BYTES:  # numpy would read them
        raise InputError(f"{path} cannot be read: its header claims to be larger than {HEADER_BYTES / 1e6:g} MB")
    try:
        values = np.lib.format.open_memmap(path, mode="r")
    except ValueError as error:
        if "mmap length" not in str(error):
            raise
        raise InputError(f"{path} cannot be read: it ends before the last of its values") from error
    refuse_no_numbers(path, values.dtype)
    return values


def refuse_no_numbers(path: Path, kind: np.dtype[Any]) -> None:
    """Raise InputError for values that are no real numbers."""
    if kind.kind not in "iuf":
        raise InputError(f"{path} holds values of type {kind}, which are no heights")
