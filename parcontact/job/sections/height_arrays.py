"""Heights given as an array in Python. A stored job names a height file in its own directory instead."""

from __future__ import annotations

import math
import zlib
from io import BytesIO
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, PlainValidator, WithJsonSchema

from ..text.fault import Fault, quote, refuse
from ..text.python_data import is_array
from .part import Part
from .quantities import LARGEST, SMALLEST

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

SAME_CELL = 1e-3  # rounding: relative difference of coordinates from equal spacing
EXPECTED = "must be a numpy array of heights [m], real and finite, of shape (ny, nx)"


class GivenHeights:
    """A read-only map of heights [m], shape (ny, nx). Only root has `values`: they are not sent with the job.

    `cell` is the spacing [m] of points along x and y, NaN without coordinates.
    """

    def __init__(self, given: Any) -> None:
        """Raise TypeError or ValueError unless `given` is a map of finite real numbers."""
        import numpy as np  # slow import, not needed for jobs in files

        self.cell = math.nan, math.nan
        if sorted(map(str, getattr(given, "dims", ()))) == ["x", "y"]:  # xarray's axes have names, and places
            given = given.transpose("y", "x").sortby([axis for axis in ("x", "y") if axis in given.coords])
            self.cell = _distance(given, "x"), _distance(given, "y")
        found = np.asanyarray(given)
        if found.ndim != 2 or not found.size or found.dtype.kind not in "iuf":
            raise TypeError(f"an array of shape {found.shape} of {found.dtype}")
        values = np.ma.array(found, dtype=np.float64, copy=True, order="C").filled(np.nan)
        if wrong := int(np.count_nonzero(~np.isfinite(values))):
            raise ValueError(f"{wrong} of {values.size} that are not finite")
        highest = float(np.abs(values).max(initial=0.0))
        if highest and not SMALLEST <= highest <= LARGEST:
            raise ValueError(f"heights of {highest:.3g} m, outside of {SMALLEST:g} to {LARGEST:g} m")
        values.flags.writeable = False
        self.values: NDArray[np.float64] | None = values
        self.shape: tuple[int, int] = values.shape
        np.save(stored := BytesIO(), values)
        self.checksum = f"{zlib.crc32(stored.getbuffer()):08x}"

    @property
    def name(self) -> str:
        """Return the name of the file in which the heights are stored, with their checksum."""
        return f"surface-{self.checksum}.npy"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, GivenHeights) and (self.shape, self.checksum) == (other.shape, other.checksum)

    def __hash__(self) -> int:
        return hash((self.shape, self.checksum))

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "values": None}

    def __repr__(self) -> str:
        return f"an array of shape {self.shape}"


def _distance(given: Any, axis: str) -> float:
    """Return the spacing [m] of an xarray.DataArray along an axis, NaN without coordinates.

    Raises ValueError if coordinates are not equally spaced.
    """
    import numpy as np

    if axis not in given.coords or given.coords[axis].size < 2:
        return math.nan
    steps = np.diff(np.asarray(given.coords[axis], dtype=np.float64))
    mean = float(steps.mean())
    if not (np.abs(steps - mean) <= SAME_CELL * mean).all():
        raise ValueError(f"coordinates {axis} that are not equally spaced")
    return mean


def _heights(given: Any) -> GivenHeights:
    if isinstance(given, GivenHeights):
        return given
    if not hasattr(given, "__array__"):
        refuse(Fault(f"{EXPECTED}, got {quote(given)}; a job file names a file instead, {{shape: file, path: ...}}"))
    try:
        return GivenHeights(given)
    except (TypeError, ValueError) as error:
        refuse(Fault(f"{EXPECTED}, got {error}"))


class HeightArray(Part):
    """Heights given in Python as a numpy array; a stored job names a height file instead."""

    shape: Literal["array"] = "array"
    heights: Annotated[GivenHeights, PlainValidator(_heights), WithJsonSchema({"allOf": [False]})] = Field(
        description="a numpy array of heights [m] of shape (ny, nx)"
    )

    def stored(self) -> dict[str, Any]:
        """Return the `shape: file` of a stored job, as plain data."""
        return {"shape": "file", "path": self.heights.name, "scale": 1.0, "dataset": "heights"}


def with_shapes(surface: Any) -> Any:
    """Return the `surface` of a job as a list of shapes; arrays become shapes.

    Nested lists of numbers become one array, which is refused as a whole.
    """
    shapes = surface if isinstance(surface, list) else [surface]
    if len(shapes) > 1 and all(isinstance(shape, list | int | float) for shape in shapes):
        return [{"shape": "array", "heights": surface}]
    return [{"shape": "array", "heights": shape} if is_array(shape) else shape for shape in shapes]
