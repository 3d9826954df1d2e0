"""Pictures of runs, finished or not, and of friction curves: what was measured, and the last saved maps.

Which panels there are follows from the job: friction if the surface slides, energies if they were asked for, curves
over the load if all stages are single solves, pressures along a line through a sphere beside Hertz's.
"""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from ..errors import InputError
from ..job.reading import CASES
from ..storage import files, hdf5
from ..summary import sweep_table, theory_settings
from . import charts, histories, layout, movie, steady, style, sweep
from .charts import Chart
from .maps import maps
from .run import Panel, Run

FORMATS = ("png", "pdf", "svg")
PANELS = ("friction", "area", "approach", "gap", "pressure", "load", "energy", "steady", "maps")


@dataclass(frozen=True)
class Options:
    """What is asked for beyond the directories; '' and () leave it to what they hold. `out` is a file, `at` a step
    or a time [s], whose maps are drawn."""

    format: str = ""
    panels: Sequence[str] = ()
    over: str = ""
    log: Sequence[str] = ()
    compare: bool = False
    movie: str = ""
    at: str | None = None
    out: Path | None = None


def plot(directories: Sequence[Path], options: Options = Options()) -> list[Path]:
    """Draw what is in each directory, or compare them in one picture; returns the pictures' paths.

    Raises InputError where there is nothing to draw.
    """
    if options.out and len(directories) > 1 and not options.compare:
        raise InputError("--out names one picture: give one directory, or --compare several in one")
    if unknown := [name for name in options.panels if name not in PANELS]:
        raise InputError(f"--panels: there is no {unknown[0]!r}; choose from {', '.join(PANELS)}")
    if unknown := [name for name in options.log if name not in ("x", "y", "none")]:
        raise InputError(f"--log: there is no axis {unknown[0]!r}; give x, y, x,y or none")
    if options.at and (options.movie or options.compare):
        raise InputError("--at chooses the maps of one picture, and goes with neither --movie nor --compare")
    with style.drawing():
        if options.movie:
            return [_movie(directory, options) for directory in directories]
        if options.compare:
            return [_save(_comparison(directories, options), Path("comparison"), options)]
        return [_save(_picture(directory, options), directory / "picture", options) for directory in directories]


def draw_steady(table: Path) -> Path:
    """Draw steady.csv alone, beside it; returns the picture's path."""
    with style.drawing():
        panels = [_steady(table.parent, Options())]
        figure = layout.figure_of(_wrapped(steady.title(table.parent)), panels, legend=True)
        return _save(figure, table.with_suffix(""), Options())


def _wrapped(title: str) -> str:
    return "\n".join(textwrap.wrap(title, layout.LINE))


def _movie(directory: Path, options: Options) -> Path:
    target = options.out or directory / f"{options.movie}.gif"
    if target.suffix != ".gif":
        raise InputError(f"--movie writes a GIF: --out must end in .gif, got {target}")
    return movie.make(directory, options.movie, target)


def _save(figure: Figure, stem: Path, options: Options) -> Path:
    target = options.out or stem.with_name(f"{stem.name}.{options.format or FORMATS[0]}")
    kind = options.format or target.suffix.lstrip(".")
    if kind not in FORMATS:
        raise InputError(f"{target}: pictures are {', '.join(FORMATS)}; say which with --format")
    try:
        with files.replaced(target, files.is_marked) as file:
            style.save(figure, file, kind)
    except OSError as error:
        raise InputError(f"cannot write {target}: {hdf5.reason(error)}") from error
    return target


