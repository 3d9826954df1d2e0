"""One chapter for each output directory: of a run, a friction curve, a sweep or a study, or of several of these."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from ..errors import InputError
from ..job import Job
from ..job.resolved import RESOLVED, STEADY_RESOLVED
from ..plotting import plots
from ..plotting.charts import Series
from ..storage import measures
from . import asked, budget, log, material, origin, results, road
from .parts import Chapter, Section, of_chart, of_file

KINDS = {  # by the table that each of them has
    "measures.csv": ("run", results.of_run),
    "steady.csv": ("friction curve", results.of_curve),
    "sweep.csv": ("sweep", results.of_sweep),
    "study.csv": ("study", results.of_study),
}
JOBS = {RESOLVED: "job.yaml", STEADY_RESOLVED: "steady.job.yaml", "study.resolved.yaml": "study.job.yaml"}
TABLES = (
    "measures.csv",
    "theory.csv",
    "steady.csv",
    "steady_waves.csv",
    "steady_theory.csv",
    "sweep.csv",
    "sweep_mean.csv",
    "study.csv",
)


def chapter(directory: Path) -> Chapter:
    """All about a directory. Raises InputError where it holds no results."""
    there = [name for name in KINDS if (directory / name).is_file()]
    if not there:
        raise InputError(f"{directory} holds no results: it has none of {', '.join(KINDS)}")
    sections = [KINDS[name][1](directory) for name in there]
    found, title = log.read(directory), ""
    if resolved := _resolved(directory):
        job, complete = asked.read(resolved)
        title = job.title
        sections += [asked.section(job, resolved.with_name(JOBS[resolved.name])), material.section(job)]
        sections += [road.section(job), *_costs(directory, job, found), origin.warnings(job, complete, found)]
    sections += [origin.section(directory, found), origin.to_cite(), _data(directory)]
    kinds = " and ".join(KINDS[name][0] for name in there)
    return Chapter(title or directory.absolute().name, directory, kinds, [one for one in sections if not one.empty])


def together(directories: Sequence[Path]) -> Iterator[Chapter]:
    """What several directories have in common, in one picture each."""
    if len(directories) > 1:
        shared = [chart for chart in plots.compared_charts(directories) if len({_run(one) for one in chart.series}) > 1]
        if shared:
            yield Chapter("Comparison", Path(), "", [Section("Together", pictures=[of_chart(one) for one in shared])])


def _run(series: Series) -> object:
    """What tells the lines of one directory from those of others: their colour."""
    return series.look["color"]


def _resolved(directory: Path) -> Path | None:
    """The job of a directory with every default: of a sweep that of its first case."""
    paths = [*(directory / name for name in JOBS), *sorted(directory.glob(f"cases/*/{RESOLVED}"))]
    return next((path for path in paths if path.is_file()), None)


def _costs(directory: Path, job: Job, found: log.Log) -> Iterator[Section]:
    """The error budget and the cost of a run, or else of a curve."""
    for name, budget_of in (("measures.csv", budget.of_run), ("steady.csv", budget.of_curve)):
        if (directory / name).is_file():
            columns = measures.read(directory / name)
            yield budget_of(columns, found.estimates, job.numerics.accuracy)
            yield origin.cost(columns, found)
            return


def _data(directory: Path) -> Section:
    data = [of_file(directory / name) for name in TABLES if (directory / name).is_file()]
    return Section("Data", ["The tables, in SI units and with all digits, are inside this file:"], downloads=data)
