"""The section on the rigid surface of a job."""

from functools import partial

import numpy as np

from ..bands.band import Band
from ..bands.choice import cut_bands, describe_cut
from ..errors import InputError
from ..job import Indenter, Job
from ..job.sections import listing
from ..parallel.fft import FFT
from ..parallel.slab import Slab
from ..physics import surface_statistics as statistics
from ..printed import with_error
from ..scene import rigid_surface
from . import prefixes, surface_picture
from .page_parts import Picture, ReportSection, ReportTable, draw_panel
from .surface_summary import NOT_SELF_AFFINE

MOST_POINTS = 2**22  # most points of a surface that is computed for a report


def road_section(job: Job) -> ReportSection:
    """Return the section on the surface of a job, computed again; if its files no longer exist or it is too large, its
    keys only."""
    shapes = ReportTable(
        ("shape",), [(listing.listed_line(part),) for part in job.surface], "shapes, whose heights add up"
    )
    if job.bands is not None:
        return _describe_bands(job, shapes)
    if job.grid.nx * job.grid.ny == 1:  # a job in bands without its files
        return ReportSection("Surface", ["The surface cannot be computed again: the files of the job do not exist."])
    if job.grid.nx * job.grid.ny > MOST_POINTS:
        return ReportSection(
            "Surface", ["The surface has too many points to be computed again for a report."], [shapes]
        )
    slab = Slab.alone(*job.grid.points)
    try:
        made, remarks = rigid_surface.make_surface(job, FFT(slab))
    except InputError as error:
        return ReportSection("Surface", [f"The surface cannot be made anew: {error}."], [shapes])
    heights, sentences = made.heights((0.0, 0.0), slab.empty()), [*remarks.notes, *map(str, remarks.doubts)]
    found = statistics.surface_statistics(heights, job.grid.size)
    if not found.rms_height:
        return ReportSection("Surface", [*sentences, "The surface is flat."], [shapes])
    waves = any(not isinstance(part, Indenter) for part in job.surface)
    tables = [shapes, *([_tabulate(found, "on the grid of the job")] if waves else [])]
    return ReportSection("Surface", sentences, tables, _draw(surface_picture.Sketch(heights, job.grid.size, found)))


def _describe_bands(job: Job, shapes: ReportTable) -> ReportSection:
    """Return the section on the bands of a job, and the surface of the coarsest one."""
    try:
        cut = cut_bands(job)
        setup = Band(job, cut, 0, 0).setup
    except InputError as error:
        return ReportSection("Surface", [f"The surface cannot be made anew: {error}."], [shapes])
    rows = []
    for band in range(cut.count):
        ends = " to ".join(prefixes.quantity(end, "m") for end in cut.wavelengths(band))
        rows.append((ends, f"{cut.rms_slope(band):.3g}", f"{cut.rms_slope(band, 0):.3g}"))
    bands = ReportTable(("waves", "rms slope", "with all longer waves"), rows, "bands, each on its own grid")
    heights = setup.surface.heights((0.0, 0.0), setup.slab.empty()) * setup.units.height
    found = statistics.surface_statistics(heights, setup.grid.size)
    pictures = _draw(surface_picture.Sketch(heights, setup.grid.size, found), ", coarsest band")
    tables = [shapes, bands, _tabulate(found, "of the coarsest band")]
    return ReportSection("Surface", [f"{text}." for text in describe_cut(cut, job)], tables, pictures)


def _tabulate(found: statistics.Statistics, where: str) -> ReportTable:
    hurst = NOT_SELF_AFFINE if np.isnan(found.hurst) else with_error(found.hurst, found.hurst_error)
    rows = [
        ("rms height", prefixes.quantity(found.rms_height, "m", 4)),
        ("rms slope", f"{found.rms_slope:.4g}"),
        ("rms curvature", f"{found.rms_curvature:.4g} 1/m"),
        ("Nayak's parameter", f"{found.nayak:.4g}"),
        ("Hurst exponent", hurst),
    ]
    return ReportTable((where, "value"), rows)


def _draw(sketch: surface_picture.Sketch, of: str = "") -> list[Picture]:
    return [
        draw_panel(partial(panel, sketch=sketch), f"{caption}{of}") for caption, panel in surface_picture.PANELS.items()
    ]
