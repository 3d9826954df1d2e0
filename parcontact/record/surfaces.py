"""What `parcontact surface` says and draws of the rigid surface of a job."""

from collections.abc import Iterator
from pathlib import Path

from ..errors import InputError, RunError
from ..job import Job, Topography
from ..parallel.slab import Array
from ..road import statistics, surface, treatment
from . import files

PICTURES = (".png", ".pdf", ".svg")


def describe(job: Job, heights: Array, told: list[str], picture: Path) -> Iterator[str]:
    """Draw the picture and say what the heights [m], shape (ny, nx), are like, line by line; root only.

    Raises InputError and RunError.
    """
    if picture.suffix not in PICTURES:
        raise InputError(f"--out must end in {', '.join(PICTURES)}, got {str(picture)!r}")
    from .pictures import surface as pictures  # slow to import

    found = statistics.describe(heights, job.grid.size)
    sketch = pictures.Sketch(heights, job.grid.size, found, _measured(job))
    try:
        picture.parent.mkdir(parents=True, exist_ok=True)
        with files.replaced(picture, files.is_marked) as file:
            pictures.draw(sketch, file, picture.suffix[1:])
    except OSError as error:
        raise RunError(f"{picture} cannot be written: {error}") from error
    yield from told
    yield f"rms height     {found.rms_height:.5g} m"
    yield f"rms slope      {found.rms_slope:.5g}"
    yield f"rms curvature  {found.rms_curvature:.5g} 1/m"
    yield f"Nayak          {found.nayak:.4g}"
    known = found.hurst == found.hurst
    yield f"Hurst          {found.hurst:.3g}" if known else "Hurst          no self-affine range was found"
    yield f"picture: {picture}"


def _measured(job: Job) -> statistics.Statistics | None:
    """The spectrum of a measured map at its own points, levelled and filled, its edges joined smoothly."""
    parts = [part for part in job.surface if isinstance(part, Topography)]
    if len(parts) != 1 or len(job.surface) != 1:
        return None
    prepared = surface.prepare(parts[0], job.grid)
    level = treatment.treat(prepared.cut, parts[0].detrend, "smooth")
    return statistics.describe(level.heights, prepared.size)
