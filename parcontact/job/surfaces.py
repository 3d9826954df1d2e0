"""The `surface` section: shapes whose heights add up to the rigid surface, z pointing into the body.

Heights may be an array in Python; a stored job names a height file in its own directory instead.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BeforeValidator, Field, PlainValidator, ValidationInfo, WithJsonSchema

from .calculation import Grid
from .parts import LARGEST, SMALLEST, Flag, Number, Part, Positive, Real, Rule, Seed, Whole, both, chosen, existing_file
from .yaml_text import Fault, is_array, quote, refuse

if TYPE_CHECKING:
    from numpy.typing import NDArray

SAME_CELL = 1e-3  # rounding: relative difference of coordinates from equal spacing
EXPECTED = "must be a numpy array of heights [m], real and finite, of shape (ny, nx)"


class GivenHeights:
    """A read-only map of heights [m], shape (ny, nx), from Python. Only root has `values`: a job that is sent to other
    ranks loses them.

    `cell` is the spacing [m] of the points along x and y, from the coordinates of an xarray, or NaN for an array
    without coordinates.
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
        """Return the shape `shape: file` with which a stored job refers to these heights, as plain data."""
        return {"shape": "file", "path": self.heights.name, "scale": 1.0, "dataset": "heights"}


def with_shapes(surface: Any) -> Any:
    """Return the `surface` of a job as a list of shapes; arrays become shapes.

    Nested lists of numbers become one array, so that there is one message for all of them.
    """
    shapes = surface if isinstance(surface, list) else [surface]
    if len(shapes) > 1 and all(isinstance(shape, list | int | float) for shape in shapes):
        return [{"shape": "array", "heights": surface}]
    return [{"shape": "array", "heights": shape} if is_array(shape) else shape for shape in shapes]


Profile = Literal["paraboloid", "exact"]
Center = Annotated[tuple[Real, Real] | None, Field(description="a position [x, y] [m]")]
Radius = Annotated[Positive, Field(description="a positive length [m]")]
Slope = Annotated[Positive, Field(description="a positive slope [-]")]
Wavelength = Annotated[Positive, Field(description="a positive wavelength [m]")]

MapUnit = Literal["m", "mm", "um", "nm"]

FILE_KINDS = (".npy", ".h5", ".txt")


def _ordered(name: str, than: str) -> Rule:
    """Refuse a wavelength `name` that is longer than `than`."""

    def check(shorter: float, longer: float) -> Iterator[Fault]:
        if shorter > longer:
            limit = " and ".join(dict.fromkeys(("long_wavelength", than)))  # the default of `than` is long_wavelength
            yield Fault(f"must not be longer than {limit}, {longer:g} m, got {shorter!r}", (name,))

    return Rule((name, than), check)


class Anisotropy(Part):
    """Waves along `angle` are `ratio` times as long as waves of the same power across this direction."""

    ratio: Number = Field(ge=1, le=1e6, description="a number of 1 or more")
    angle: Real = Field(default=0.0, description="a finite angle [deg]")


class Rough(Part):
    """Self-affine roughness with a roll-off, Eqs. (12)-(13) of the paper. Its amplitude is given by the rms slope, the
    rms height, or the constant C of the spectrum.

    The power spectrum is constant between the long and the roll-off wavelength, falls as q^(-2(1 + hurst)) down to the
    short wavelength, and is zero elsewhere. With `amplitudes: fixed` waves have the
    amplitudes of the spectrum, and only their phases are random.
    """

    shape: Literal["rough"] = "rough"
    hurst: Number = Field(gt=0, le=1, description="a Hurst exponent above 0 and up to 1")
    long_wavelength: Wavelength
    rolloff_wavelength: Wavelength = Field(default_factory=lambda data: data.get("long_wavelength"))  # no plateau
    short_wavelength: Wavelength
    rms_slope: Positive | None = Field(default=None, description="a positive rms slope [-]")
    rms_height: Positive | None = Field(default=None, description="a positive rms height [m]")
    psd_constant: Positive | None = Field(default=None, description="a positive spectral constant [m^4]")
    anisotropy: Anisotropy | None = Field(default=None, description="a mapping {ratio: 3, angle: 30}")
    seed: Seed = 0
    amplitudes: Literal["random", "fixed"] = "random"

    one_of = (("rms_slope", "rms_height", "psd_constant"),)
    rules = (_ordered("rolloff_wavelength", "long_wavelength"), _ordered("short_wavelength", "rolloff_wavelength"))

    @property
    def longest(self) -> tuple[float, float]:
        """Return the longest wavelengths along x and along y [m]."""
        ratio, angle = (self.anisotropy.ratio, math.radians(self.anisotropy.angle)) if self.anisotropy else (1.0, 0.0)
        x, y = math.cos(angle), math.sin(angle)
        return math.hypot(ratio * x, y) * self.long_wavelength, math.hypot(x, ratio * y) * self.long_wavelength


