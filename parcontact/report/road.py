"""The section about the rigid surface of a job."""

from functools import partial

from ..derived.surface_summary import NOT_SELF_AFFINE
from ..errors import InputError
from ..job import Job
from ..job.sections import listing
from ..parallel.fft import FFT
from ..parallel.slab import Slab
from ..physics import surface_statistics as statistics
from ..plotting import surface, units
from ..scene import rigid_surface
from .parts import ReportSection, ReportTable, draw_panel

MOST_POINTS = 2**22  # of a surface that is made anew for a report


def section(job: Job) -> ReportSection:
    """Describe the surface of a job, made anew; where its files are gone or it is too large, as the job says."""
    shapes = ReportTable(("shape",), [(listing.line(part),) for part in job.surface], "shapes, whose heights add up")
    if job.grid.nx * job.grid.ny > MOST_POINTS:
        return ReportSection("Surface", ["The surface has too many points to be made anew for a report."], [shapes])
    slab = Slab.alone(*job.grid.points)
    try:
        made, told = rigid_surface.make_surface(job, FFT(slab))
    except InputError as error:
        return ReportSection("Surface", [f"The surface cannot be made anew: {error}."], [shapes])
    heights, sentences = made.heights((0.0, 0.0), slab.empty()), [*told.notes, *map(str, told.doubts)]
    found = statistics.describe(heights, job.grid.size)
    if not found.rms_height:
        return ReportSection("Surface", [*sentences, "The surface is flat."], [shapes])
    rows = [
        ("rms height", units.quantity(found.rms_height, "m", 4)),
        ("rms slope", f"{found.rms_slope:.4g}"),
        ("rms curvature", f"{found.rms_curvature:.4g} 1/m"),
        ("Nayak's parameter", f"{found.nayak:.4g}"),
        ("Hurst exponent", f"{found.hurst:.3g}" if found.hurst == found.hurst else NOT_SELF_AFFINE),
    ]
    tables = [shapes, ReportTable(("on the grid of the job", "value"), rows)]
    sketch = surface.Sketch(heights, job.grid.size, found)
    pictures = [draw_panel(partial(panel, sketch=sketch), caption) for caption, panel in surface.PANELS.items()]
    return ReportSection("Surface", sentences, tables, pictures)
