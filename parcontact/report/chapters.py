"""One chapter for each output directory: of a run, a friction curve, a sweep or a study, or of several of these."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from .. import job as jobs
from ..errors import InputError
from ..job import Job
from ..job.resolved import RESOLVED, STEADY_RESOLVED, shown_job
from ..job.sections import listing
from ..plotting import plots
from ..summary import headline, sweep_table
from . import log, material, origin, result_sections, road_section
from .page_parts import Chapter, ReportSection, ReportTable, draw_chart, embed_file

KINDS = {  # by the table that each of them has
    "measures.csv": ("run", result_sections.describe_run),
    "steady.csv": ("friction curve", result_sections.describe_curve),
    "sweep.csv": ("sweep", result_sections.describe_sweep),
    "study.csv": ("study", result_sections.describe_study),
}
JOBS = {RESOLVED: "job.yaml", STEADY_RESOLVED: "steady.job.yaml", "study.resolved.yaml": "study.job.yaml"}
MORE_TABLES = (
    *("leak.csv", "theory.csv", "steady_waves.csv", "steady_theory.csv", "bands.csv", "bands_theory.csv"),
    *("sweep_mean.csv", "sweep_curves.csv", "sweep_curves_mean.csv"),
)
ELSEWHERE = ("output.directory", "material.branches", "material.band")  # keys that other sections show


def describe_directory(directory: Path) -> Chapter:
    """Tell all about a directory. Raises InputError where it holds no results."""
    there = [name for name in KINDS if (directory / name).is_file()]
    if not there:
        raise InputError(f"{directory} holds no results: it has none of {', '.join(KINDS)}")
    sections = [KINDS[name][1](directory) for name in there]
    found, title, cited, places = (
        log.read_logs(directory),
        "",
        origin.list_citations(None),
        [f"{directory.absolute()}/"],
    )
    of_cases = (path for name in (RESOLVED, STEADY_RESOLVED) for path in sorted(directory.glob(f"cases/*/{name}")))
    jobs_there = [*(directory / name for name in JOBS), *of_cases]
    if resolved := next((path for path in jobs_there if path.is_file()), None):  # of a sweep that of its first case
        job, warnings = _read_job(resolved)
        title, places = job.title, [*_places(job), *places]
        asked = _describe_job(job, resolved.with_name(JOBS[resolved.name]))
        of_job = [asked, material.material_section(job), road_section.road_section(job)]
        if there == ["sweep.csv"]:
            of_job[0] = replace(asked, sentences=[_describe_swept(directory)])
            of_job = [replace(one, title=f"{one.title} of the first case") for one in of_job]
        sections += of_job
        if there[0] in ("measures.csv", "steady.csv"):
            sections += origin.costs(directory / there[0], found, job)
        cited = origin.list_citations(job)
        sections.append(ReportSection("Warnings", found.warnings or warnings or ["There was no warning."]))
    data = [embed_file(directory / name) for name in (*KINDS, *MORE_TABLES) if (directory / name).is_file()]
    said = "The tables, in SI units and with all digits, are inside this file:"
    sections += [origin.origin_section(directory, found), cited, ReportSection("Data", [said], downloads=data)]
    kinds = " and ".join(KINDS[name][0] for name in there)
    shown = [one.without(sorted(places, key=len, reverse=True)) for one in sections if one]
    here, there_is = Path.cwd(), directory.absolute()
    named = there_is.relative_to(here) if there_is.is_relative_to(here) else Path(there_is.name)
    return Chapter(title or there_is.name, named, kinds, shown, headline.find_headline(directory))


def compare_directories(directories: Sequence[Path]) -> Iterator[Chapter]:
    """Yield what several directories have in common, in one picture each: lines of a directory have one colour."""
    if len(directories) > 1:
        found = plots.compare_charts(directories)
        shared = [chart for chart in found if len({one.look["color"] for one in chart.series}) > 1]
        if shared:
            yield Chapter(
                "Comparison", Path(), "", [ReportSection("Together", pictures=[draw_chart(one) for one in shared])]
            )


def _read_job(resolved: Path) -> tuple[Job, Sequence[str]]:
    """Return the job that an output directory was made by and its warnings; of a job whose files are gone none."""
    try:
        job = jobs.load(resolved)
        return job, job.warnings
    except InputError:
        return shown_job(resolved), ()


def _places(job: Job) -> list[str]:
    """Return the directories of this machine that a job names: who reads a report has others."""
    parts = [value for part in (*job.surface, job.material) for _, value in listing.items(part)]
    return [f"{path.parent}/" for path in (job.path, *parts) if isinstance(path, Path) and path.is_absolute()]


def _describe_swept(directory: Path) -> str:
    """Return what differs between the cases of a sweep."""
    rows = sweep_table.read_cases(directory / "sweep.csv")
    names = list(rows[0]) if rows else ["case", "state"]
    swept = {name: dict.fromkeys(str(row[name]) for row in rows) for name in names[1 : names.index("state")]}
    values = "; ".join(f"{name} ({', '.join(found)})" for name, found in swept.items())
    return f"There are {len(rows)} cases. They differ in {values}."


def _describe_job(job: Job, given: Path) -> ReportSection:
    """Return a table of all keys with every default, and the job file as it was given, if it is there."""
    rows = [row for row in listing.rows(job) if not row[0].startswith(ELSEWHERE)]
    texts = [("the job file as it was given", given.read_text(errors="replace"))] if given.is_file() else []
    return ReportSection("What was asked", tables=[ReportTable(("key", "value", "unit"), rows)], texts=texts)