def _picture(directory: Path, options: Options) -> Figure:
    """All that there is in a directory."""
    groups: list[Sequence[Panel]] = []
    title = directory.absolute().name
    if (directory / "measures.csv").is_file():
        run = Run(directory)
        title = run.job.title or title
        title = _wrapped(title) + ("" if run.curves else f"\n{histories.numbers(run)}")
        if options.over == "velocity" and not (directory / steady.TABLE).is_file():
            histories.refuse_one_velocity(run)
        found = _chosen(histories.charts(run, options.over), options)
        groups = [_panels(found, options), maps(run, options.at or "") if _wanted("maps", options) else []]
    elif options.at:
        raise InputError(f"--at {options.at}: {directory} holds no run, and so no maps of one")
    if (directory / steady.TABLE).is_file() and _wanted("steady", options):
        title = title if groups else _wrapped(steady.title(directory))
        groups.insert(1, _steady(directory, options))
    if (directory / sweep.TABLE).is_file():
        title = title if groups else _wrapped(sweep.title(directory) or title)
        groups += [_panels([chart], options) for chart in _chosen(sweep.charts(directory), options)]
    elif not groups:
        raise InputError(
            f"{directory} holds no run and no friction curve: it has no measures.csv and no {steady.TABLE}"
            f"{_instead(directory)}"
        )
    if options.panels and not any(groups):
        raise InputError(f"{directory} has none of the panels {', '.join(options.panels)}")
    alone = (directory / steady.TABLE).is_file() and len(groups) == 1
    return layout.figure_of("\n".join(filter(None, (title, theory_settings.describe(directory)))), groups, alone)


def _instead(path: Path) -> str:
    """Which directory may have been meant: the first below it that holds something, or that of a job file."""
    if path.is_file():
        return "; give the output directory of a run, as out/job"
    tables = ("measures.csv", steady.TABLE, sweep.TABLE)
    found = next((table.parent for name in tables for table in sorted(path.glob(f"*/{name}"))), None)
    return f"; did you mean {found}?" if found else ""


def _comparison(directories: Sequence[Path], options: Options) -> Figure:
    """The lines of all directories in one picture."""
    for directory in directories:
        if not _lines(directory, options):
            raise InputError(f"{directory} holds nothing to compare")
    return layout.figure_of("", [_panels(compared_charts(directories, options), options)], legend=True)


def compared_charts(directories: Sequence[Path], options: Options = Options()) -> list[Chart]:
    """Charts with the lines of all directories that have any."""
    found = [(name, _lines(path, options)) for name, path in zip(_names(directories), directories, strict=True)]
    return charts.compared([(name, lines) for name, lines in found if lines])


def _lines(directory: Path, options: Options) -> list[Chart]:
    lines: list[Chart] = []
    if (directory / "measures.csv").is_file():
        lines += _chosen(histories.charts(Run(directory), options.over), options)
    if (directory / steady.TABLE).is_file() and _wanted("steady", options):
        lines += steady.charts(directory, options.over)
    return lines


def _names(directories: Sequence[Path]) -> list[str]:
    """What tells directories apart: of cases of one sweep their keys, else the last parts of paths."""
    if named := _names_of_cases(directories):
        return named
    parts = [directory.absolute().parts for directory in directories]
    for count in range(1, max(map(len, parts), default=1) + 1):
        names = ["/".join(part[-count:]) for part in parts]
        if len(set(names)) == len(names):
            return names
    return [str(directory) for directory in directories]


def _names_of_cases(directories: Sequence[Path]) -> list[str]:
    """`velocity 0.1, seed 2`, the keys in which cases of one sweep differ; nothing if these are not such cases."""
    paths = [directory.absolute() for directory in directories]
    table = paths[0].parent.parent / sweep.TABLE if paths else Path()
    if {path.parent for path in paths} != {table.parent / CASES} or not table.is_file():
        return []
    known = {f"{int(row['case']):03d}": row for row in sweep_table.read(table)}
    if not all(path.name in known for path in paths):
        return []
    rows = [known[path.name] for path in paths]
    keys = list(rows[0])[1 : list(rows[0]).index("state")]
    differing = [key for key in keys if len({row[key] for row in rows}) > 1]
    names = [", ".join(f"{key.split('.')[-1]} {_short(row[key])}" for key in differing) for row in rows]
    return names if len(set(names)) == len(names) and all(names) else []


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _steady(directory: Path, options: Options) -> list[Panel]:
    return _panels(steady.charts(directory, options.over), options)


def _wanted(key: str, options: Options) -> bool:
    return not options.panels or key in options.panels


def _chosen(found: Sequence[Chart], options: Options) -> list[Chart]:
    """In the order in which they were asked for."""
    if not options.panels:
        return list(found)
    return [chart for name in options.panels for chart in found if chart.key == name]


def _panels(found: Sequence[Chart], options: Options) -> list[Panel]:
    return [partial(charts.draw, chart, log=options.log) for chart in found]
