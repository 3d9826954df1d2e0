"""Sentences about measured maps: how they were prepared, and warnings about them."""

from collections.abc import Iterator

import numpy as np

from ..errors import Doubt, Kind
from ..job import Topography, measured_maps
from ..job.map_files import Map
from ..job.measured_maps import Prepared
from ..physics.surface_statistics import surface_statistics
from ..printed import per_cent, quantity

LARGEST, SMALLEST = 1.0, 5e-11  # m: largest side of a map, and least distance of its points, without a warning
FLATTEST = 1e-5  # physics: least range of heights over the shorter side without a warning, that of a polished wafer
OBLONG = 1.5  # largest ratio of the sides of a pixel without a warning; most instruments have squares


def describe_treatment(prepared: Prepared) -> list[str]:
    """Return sentences on how a map was prepared."""
    part, cut, done, size = prepared.part, prepared.cut, prepared.treated, prepared.size
    (ny, nx), (lx, ly), odd = cut.shape, (quantity(length, "m", 4) for length in size), int(done.outliers.sum())
    lines = [f"road: {nx} x {ny} points of the map, {lx} x {ly}, are used"]
    if done.missing:
        lines.append(f"road: {done.missing} missing points ({per_cent(done.missing / cut.size)}) were filled")
    if odd and part.outliers == "clip":
        lines.append(f"road: outliers set to the median of their neighbours: {odd}")
    if part.short_wavelength:
        lines.append(
            f"road: waves shorter than {quantity(part.short_wavelength, 'm', 4)} were removed (ideal low-pass)"
        )
    return lines


def describe_line(part: Topography, line: Map) -> str:
    """Return a sentence on the random surface that is made from the line scan `line`."""
    length = quantity(line.size[0], "m", 4)
    return (
        f"road: {part.path.name} is a line scan of {line.heights.size} points over {length}; the surface is a random "
        "isotropic one with its spectrum (C1D)"
    )


WARN_LARGE_MAP = Kind("large map", "{file}: the map is {lx:.4g} x {ly:.4g} m; are lengths in m?")
WARN_NEAR_POINTS = Kind(
    "near points", "{file}: the spacing of points is {dx!m}, less than the size of atoms; is the unit right?"
)
WARN_FLAT_MAP = Kind(
    "flat map",
    "{file}: the map is {lx!m} x {ly!m}, and its heights differ by {span!M} only; do heights and lengths have the "
    "right units?",
)
WARN_OBLONG_POINTS = Kind(
    "oblong points",
    "{file}: the spacing of points is {dx!m} along x and {dy!m} along y; is the order of x and y right?",
)


def doubt_sizes(prepared: Prepared) -> Iterator[Doubt]:
    """Yield warnings about the size of a map whose units may be confused."""
    found, name = prepared.whole, prepared.part.path.name
    (ny, nx), (lx, ly) = found.heights.shape, found.size
    dx, dy = lx / nx, ly / ny
    span = float(np.nanmax(found.heights) - np.nanmin(found.heights))
    if max(lx, ly) > LARGEST:
        yield WARN_LARGE_MAP("surface", {"file": name, "lx": lx, "ly": ly})
    if max(dx, dy) < SMALLEST:
        yield WARN_NEAR_POINTS("surface", {"file": name, "dx": dx})
    if 0.0 < span < FLATTEST * min(lx, ly):
        yield WARN_FLAT_MAP("surface", {"file": name, "lx": lx, "ly": ly, "span": span})
    if max(dx, dy) > OBLONG * min(dx, dy):
        yield WARN_OBLONG_POINTS("surface", {"file": name, "dx": dx, "dy": dy})


WARN_OUTLIERS = Kind(
    "outliers",
    "{count} points of the map differ from their neighbours by more than {deviations:g} times the median "
    "deviation{repeated}. Its rms slope is {slope:.3g} with them and {without:.3g} without, and they carry load; "
    "if they are no part of the surface, give outliers: clip{nodata}",
)


def doubt_outliers(prepared: Prepared) -> Iterator[Doubt]:
    """Yield a warning about outliers, if there are any and they are kept."""
    odd, cut = prepared.treated.outliers, prepared.cut
    if not odd.any() or prepared.part.outliers == "clip":
        return
    slope, without = (
        surface_statistics(measured_maps.treat(heights, "tilt", "smooth").heights, prepared.size).rms_slope
        for heights in (cut, np.where(odd, np.nan, cut))
    )
    furthest = cut[odd][np.argmax(np.abs(cut[odd] - np.nanmedian(cut)))]
    count = int(np.count_nonzero(cut == furthest))
    repeated = f"; {quantity(furthest, 'm', 4)} occurs {count} times" if count > 1 else ""
    nodata = ", or nodata: NUMBER if one number marks missing points" if prepared.part.nodata is None else ""
    numbers = {
        "nodata": nodata,
        "count": int(odd.sum()),
        "deviations": measured_maps.OUTLIER,
        "slope": slope,
        "without": without,
    }
    yield WARN_OUTLIERS("surface", {**numbers, "repeated": repeated})
