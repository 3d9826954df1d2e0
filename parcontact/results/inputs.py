"""Surfaces and materials before a run: what `parcontact surface` and `parcontact fit` write.

The picture of the rigid surface of a job shows the map of the heights, their distribution, and their spectra with the
limits of the grid. From a measured map the program makes two jobs: one with which it describes the map, and one that a
user can change and run.

A file of a fitted material is a section that jobs include. Its picture shows the moduli at the reference temperature
with the fit, residuals, branches and shift factors.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from operator import le
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import printed
from ..errors import InputError
from ..files import files
from ..job import Job, Topography, map_files, measured_maps, yaml_text
from ..job.listing import plain_data
from ..job.measured_maps import prepare
from ..march import mesh
from ..parallel.slab import Array
from ..printed import per_cent, quantity, with_error
from ..rubber.compound import TITLE, Compound
from . import style
from .panels import Axis, Colors, Line, Panel, Shade, drawn_points, picture

if TYPE_CHECKING:
    from ..physics.roughness import Statistics

BINS = 60
FEW, OUTLYING = (1e-3, 1.5)  # share of outlying points on either side, and the drawn range over the range of the others
RESOLVED = 8  # cells of a wave that is resolved in a contact
BARS = {"color": style.BLUE, "drawstyle": "steps-mid"}
ROUNDING = 1e-20  # rounding: smallest drawn power over the largest


@dataclass(frozen=True)
class Sketch:
    """Data of a surface's picture: heights [m] of shape (ny, nx) on a box of `size` [m], and their statistics;
    `measured` is the spectrum of the original map, if any."""

    heights: Array
    size: tuple[float, float]
    found: Statistics
    measured: Statistics | None = None


def draw_surface(sketch: Sketch, path: Path) -> None:
    """Write the picture of a surface, a png, pdf or svg; raises OSError."""
    with style.drawing():
        style.save_figure(picture("", [list(panels_of(sketch).values())]), path, path.suffix[1:])


def panels_of(sketch: Sketch) -> dict[str, Panel]:
    """Return the panels of a rigid surface: a mapping from a description to the panel that it describes."""
    found, (lx, ly) = sketch.found, sketch.size
    ends = _find_ends(drawn_points(sketch.heights))
    colors = Colors(sketch.heights, (0.0, lx, 0.0, ly), Axis("height", "m"), *ends, "cividis")
    profiles = [("along x", found.qx, found.psd_x, 0), ("along y", found.qy, found.psd_y, 1)]
    kinds = [("measured", sketch.measured, 1), ("on the grid", found, 0)]
    directions = [(name, each.q, each.psd_2d, number) for name, each, number in kinds if each is not None]
    return {
        "map of the heights": Panel("map", Axis("x", "m"), Axis("y", "m"), colors=colors),
        "distribution of the heights": _distribution(sketch),
        "spectra of profiles": _spectra(sketch, profiles, Axis("PSD of profiles", "m³")),
        "spectrum over directions": _spectra(sketch, directions, Axis("PSD over directions [m⁴]")),
    }


def _find_ends(heights: Array) -> tuple[float, float]:
    """Return the range of heights that is drawn, which ignores a few outliers."""
    low, most, highest, high = (float(end) for end in np.quantile(heights, [0.0, FEW, 1.0 - FEW, 1.0]))
    middle = 0.5 * (most + highest)
    low, high = max(low, middle - OUTLYING * (middle - most)), min(high, middle + OUTLYING * (highest - middle))
    return (low, high) if low < high else (float(heights.min()), float(heights.max()))


def _distribution(sketch: Sketch) -> Panel:
    heights = sketch.heights.ravel() - sketch.heights.mean()
    low, high = _find_ends(heights)
    unit, size = printed.prefixed("m", max(abs(low), abs(high)))
    density, edges = np.histogram(np.clip(heights, low, high), BINS, density=True)
    lines = [Line("heights", 0.5 * (edges[1:] + edges[:-1]), size * density, BARS)]
    if (rms := float(heights.std())) > 0.0:
        x = np.linspace(-4 * rms, 4 * rms, 200)
        normal = np.exp(-0.5 * (x / rms) ** 2) / (rms / size * np.sqrt(2 * np.pi))
        lines.append(Line("normal", x, normal, {"color": style.RED}))
    return Panel("distribution", Axis("height over mean", "m"), Axis(f"density [1/{unit}]"), lines)


def _spectra(sketch: Sketch, spectra: list[tuple[str, Array, Array, int]], of: Axis) -> Panel:
    """Return the panel of spectra, each with name, wavenumbers, powers and number, and the limits of the grid."""
    lines, seen = list[Line](), list[float]()
    for label, q, power, number in spectra:
        drawn = power > ROUNDING * power.max(initial=0.0)
        lines.append(Line(label, q[drawn], power[drawn], style.line(number)))
        seen += power[drawn].tolist()
    steps = [length / n for length, n in zip(sketch.size, sketch.heights.shape[::-1], strict=True) if n > 1]
    cell = max(steps, default=max(sketch.size))
    ends = np.array([min(seen, default=1.0), max(seen, default=1.0)])
    for cells, dashes in ((RESOLVED, ":"), (2, "--")):
        at = np.full(2, 2 * np.pi / (cells * cell))
        lines.append(Line(f"waves of {cells} cells", at, ends, {"color": style.GREY, "linestyle": dashes}))
    return Panel("spectrum", Axis("wavenumber [1/m]"), of, lines, log_x=True, log_y=True)


NOT_SELF_AFFINE = "no self-affine range was found"


def describe_surface(
    job: Job, heights: Array, remarks: list[str], shortest: float | None, picture: Path
) -> Iterator[str]:
    """Draw the picture of a surface and yield sentences on its heights [m], shape (ny, nx). `remarks` are sentences on
    how the heights were made, `shortest` [m] is the shortest wave of a measured surface, else None. Only the root rank
    may call this function. Raises InputError and RunError."""
    from ..physics.roughness import surface_statistics  # slow to import, and not for fits

    if picture.suffix[1:] not in style.MARKED:
        raise InputError(f"--out must end in .{', .'.join(style.MARKED)}, got {str(picture)!r}")
    found, part, measured = surface_statistics(heights, job.grid.size), job.surface[0], None
    lines = []
    whole = map_files.read_map(part) if isinstance(part, Topography) and len(job.surface) == 1 else None
    if isinstance(part, Topography) and whole and not whole.is_line:  # at its own points, its edges joined smoothly
        prepared = prepare(part, job.grid, whole)
        (ny, nx), (lx, ly) = prepared.cut.shape, prepared.size
        treated = measured_maps.treat(prepared.cut, part.detrend, "smooth")
        measured = surface_statistics(treated.heights, prepared.size)
        lines = [f"size           {quantity(lx, 'm', 5)} x {quantity(ly, 'm', 5)}", f"points         {nx} x {ny}"]
        lines.append(f"pixel          {quantity(lx / nx, 'm', 4)} x {quantity(ly / ny, 'm', 4)}")
        lines.append(f"missing        {per_cent(float(np.isnan(prepared.cut).mean()))} of its points")
    with files.writing(picture):
        draw_surface(Sketch(heights, job.grid.size, found, measured), picture)
    yield from (*lines, *remarks)
    own = measured or found  # a measured map at its own points, which no mirror has made twice as long
    *heights_and_slopes, (name, hurst) = list_statistics(replace(found, hurst=own.hurst, hurst_error=own.hurst_error))
    yield from (f"{one:15}{text}" for one, text in heights_and_slopes)
    longest, two_cells = job.grid.longest_side, 2.0 * job.grid.longest_cell
    yield f"spectrum       waves of {quantity(longest, 'm', 4)} to {quantity(two_cells, 'm', 4)}"
    yield f"{name:15}{hurst}"
    if shortest is not None:
        yield f"shortest wave  {quantity(shortest, 'm', 4)}, {shortest / job.grid.longest_cell:.3g} cells"
    yield f"picture: {picture}"


def list_statistics(found: Statistics) -> list[tuple[str, str]]:
    """Return the names and values of statistics of a surface as text."""
    return [
        ("rms height", quantity(found.rms_height, "m", 4)),
        ("rms slope", f"{found.rms_slope:.4g}"),
        ("rms curvature", f"{found.rms_curvature:.4g} 1/m"),
        ("Nayak", f"{found.nayak:.4g}"),
        ("Hurst", NOT_SELF_AFFINE if np.isnan(found.hurst) else with_error(found.hurst, found.hurst_error)),
    ]


# -- jobs from measured maps -------------------------------------------------------------------------------------------

JOBS = (".yaml", ".yml", ".json", "")  # suffixes of jobs; files with other suffixes are measured maps
MANY_POINTS = 2**20  # tuning: largest number of points in a job to start from
UNSAID = ("give unit", "give size")  # parts of messages about maps without unit or size
OF_POSITIONS = "units: {xy: UNIT"  # part of messages about maps that give their size without its unit
HOW = "on the command line: --set surface.unit=um"
HOW_SIZE = f"{HOW} --set surface.size=[1e-3,1e-3]"
ACCURACIES = (0.01, 0.02, 0.05, 0.1, 0.2)  # tuning: a job to start from gets the first one possible
LOAD = {"pressure": 1.0e5}


def is_map(path: Path) -> bool:
    """Return True if the path names a measured map, not a job."""
    return path.suffix.lower() not in JOBS


def load_map(path: Path, overrides: Sequence[str]) -> Job:
    """Return a job whose surface is a whole measured map, on the points of the map, with the overrides applied. Raises
    InputError."""
    try:
        return mesh.load(_job_of(str(path)), overrides)
    except InputError as error:
        if not any(text in str(error) for text in UNSAID):
            raise
        raise InputError(f"{error}; {HOW if OF_POSITIONS in str(error) else HOW_SIZE}") from None


def start_job(job: Job, path: Path, target: Path | None) -> Iterator[str]:
    """Make a job from a measured map that a user can change and run; yield lines of text about it.

    The job has at most MANY_POINTS points. It is written to the file `target`; without `target` its text is yielded.
    Raises InputError if the file cannot be written.
    """
    directory, grid = (target or Path("job.yaml")).absolute().parent, job.grid
    found = _job_of(os.path.relpath(path, directory))
    found["surface"] |= {key: value for key, value in plain_data(job.surface[0]).items() if key != "path"}
    found["surface"].setdefault("periodic", "smooth")
    coarser = math.ceil(math.sqrt(grid.nx * grid.ny / MANY_POINTS))
    found["grid"] = {"points": [grid.nx // coarser, grid.ny // coarser], "size": list(grid.size)}
    found["history"].append({"name": "slide", **LOAD, "velocity": 0.1, "distance": float(f"{grid.lx / 4:.3g}")})
    accuracy, why = _accuracy(job, found | {"surface": found["surface"] | {"path": str(path)}})
    text = yaml_text.dump(found | {"numerics": {"accuracy": accuracy}}).rstrip() + f"{why}\n"
    if target is None:
        yield f"\na job to start from (--job FILE writes it to a file):\n\n{text.rstrip()}"
        return
    with files.writing(target):
        files.replace_file(target, text)
    yield f"job: {target}"


def _accuracy(job: Job, data: dict[str, Any]) -> tuple[Any, str]:
    """Return the accuracy of `job` if given, else the accuracy that the points of the job `data` can keep, and a
    comment."""
    accuracy = job.numerics.accuracy
    if "accuracy" in job.numerics.model_fields_set:
        return accuracy, ""
    try:
        whole = mesh.load(data)
        kept = [a for a in ACCURACIES if all(map(le, mesh.points_for(whole, a), whole.grid.points))]
    except InputError:  # heights without a shortest wave
        return accuracy, ""
    return (kept[0], "  # estimate for these points") if kept else (accuracy, "  # needs more points")


def _job_of(path: str) -> dict[str, Any]:
    return {
        "title": Path(path).name,
        "grid": {"points": "from surface", "size": "from surface"},
        "surface": {"shape": "topography", "path": path},
        "material": {"include": "synthetic_tyre"},
        "history": [{"name": "press", **LOAD, "duration": 1.0e-3}],
        "output": {"fields": ["pressure", "gap"], "every": 64},
    }


# -- files of fitted materials -----------------------------------------------------------------------------------------

COLORS_OF_MODULI = (style.BLUE, style.RED)  # colours of storage and loss moduli
SOLID, DOTS = {"color": "k"}, {"color": "k", "marker": "o", "linestyle": "none", "mfc": "none"}
POINTS = 400  # number of points of a line


def refuse_foreign(target: Path) -> None:
    """Raise InputError for an existing file that `parcontact fit` did not write."""
    if target.suffix not in (".yaml", ".yml"):
        raise InputError(f"--out must end in .yaml, got {str(target)!r}")
    try:
        if target.exists() and not target.read_text(errors="replace").startswith(TITLE):
            raise InputError(f"{target} exists and was not written by parcontact fit; choose another --out")
    except OSError as error:
        raise InputError(f"{target} cannot be read: {error}") from error


def write_compound(compound: Compound, target: Path, job_band: tuple[float, float] | None) -> Iterator[str]:
    """Write the file of a material and its picture, and yield messages: the comments of the file, both paths, and
    warnings about the fit. `job_band` is the range of frequencies [Hz] that a job excites; a warning says if it reaches
    beyond the measured frequencies. Raises InputError."""
    text, picture = compound.text(), target.with_suffix(".png")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        files.replace_file(target, text)
        draw_compound(compound, picture, job_band)
    except OSError as error:
        wrong = files.without_mark(Path(error.filename or target))
        raise InputError(f"{wrong} cannot be written: {files.reason(error)}") from error
    yield from (line.removeprefix("# ") for line in text.splitlines() if line.startswith("#"))
    yield f"material file: {target}, picture: {picture}"
    yield from (f"warning: {text}" for text in compound.doubts())
    if job_band:
        low, high = compound.material()["band"]
        for ratio, side in ((low / job_band[0], "below"), (job_band[1] / high, "above")):
            if ratio > 1.0:
                beyond = f"{math.log10(ratio):.1f} decades {side} the measured band"
                yield f"warning: the job's frequencies reach {beyond}"


def draw_compound(compound: Compound, path: Path, job_band: tuple[float, float] | None = None) -> None:
    """Write the picture of a fitted material as png, with the range `job_band` [Hz] of a job shaded. Raises OSError."""
    shades = [Shade("frequencies of the job", *job_band)] if job_band else []
    panels = [replace(panel, shades=shades) for panel in _moduli(compound)]
    branches = Line("", compound.series.times, compound.series.moduli, DOTS)
    axes = Axis("relaxation time", "s"), Axis("shear modulus\nof the branch", "Pa")
    panels.append(Panel("branches", *axes, [branches], log_x=True, log_y=True))
    with style.drawing():
        style.save_figure(picture("", [[*panels, *_shift(compound)]]), path)


def _reduced(compound: Compound) -> Iterator[tuple[Array, list[Array]]]:
    """Yield for each set the frequencies [rad/s] or times [s], and the moduli [Pa], at the reference temperature."""
    from ..rubber.series import log_factors, reduce_sets  # slow to import, and for fits only

    kind = compound.measured.kind
    for each in compound.measured.sets:
        shift, temperature = compound.shift, each.temperature
        logs = None if shift is None or temperature is None else log_factors(shift, [temperature])
        data = reduce_sets([each], kind, logs)
        yield data.at, np.split(data.moduli, 2) if kind == "frequency" else [data.moduli]


def _moduli(compound: Compound) -> list[Panel]:
    """Return the panels of measured moduli (Young's or shear) with the fit, and of their relative difference."""
    measured, sets = compound.measured, list(_reduced(compound))
    letter, kind, size = ("E", "Young's", 2.0 * (1.0 + compound.poisson)) if measured.tension else ("G", "shear", 1.0)
    frequency = measured.kind == "frequency"
    names = (f"{letter}'", f"{letter}''") if frequency else (f"{letter}(t)",)
    if measured.kind == "creep":
        names = ("1/D(t)" if measured.tension else "1/J(t)",)
    from_tangent = {"stor": (f" = {names[-1]} / tan δ", ""), "loss": ("", f" = {names[0]} tan δ")}
    notes = from_tangent.get(measured.derived, ("", ""))
    every = np.concatenate([at for at, _ in sets])
    line, unit = np.geomspace(every.min(), every.max(), POINTS), 2 * np.pi if frequency else 1.0

    def fitted(at: Array, k: int) -> Array:
        return np.asarray(compound.series.response(measured.kind, at)).reshape(len(names), -1)[k]

    top, bottom = list[Line](), [Line("", every / unit, np.zeros(every.size), {"color": "k", "linewidth": 0.8})]
    for k, name in enumerate(names):
        at, values = np.concatenate([at for at, _ in sets]), np.concatenate([each[k] for _, each in sets])
        look = DOTS | {"color": COLORS_OF_MODULI[k], "marker": "os"[k], "markersize": 3}
        top.append(Line(f"{name}{notes[k]} measured", at / unit, size * values, look))
        top.append(Line(f"{name} fitted", line / unit, size * fitted(line, k), {"color": COLORS_OF_MODULI[k]}))
        bottom.append(Line("", at / unit, 100 * (fitted(at, k) / values - 1.0), look))
    reference = f" at {compound.shift.reference:g} °C" if compound.shift is not None else ""
    x = Axis(f"frequency{reference}", "Hz") if frequency else Axis(f"time{reference}", "s")
    modulus, misfit = Axis(f"{kind} modulus", "Pa"), Axis("fitted over\nmeasured - 1 [%]")
    return [Panel("moduli", x, modulus, top, log_x=True, log_y=True), Panel("misfit", x, misfit, bottom, log_x=True)]


def _shift(compound: Compound) -> Iterator[Panel]:
    """Yield the panel of the shift over temperature, if it is known."""
    temperatures, shift = compound.measured.temperatures, compound.shift
    if shift is None or not temperatures:
        return
    drawn = (np.linspace(min(temperatures), max(temperatures), POINTS), SOLID), (np.array(temperatures), DOTS)
    lines = [Line("", at, np.array([shift.log_factor(float(t)) for t in at]), look) for at, look in drawn]
    yield Panel("shift", Axis("temperature", "°C"), Axis("log10 of the shift factor"), lines, bottom=False)