class RoughSpectrum(Part):
    """A random surface with a measured isotropic spectrum, from a table with columns `q[1/m] C2D[m^4]`, or `q[1/m]
    C1D[m^3]` of profiles. With `hurst` the spectrum is extrapolated to shorter waves as q^(-2 (1 + hurst)). On one row
    or column of points the surface is a profile with the C1D of the table.

    The default range of wavelengths is the range of the data.
    """

    label: ClassVar[str] = "shape rough with a spectrum"
    shape: Literal["rough"] = "rough"
    spectrum: Annotated[Path, AfterValidator(existing_file), Field(description="the path of a table of a spectrum")]
    normalisation: Literal["parcontact", "surface_topography"] = "parcontact"
    hurst: Number | None = Field(default=None, gt=0, le=1, description="a Hurst exponent above 0 and up to 1")
    long_wavelength: Wavelength | None = Field(default=None, description="a positive wavelength [m]")
    short_wavelength: Wavelength | None = Field(default=None, description="a positive wavelength [m]")
    seed: Seed = 0
    amplitudes: Literal["random", "fixed"] = "random"


class Sphere(Part):
    """A sphere. With `profile: paraboloid` its shape is the parabola that touches the tip of the sphere, as in Hertz's
    theory."""

    shape: Literal["sphere"] = "sphere"
    radius: Radius
    profile: Profile = "paraboloid"
    center: Center = None  # default: the middle of the box


class Cylinder(Part):
    """A cylinder along `axis`."""

    shape: Literal["cylinder"] = "cylinder"
    radius: Radius
    axis: Literal["x", "y"] = "y"
    profile: Profile = "paraboloid"
    center: Center = None  # default: the middle of the box


class Cone(Part):
    """A circular cone whose surface falls by `slope` from its tip."""

    shape: Literal["cone"] = "cone"
    slope: Slope
    center: Center = None  # default: the middle of the box


class Pyramid(Part):
    """A square pyramid with sides along x and y; its faces fall by `slope` from its tip."""

    shape: Literal["pyramid"] = "pyramid"
    slope: Slope
    center: Center = None  # default: the middle of the box


class Punch(Part):
    """A round punch with a flat face of `radius`. Outside of the face its surface falls as a parabola whose radius of
    curvature is `edge`."""

    shape: Literal["punch"] = "punch"
    radius: Radius
    edge: Radius
    center: Center = None  # default: the middle of the box


class Wave(Part):
    """`A cos(2 pi (wx x/Lx + wy y/Ly) + phase)`; a product of cosines is the sum of two waves of half the amplitude."""

    shape: Literal["wave"] = "wave"
    amplitude: Real = Field(description="a finite height [m]")
    waves: tuple[Whole, Whole] = Field(description="two whole numbers of waves in the box, along x and along y")
    phase: Real = Field(default=0.0, description="a finite angle [rad]")


def _surface_file(path: Path, info: ValidationInfo) -> Path:
    """Return the absolute path of a file of heights; relative ones start at the job file."""
    if path.suffix not in FILE_KINDS:
        refuse(Fault(f"must end in {' or '.join(FILE_KINDS)}, got {str(path)!r}"))
    return existing_file(path, info)


class HeightFile(Part):
    """Heights from a file with the shape of the grid, multiplied by `scale`. In an HDF5 file, `dataset` is the name of
    the dataset of heights."""

    shape: Literal["file"] = "file"
    path: Annotated[Path, AfterValidator(_surface_file), Field(description="the path of a .npy, .h5 or .txt file")]
    scale: Real = Field(default=1.0, description="a finite factor that makes heights [m] of the numbers")
    dataset: str = Field(default="heights", description="the name of a dataset (text)")


class MapUnits(Part):
    """Units of a measured map: of positions (xy) and of heights (z)."""

    xy: MapUnit
    z: MapUnit


