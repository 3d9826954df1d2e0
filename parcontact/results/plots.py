"""Pictures of runs, also unfinished ones, and of friction curves: panels, and maps of one instant.

The job determines the panels. There is friction if the surface slides, and there are energies if they were requested.
Curves are drawn against the load if no stage has a duration. For a sphere, pressures along a line are drawn with
Hertz's solution.
"""

import itertools
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from matplotlib.figure import Figure

from .. import printed
from ..errors import InputError
from ..files import files, outputs
from ..job.listing import answers, unit_of_path
from ..job.reading import CASES
from . import band_charts, info, maps, plotted_run, style
from .panels import Axis, Line, Panel, entry, offered, picture
from .plotted_run import PlottedRun
from .results import Results, read_cases, swept_keys

PANELS = ("friction", "loop", "area", "approach", "gap", "pressure", "load", "loss", "phase", "energy")
MARK_EVERY = 0.15  # distance of the marks of a line of many points, over the diagonal of a panel
PALEST = 0.75  # share of white in the bars of the longest waves in a comparison
APART = 10.0  # ratio of the longest to the shortest time of runs above which a common axis of time hides the shortest
FAILED_CASES = 3  # most failed cases that a picture names


@dataclass(frozen=True)
class PlotOptions:
    """Options of a picture, named as those of `parcontact plot`. Options that are '' or () are chosen by the contents
    of the directories.

    `at` chooses the saved maps after a step (a whole number) or near a time [s]; `out` is the file of the picture.
    """

    format: str = ""
    panels: Sequence[str] = ()
    over: str = ""
    log: Sequence[str] = ()
    compare: bool = False
    movie: str = ""
    at: str | None = None
    out: Path | None = None

    def __post_init__(self) -> None:
        others = [one.key for one in offered("RUN_PANELS")]
        known = *PANELS, *others, *(key for keys in answers("pictures", "KEYS") for key in keys), "steady", "maps"
        if unknown := [name for name in self.panels if name not in known]:
            raise InputError(f"--panels: there is no {unknown[0]!r}; choose from {', '.join(known)}")
        if unknown := [name for name in self.log if name not in ("x", "y", "none")]:
            raise InputError(f"--log: there is no axis {unknown[0]!r}; give x, y, x,y or none")
        if self.at and (self.movie or self.compare):
            raise InputError("--at chooses the maps of one picture; leave it out with --movie or --compare")

    def wants(self, key: str) -> bool:
        return not self.panels or key in self.panels

    def choose(self, found: Sequence[Panel]) -> list[Panel]:
        """Return the requested panels out of `found`, in the requested order."""
        return [panel for name in self.panels for panel in found if panel.key == name] if self.panels else list(found)


def group(found: Sequence[Panel]) -> list[list[Panel]]:
    """Return two groups: the panels of a curve, and the panels of its bands."""
    return [[panel for panel in found if panel.key.startswith("bands") == which] for which in (False, True)]


