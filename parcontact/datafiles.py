"""Read .npy files that users give, and refuse heights out of range; damaged files raise InputError."""

from __future__ import annotations

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