class Topography(Part):
    """A measured map of heights, in any format that SurfaceTopography reads, or .npy, .h5, .mat and text.

    The job uses a part of the map, which lies around `centre` and is as large as the box. This part is levelled,
    filled, made periodic and resampled to the grid.
    """

    shape: Literal["topography"] = "topography"
    path: Annotated[Path, AfterValidator(existing_file), Field(description="the path of a measured map")]
    unit: MapUnit | None = None  # unit of heights and positions, only for formats without units
    units: MapUnits | None = Field(default=None, description="a mapping {xy: UNIT, z: UNIT}")
    size: Annotated[
        tuple[Positive, Positive] | None, Field(description="two positive lengths [m], only for formats that have none")
    ] = None
    pixel: Annotated[
        tuple[Positive, Positive] | None, BeforeValidator(both), Field(description="one or two positive lengths [m]")
    ] = None
    nodata: Number | None = Field(default=None, description="the number that marks missing points in the file")
    outliers: Literal["keep", "clip"] = "keep"
    short_wavelength: Wavelength | None = Field(default=None, description="a positive wavelength [m]")
    channel: str | None = Field(default=None, description="the name of a channel of the file (text)")
    centre: Annotated[
        tuple[Positive, Positive] | None, Field(description="two positive lengths [m] from the corner of the map")
    ] = None  # the middle of the map
    detrend: Literal["none", "mean", "tilt", "curvature"] = "tilt"
    fill: Flag = Field(default=True, description="true or false: whether missing points are filled")
    periodic: Literal["smooth", "mirror", "none"] | None = None  # smooth; none in a free scene

    at_most_one = (("unit", "units"), ("size", "pixel"))

    @property
    def copies(self) -> int:
        """Return the number of copies of the map along each axis: 2 if it is mirrored."""
        return 2 if self.periodic == "mirror" else 1

    @property
    def unit_of_heights(self) -> MapUnit | None:
        return self.units.z if self.units else self.unit

    def size_of(self, points: tuple[int, ...]) -> tuple[float, float] | None:
        """Return the size [m] along x and y that the job gives for a map: the key `size`, or `pixel` times the numbers
        of `points` of the map. Return None if the job has neither key."""
        return (self.pixel[0] * points[0], self.pixel[1] * points[1]) if self.pixel else self.size


class Flat(Part):
    """Zero height everywhere."""

    shape: Literal["flat"] = "flat"


# Shapes given by their waves; the others are closed forms at every point.
Spectral = Rough | RoughSpectrum | Wave | HeightFile | HeightArray | Topography
Indenter = Sphere | Cylinder | Cone | Pyramid | Punch
OnOneMesh = HeightFile | HeightArray  # shapes known at the points of one grid only
KINDS: dict[str, type[Part]] = {
    "rough": Rough,
    "sphere": Sphere,
    "cylinder": Cylinder,
    "cone": Cone,
    "pyramid": Pyramid,
    "punch": Punch,
    "wave": Wave,
    "file": HeightFile,
    "array": HeightArray,
    "topography": Topography,
    "flat": Flat,
}
CHOSEN = chosen("shape", KINDS)


def _shape(data: Any, info: ValidationInfo) -> Any:
    """Return a shape; `shape: rough` with a `spectrum` is a RoughSpectrum."""
    if isinstance(data, dict) and data.get("shape") == "rough" and data.get("spectrum") is not None:
        return RoughSpectrum.model_validate(data, context=info.context)
    return data if isinstance(data, RoughSpectrum) else CHOSEN(data, info)


AnyShape = Rough | RoughSpectrum | Indenter | Wave | HeightFile | HeightArray | Topography | Flat
Shape = Annotated[AnyShape, PlainValidator(_shape, json_schema_input_type=AnyShape)]


def wave_numbers(shape: Any, grid: Grid) -> tuple[float, ...]:
    """Return the wavenumber [rad/m] of a wave, or the lowest and the highest wavenumber of another shape. Return () for
    a flat surface. Round shapes and files may have every wave from the length of the box to that of two cells."""
    longest = 2.0 * math.pi / grid.longest_side
    cells = [cell for cell, n in zip((grid.dx, grid.dy), grid.points, strict=True) if n > 1]
    if isinstance(shape, Flat):
        return ()
    if isinstance(shape, Wave):
        waves = [2.0 * math.pi * n / length for n, length in zip(shape.waves, grid.size, strict=True)]
        return (math.hypot(*waves),) if any(waves) else ()
    if isinstance(shape, Rough):
        ratio = shape.anisotropy.ratio if shape.anisotropy else 1.0
        return max(2.0 * math.pi / (ratio * shape.long_wavelength), longest), 2.0 * math.pi / shape.short_wavelength
    return longest, max(math.pi / min(cells, default=math.inf), longest)
