"""A measured road as a shape of the surface, and random roughness with a measured spectrum."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from .part import Part, existing_file
from .values import Flag, Number, Positive, Seed


class RoughSpectrum(Part):
    """A random surface with a measured isotropic spectrum, in a table whose columns say which: `q[1/m] C2D[m^4]`, or
    `q[1/m] C1D[m^3]` of profiles. With `hurst` it goes on beyond its shortest wave as q^(-2 (1 + hurst)).

    Wavelengths are those of the data unless they are given.
    """

    label: ClassVar[str] = "shape rough with a spectrum"
    shape: Literal["rough"] = "rough"
    spectrum: Annotated[Path, AfterValidator(existing_file), Field(description="the path of a table of a spectrum")]
    hurst: Number | None = Field(default=None, gt=0, le=1, description="a Hurst exponent above 0 and up to 1")
    long_wavelength: Annotated[Positive | None, Field(description="a positive wavelength [m]")] = None
    short_wavelength: Annotated[Positive | None, Field(description="a positive wavelength [m]")] = None
    seed: Annotated[Seed, Field(description="a whole number of zero or more")] = 0
    amplitudes: Literal["random", "fixed"] = "random"


class Topography(Part):
    """A measured map of heights, in any format that SurfaceTopography reads, or .npy, .txt and .xyz.

    The middle of the map that is as large as the box is levelled, filled, made periodic and resampled to the grid.
    """

    label: ClassVar[str] = "shape topography"
    shape: Literal["topography"] = "topography"
    path: Annotated[Path, AfterValidator(existing_file), Field(description="the path of a measured map")]
    unit: Literal["m", "mm", "um", "nm"] | None = None  # of heights; only for formats that have none
    size: Annotated[
        tuple[Positive, Positive] | None, Field(description="two positive lengths [m], only for formats that have none")
    ] = None
    channel: str | None = Field(default=None, description="the name of a channel of the file (text)")
    detrend: Literal["none", "mean", "tilt", "curvature"] = "tilt"
    fill: Flag = Field(default=True, description="true or false: whether missing points are filled")
    periodic: Literal["smooth", "window", "mirror", "none"] | None = None  # smooth; none in a free scene