def plot(directories: Sequence[Path], options: PlotOptions = PlotOptions()) -> list[Path]:
    """Draw each directory, or compare all directories in one picture; returns the paths of the pictures.

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
    """Draw a table steady.csv into its directory; returns the path of the picture."""
    with style.drawing():
        title = "\n".join([band_charts.steady_title(table.parent), *_name_missing(table.parent)])
        return _save(picture(title, group(band_charts.panels_of_curve(table.parent))), table.with_suffix(""))


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
        raise InputError(f"cannot write {target}: {files.reason(error)}") from error


def _draw_directory(directory: Path, options: PlotOptions) -> Figure:
    has_run, has_curve, has_sweep = (kind in Results(directory).kinds for kind in ("run", "steady", "sweep"))
    groups: list[Sequence[Panel]] = []
    titles, fields = list[str](), list[Panel]()
    if has_run:
        run = PlottedRun(directory)
        found = run.job.title or directory.absolute().name
        titles.append(found if run.curves else f"{found}\n{plotted_run.describe_solve(run)}")
        groups.append(options.choose(plotted_run.panels_of_run(run, options.over)))
        if not options.panels:
            groups.append(band_charts.panels_of_slips(run))
    elif options.at:
        raise InputError(f"--at {options.at}: {directory} has no run, and therefore no maps")
    if has_curve and options.wants("steady"):
        titles.append(band_charts.steady_title(directory))
        groups += group(band_charts.panels_of_curve(directory, options.over))
    if has_run and options.wants("maps"):
        found_maps, fields = maps.map_panels(run, options.at or "")
        groups += found_maps
    if has_sweep:
        titles.append(getattr(Results(directory, "sweep").job, "title", "") or directory.absolute().name)
        groups.append(options.choose(band_charts.panels_of_sweep(directory)))
    if not (has_run or has_curve or has_sweep):
        if not directory.exists():
            raise InputError(f"{directory} is not a directory")
        lacking = f"it has neither {outputs.RUN.table} nor {outputs.STEADY.table}{_suggest(directory)}"
        raise InputError(f"{directory} has neither a run nor a friction curve: {lacking}")
    if options.panels and not any((*groups, fields)):
        raise InputError(_describe_lack(directory, options))
    lines = *titles[:1], info.describe_settings(directory), *_name_missing(directory)
    return picture("\n".join(filter(None, lines)), groups, fields, options.log)


def _describe_lack(directory: Path, options: PlotOptions) -> str:
    """Return why a directory has no panel to draw, and what can be drawn."""
    kinds = Results(directory).kinds
    if options.compare and "sweep" in kinds:
        return f"{directory} is a sweep, which has nothing to compare; give its cases, {directory / CASES}/*"
    if not options.panels:
        return f"{directory} has nothing to compare: it has neither a run of several rows nor a friction curve"
    there = [one.key for one in plotted_run.panels_of_run(PlottedRun(directory))] if "run" in kinds else []
    there += ["steady"] * ("steady" in kinds) + ["maps"] * (directory / outputs.RUN.maps).is_file()
    there += [one.key for one in band_charts.panels_of_sweep(directory)] if "sweep" in kinds else []
    has = f"; it has {', '.join(dict.fromkeys(there))}" if there else ""
    return f"{directory} has none of the panels {', '.join(options.panels)}{has}"


def _suggest(path: Path) -> str:
    """Return a suggestion: the first directory below with results, or the output directory of a job file."""
    if path.is_file():
        return "; give the output directory of a run, such as out/job"
    tables = (sorted(path.glob(f"*/{each.table}")) for each in (outputs.RUN, outputs.STEADY, outputs.SWEEP))
    found = [table.parent for there in tables for table in there]
    return f"; did you mean {found[0]}?" if found else ""


def _draw_comparison(directories: Sequence[Path], options: PlotOptions) -> Figure:
    """Draw the lines of all directories in one picture."""
    found = _find_common(directories, options)
    if [] in found:
        raise InputError(_describe_lack(directories[found.index([])], options))
    names = name_directories(directories)
    lost = zip(names, (Results(one).lost for one in directories), strict=True)
    title = "\n".join(dict.fromkeys(f"{name}: {text}" for name, text in lost if text))
    return picture(title, group(compare(list(zip(names, found, strict=True)))), log=options.log)


def compare_panels(directories: Sequence[Path]) -> list[Panel]:
    """Return the panels that at least two directories have, each with the lines of all directories."""
    pairs = zip(name_directories(directories), _find_common(directories, PlotOptions()), strict=True)
    return compare([pair for pair in pairs if pair[1]], 2)


def _find_common(directories: Sequence[Path], options: PlotOptions) -> list[list[Panel]]:
    """Return the panels of each directory. Runs that slide equally far in very different times are drawn over the
    distance, if the options do not choose: over time the fastest runs would be invisible."""
    runs = [Results(one, "run").table for one in directories if (one / outputs.RUN.table).is_file()]
    over = options.over
    if runs and not over:
        times, ways = ([max(table[name], default=0.0) for table in runs] for name in ("time", "distance"))
        if max(times) > APART * min(times) and max(ways) < APART * min(ways):
            over = "distance"
    curves = [one for one in directories if (one / outputs.STEADY.table).is_file()]
    differing = band_charts.find_differing(curves) if options.wants("steady") else []
    return [_find_panels(one, options, over, differing) for one in directories]


def _find_panels(directory: Path, options: PlotOptions, over: str, differing: Sequence[str]) -> list[Panel]:
    found: list[Panel] = []
    if (directory / outputs.RUN.table).is_file():
        found += options.choose(plotted_run.panels_of_run(PlottedRun(directory), over))
    if (directory / outputs.STEADY.table).is_file() and options.wants("steady"):
        found += band_charts.panels_of_curve(directory, options.over, differing)
    return found


def name_directories(directories: Sequence[Path]) -> list[str]:
    """Return a label for each directory: the swept keys for cases of one sweep, else the parts of paths that differ."""
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
    table = paths[0].parent.parent / outputs.SWEEP.table if paths else Path()
    if {path.parent for path in paths} != {table.parent / CASES} or not table.is_file():
        return []
    known = {f"{int(row['case']):03d}": row for row in read_cases(table)}
    rows = [known[path.name] for path in paths if path.name in known]
    differing = [key for key in swept_keys(rows) if len({row[key] for row in rows}) > 1]
    names = []
    for row in rows:
        pairs = ((key.split(".")[-1], row[key]) for key in differing)
        shown = (
            f"{key} {printed.quantity(x, unit_of_path(key), 4) if isinstance(x, float) else x}" for key, x in pairs
        )
        names.append(", ".join(shown))
    return names if len(set(names)) == len(paths) and all(names) else []


def compare(runs: Sequence[tuple[str, Sequence[Panel]]], least: int = 1) -> list[Panel]:
    """Return the panels that several runs have in common, with the lines of all runs; `least` is the number of runs
    that must have a panel.

    Each run has one colour. Curves of one run are distinguished by symbols, and bars of one run by shades of its
    colour. If no run has several lines in a panel, runs are distinguished by colour and dashes.
    """
    found: dict[tuple[str, Axis, Axis], list[tuple[int, Panel]]] = {}
    for number, (_, panels) in enumerate(runs):
        for panel in panels:
            found.setdefault((panel.key, panel.x, panel.y), []).append((number, panel))
    names = [name for name, _ in runs]
    lonely = all(len(panel.series) == 1 for group in found.values() for _, panel in group)
    merge, joined = _merge_lonely if lonely else _merge, []
    for group in (group for group in found.values() if len(group) >= least):
        spikes, log_x = (all(getattr(panel, name) for _, panel in group) for name in ("spikes", "log_x"))
        plain = replace(group[0][1], shades=(), peak=False, edges=())
        joined.append(replace(plain, series=merge(group, names), spikes=spikes, log_x=log_x))
    return joined


def _merge_lonely(group: Sequence[tuple[int, Panel]], names: Sequence[str]) -> list[Line]:
    """Return the only line of each run, with the colour and the dashes of the run."""
    found = []
    for number, (one, *_) in ((number, panel.series) for number, panel in group):
        name = ", ".join(filter(None, (names[number], one.name)))
        found.append(replace(one, name=name, look=one.look | style.line(number, len(names))))
    return found


def _merge(group: Sequence[tuple[int, Panel]], names: Sequence[str]) -> list[Line]:
    """Return all lines of the runs in a panel, and entries of the legend for the runs and for the names of lines."""
    colors = style.colors(len(names))
    whole = [one for _, panel in group for one in panel.series]
    marked = dict.fromkeys(one.name for one in whole if one.name and one.x.size and one.stack is None)
    marks = dict(zip(marked, itertools.cycle(style.MARKERS), strict=False)) if len(marked) > 1 else {}
    entries = [entry(names[number], {"color": colors[number]}) for number, _ in group]
    for name, mark in marks.items():
        entries.append(entry(name, {"color": style.GREY, "marker": mark, "linestyle": "none"}))
    entries += {one.name: one for one in whole if not one.x.size}.values()
    for number, panel in group:
        bars = sum(one.stack is not None for one in panel.series)
        for k, one in enumerate(panel.series):
            look = one.look | {"color": colors[number]}
            if one.stack is not None:
                look["color"] = style.mix(colors[number], PALEST * (1.0 - (k + 1) / bars))
            elif one.name in marks:
                few = "marker" in one.look
                look |= {"linestyle": "-", "marker": marks[one.name], **({} if few else {"markevery": MARK_EVERY})}
            entries.append(replace(one, name="", look=look, stack=None if one.stack is None else number))
    return entries
