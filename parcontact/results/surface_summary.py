"""Sentences and picture of the rigid surface of a job, for `parcontact surface`."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..job import Job, Topography
from ..parallel.slab import Array
from ..physics import surface_statistics as statistics
from ..printed import per_cent, quantity, with_error
from ..road import map_files, treatment
from ..road.prepared_map import prepare
from ..storage import hdf5
from . import style, surface_picture

NOT_SELF_AFFINE = "no self-affine range was found"


def describe_surface(
    job: Job, heights: Array, remarks: list[str], shortest: float | None, picture: Path
) -> Iterator[str]:
    """Draw the picture and yield sentences on the heights [m], shape (ny, nx); root only. `shortest` [m] is the
    shortest wave of a measured surface, else None. Raises InputError and RunError."""
    if picture.suffix[1:] not in style.MARKED:
        raise InputError(f"--out must end in .{', .'.join(style.MARKED)}, got {str(picture)!r}")
    found, part, measured = statistics.surface_statistics(heights, job.grid.size), job.surface[0], None
    lines = []
    whole = map_files.read_map(part) if isinstance(part, Topography) and len(job.surface) == 1 else None
    if isinstance(part, Topography) and whole and not whole.is_line:  # at its own points, its edges joined smoothly
        prepared = prepare(part, job.grid, whole)
        (ny, nx), (lx, ly) = prepared.cut.shape, prepared.size
        measured = statistics.surface_statistics(
            treatment.treat(prepared.cut, part.detrend, "smooth").heights, prepared.size
        )
        lines = [f"size           {quantity(lx, 'm', 5)} x {quantity(ly, 'm', 5)}", f"points         {nx} x {ny}"]
        lines.append(f"pixel          {quantity(lx / nx, 'm', 4)} x {quantity(ly / ny, 'm', 4)}")
        lines.append(f"missing        {per_cent(float(np.isnan(prepared.cut).mean()))} of its points")
    try:
        picture.parent.mkdir(parents=True, exist_ok=True)
        surface_picture.draw_surface(surface_picture.Sketch(heights, job.grid.size, found, measured), picture)
    except OSError as error:
        raise InputError(f"{picture} cannot be written: {hdf5.reason(error)}") from error
    yield from (*lines, *remarks)
    yield f"rms height     {quantity(found.rms_height, 'm', 4)}"
    yield f"rms slope      {found.rms_slope:.4g}"
    yield f"rms curvature  {found.rms_curvature:.4g} 1/m"
    yield f"Nayak          {found.nayak:.4g}"
    longest, two_cells = max(job.grid.size), 2.0 * max(job.grid.dx, job.grid.dy)
    yield f"spectrum       waves of {quantity(longest, 'm', 4)} to {quantity(two_cells, 'm', 4)}"
    own = measured or found  # a measured map at its own points, which no mirror has made twice as long
    yield f"Hurst          {with_error(own.hurst, own.hurst_error) if own.hurst == own.hurst else NOT_SELF_AFFINE}"
    if shortest is not None:
        cells = shortest / max(length / n for length, n in zip(job.grid.size, job.grid.points, strict=True) if n > 1)
        yield f"shortest wave  {quantity(shortest, 'm', 4)}, {cells:.3g} cells"
    yield f"picture: {picture}"
