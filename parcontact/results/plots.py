"""Pictures of runs, also unfinished ones, and of friction curves: charts, and maps of one instant.

The job determines the panels: friction if the surface slides, energies if they were requested, curves over the load if
all stages are single solves, pressures along a line with Hertz's for a sphere."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from .. import printed
from ..errors import InputError
from ..files import hdf5
from ..job.listing import answers
from ..job.reading import CASES
from . import band_charts, charts, histories, maps, style, theory_table
from .charts import Chart, PlottedRun
from .results import KINDS, Results, read_cases, swept_keys

PANELS = ("friction", "loop", "area", "approach", "gap", "pressure", "load", "loss", "phase", "energy")
FAILED_CASES = 3  # most failed cases that a picture names


@dataclass(frozen=True)
class PlotOptions:
    """Options of a picture; '' and () mean: chosen by the contents of the directories. `out` is a file, `at` a step or
    a time [s] of the maps."""

    format: str = ""
    panels: Sequence[str] = ()
    over: str = ""
    log: Sequence[str] = ()
    compare: bool = False
    movie: str = ""
    at: str | None = None
    out: Path | None = None

    def __post_init__(self) -> None:
        known = *PANELS, *(key for keys in answers("pictures", "KEYS") for key in keys), "steady", "maps"
        if unknown := [name for name in self.panels if name not in known]:
            raise InputError(f"--panels: there is no {unknown[0]!r}; choose from {', '.join(known)}")
        if unknown := [name for name in self.log if name not in ("x", "y", "none")]:
            raise InputError(f"--log: there is no axis {unknown[0]!r}; give x, y, x,y or none")
        if self.at and (self.movie or self.compare):
            raise InputError("--at chooses the maps of one picture; leave it out with --movie or --compare")

    def wants(self, key: str) -> bool:
        return not self.panels or key in self.panels

    def choose(self, found: Sequence[Chart]) -> list[Chart]:
        """Return the requested charts in the requested order."""
        return [chart for name in self.panels for chart in found if chart.key == name] if self.panels else list(found)

    def group(self, found: Sequence[Chart]) -> list[list[style.Panel]]:
        """Return the panels of a curve, and those of its bands."""
        bands = [chart for chart in found if chart.key.startswith("bands")]
        return [self.to_panels(part) for part in ([one for one in found if one not in bands], bands)]

    def to_panels(self, found: Sequence[Chart]) -> list[style.Panel]:
        return [partial(charts.draw, chart, log=self.log) for chart in found]


def plot(directories: Sequence[Path], options: PlotOptions = PlotOptions()) -> list[Path]:
    """Draw each directory, or compare all in one picture; returns the paths of the pictures.

    Raises InputError if there is nothing to draw.
    """
    if options.out and len(directories) > 1 and not options.compare:
        raise InputError("--out names one picture: give one directory, or --compare several in one")
    with style.drawing():
        if options.movie:
            return [path for one in directories for path in maps.write_movie(one, options.movie, options.out)]
        if options.compare:
            return [_save(_draw_comparison(directories, options), Path("comparison"), options)]
        return [_save(_draw_directory(directory, options), directory / "picture", options) for directory in directories]


def draw_steady(table: Path) -> Path:
    """Draw steady.csv into its directory; returns the path of the picture."""
    with style.drawing():
        panels = PlotOptions().group(band_charts.chart_steady(table.parent))
        title = "\n".join([band_charts.steady_title(table.parent), *_name_missing(table.parent)])
        return _save(style.figure_of(title, panels), table.with_suffix(""))


def _name_missing(directory: Path) -> list[str]:
    """Return lines on lost points of a curve and on failed cases of a sweep, which a picture lacks."""
    found = [Results(directory).lost, *Results(directory).failed_cases(FAILED_CASES)]
    return [text for text in found if text]


def _save(figure: Figure, stem: Path, options: PlotOptions = PlotOptions()) -> Path:
    target = options.out or stem.with_name(f"{stem.name}.{options.format or 'png'}")
    kind = options.format or target.suffix.lstrip(".")
    if kind not in style.MARKED:
        raise InputError(f"{target} must end in .{', .'.join(style.MARKED)}; or give --format")
    try:
        return style.save_figure(figure, target, kind)
    except OSError as error:
        raise InputError(f"cannot write {target}: {hdf5.reason(error)}") from error


def _draw_directory(directory: Path, options: PlotOptions) -> Figure:
    has_run, has_curve, has_sweep = (kind in Results(directory).kinds for kind in ("run", "curve", "sweep"))
    groups: list[Sequence[style.Panel]] = []
    titles, fields = list[str](), list[style.Panel]()
    if has_run:
        run = PlottedRun(directory)
        found = run.job.title or directory.absolute().name
        titles.append(found if run.curves else f"{found}\n{histories.describe_solve(run)}")
        groups.append(options.to_panels(options.choose(histories.chart_histories(run, options.over))))
        if not options.panels:
            groups.append(options.to_panels(band_charts.chart_slips(run)))
    elif options.at:
        raise InputError(f"--at {options.at}: {directory} has no run, and therefore no maps")
    if has_curve and options.wants("steady"):
        titles.append(band_charts.steady_title(directory))
        groups += options.group(band_charts.chart_steady(directory, options.over))
    if has_run and options.wants("maps"):
        found_maps, fields = maps.map_panels(run, options.at or "")
        groups += found_maps
    if has_sweep:
        titles.append(getattr(Results(directory, "sweep").job, "title", "") or directory.absolute().name)
        groups.append(options.to_panels(options.choose(band_charts.chart_sweep(directory))))
    if not (has_run or has_curve or has_sweep):
        if not directory.exists():
            raise InputError(f"{directory} is not a directory")
        lacking = f"it has neither {KINDS['run']} nor {KINDS['curve']}{_suggest(directory)}"
        raise InputError(f"{directory} has neither a run nor a friction curve: {lacking}")
    if options.panels and not any((*groups, fields)):
        raise InputError(f"{directory} has none of the panels {', '.join(options.panels)}")
    lines = *titles[:1], theory_table.describe_settings(directory), *_name_missing(directory)
    return style.figure_of("\n".join(filter(None, lines)), groups, fields)


def _suggest(path: Path) -> str:
    """Return a suggestion: the first directory below with results, or the output directory of a job file."""
    if path.is_file():
        return "; give the output directory of a run, such as out/job"
    found = [
        table.parent
        for name in (KINDS["run"], KINDS["curve"], KINDS["sweep"])
        for table in sorted(path.glob(f"*/{name}"))
    ]
    return f"; did you mean {found[0]}?" if found else ""


def _draw_comparison(directories: Sequence[Path], options: PlotOptions) -> Figure:
    """Draw the lines of all directories in one picture."""
    for directory in directories:
        if not _find_charts(directory, options):
            raise InputError(f"{directory} has nothing to compare")
    lost = zip(name_directories(directories), (Results(one).lost for one in directories), strict=True)
    title = "\n".join(dict.fromkeys(f"{name}: {text}" for name, text in lost if text))
    return style.figure_of(title, options.group(compare_charts(directories, options)))


def compare_charts(directories: Sequence[Path], options: PlotOptions = PlotOptions(), least: int = 1) -> list[Chart]:
    """Return the charts that at least `least` directories have, with the lines of all."""
    found = [_find_charts(directory, options) for directory in directories]
    return charts.compare([each for each in zip(name_directories(directories), found, strict=True) if each[1]], least)


def _find_charts(directory: Path, options: PlotOptions) -> list[Chart]:
    found: list[Chart] = []
    if (directory / KINDS["run"]).is_file():
        found += options.choose(histories.chart_histories(PlottedRun(directory), options.over))
    if (directory / KINDS["curve"]).is_file() and options.wants("steady"):
        found += band_charts.chart_steady(directory, options.over)
    return found


def name_directories(directories: Sequence[Path]) -> list[str]:
    """Return labels of directories: the swept keys of cases of one sweep, else the last parts of paths that differ."""
    if named := _name_cases(directories):
        return named
    paths = [directory.absolute() for directory in directories]
    above = os.path.commonpath([path.parent for path in paths])
    names = [path.name for path in paths]
    return names if len(set(names)) == len(names) else [str(path.relative_to(above)) for path in paths]


def _name_cases(directories: Sequence[Path]) -> list[str]:
    """Return the keys in which cases of one sweep differ, such as `velocity 1 m/s, seed 2`; [] for other
    directories."""
    paths = [directory.absolute() for directory in directories]
    table = paths[0].parent.parent / KINDS["sweep"] if paths else Path()
    if {path.parent for path in paths} != {table.parent / CASES} or not table.is_file():
        return []
    known = {f"{int(row['case']):03d}": row for row in read_cases(table)}
    rows = [known[path.name] for path in paths if path.name in known]
    differing = [key for key in swept_keys(rows) if len({row[key] for row in rows}) > 1]
    names = [", ".join(_name_value(key.split(".")[-1], row[key]) for key in differing) for row in rows]
    return names if len(set(names)) == len(paths) and all(names) else []


def _name_value(key: str, value: Any) -> str:
    """Return a key of a sweep and its value as text, such as `velocity 100 mm/s`."""
    shown = printed.quantity(value, band_charts.UNITS.get(key, ""), 4) if isinstance(value, float) else value
    return f"{key} {shown}"
