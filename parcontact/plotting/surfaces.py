"""What `parcontact surface` says and draws of the rigid surface of a job."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..errors import InputError, RunError
from ..job import Job, Topography
from ..parallel.slab import Array
from ..road import statistics, surface, treatment
from ..storage import files

PICTURES = (".png", ".pdf", ".svg")


def describe(job: Job, heights: Array, told: list[str], shortest: float | None, picture: Path) -> Iterator[str]:
    """Draw the picture and say what the heights [m], shape (ny, nx), are like, line by line; root only.

    `shortest` [m] is the shortest wave of a measured surface, None of others.

    Raises InputError and RunError.
    """
    if picture.suffix not in PICTURES:
        raise InputError(f"--out must end in {', '.join(PICTURES)}, got {str(picture)!r}")
    from . import surface as pictures  # slow to import

    found, prepared = statistics.describe(heights, job.grid.size), _prepared(job)
    sketch = pictures.Sketch(heights, job.grid.size, found, _measured(job, prepared))
    try:
        picture.parent.mkdir(parents=True, exist_ok=True)
        with files.replaced(picture, files.is_marked) as file:
            pictures.draw(sketch, file, picture.suffix[1:])
    except OSError as error:
        raise RunError(f"{picture} cannot be written: {error}") from error
    if prepared:
        yield from _map_lines(prepared)
    yield from told
    yield f"rms height     {found.rms_height:.5g} m"
    yield f"rms slope      {found.rms_slope:.5g}"
    yield f"rms curvature  {found.rms_curvature:.5g} 1/m"
    yield f"Nayak          {found.nayak:.4g}"
    longest, shortest = max(job.grid.size), 2.0 * max(job.grid.dx, job.grid.dy)
    yield f"spectrum       waves of {longest:.4g} to {shortest:.4g} m"
    known = found.hurst == found.hurst
    yield f"Hurst          {found.hurst:.3g}" if known else "Hurst          no self-affine range was found"
    if shortest is not None:
        cells = shortest / max(length / n for length, n in zip(job.grid.size, job.grid.points, strict=True) if n > 1)
        yield f"shortest wave  {shortest:.4g} m, {cells:.3g} cells"
    yield f"picture: {picture}"


def _map_lines(prepared: surface.Prepared) -> Iterator[str]:
    """What the part of a measured map that is used was like."""
    (ny, nx), (lx, ly) = prepared.cut.shape, prepared.size
    yield f"size           {lx:.5g} x {ly:.5g} m"
    yield f"points         {nx} x {ny}"
    yield f"pixel          {lx / nx:.4g} x {ly / ny:.4g} m"
    yield f"missing        {float(np.isnan(prepared.cut).mean()):.2%} of its points"


def _prepared(job: Job) -> surface.Prepared | None:
    """The measured map, where that is the whole surface."""
    part = job.surface[0]
    return surface.prepare(part, job.grid) if isinstance(part, Topography) and len(job.surface) == 1 else None


def _measured(job: Job, prepared: surface.Prepared | None) -> statistics.Statistics | None:
    """The spectrum of a measured map at its own points, levelled and filled, its edges joined smoothly."""
    part = job.surface[0]
    if prepared is None or not isinstance(part, Topography):
        return None
    level = treatment.treat(prepared.cut, part.detrend, "smooth")
    return statistics.describe(level.heights, prepared.size)
