"""Chapters of a report, one per output directory with a run, a friction curve, a sweep or a study."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from .. import job as jobs
from ..capabilities import offers
from ..errors import InputError
from ..job import Job
from ..job.resolved import RESOLVED, STEADY_RESOLVED, shown_job
from ..job.sections import listing
from . import headline, log, material, origin, plots, result_sections, road_section
from .curve_tables import compared_table
from .page_parts import Chapter, ReportSection, ReportTable, draw_chart, embed_file
from .results import Results, swept_keys

KINDS = {  # kinds of results, by their table
    "measures.csv": ("run", result_sections.describe_run),
    "steady.csv": ("friction curve", result_sections.describe_curve),
    "sweep.csv": ("sweep", result_sections.describe_sweep),
    "study.csv": ("study", result_sections.describe_study),
}
JOBS = {RESOLVED: "job.yaml", STEADY_RESOLVED: "steady.job.yaml", "study.resolved.yaml": "study.job.yaml"}
MORE_TABLES = (
    *(name for names in offers("results", "DATA") for name in names),
    *("cycles.csv", "theory.csv", "steady_waves.csv", "steady_theory.csv", "bands.csv", "bands_theory.csv"),
    *("sweep_mean.csv", "sweep_curves.csv", "sweep_curves_mean.csv"),
)
ELSEWHERE = ("output.directory", "material.branches", "material.band")  # keys that are shown in other sections


def describe_directory(directory: Path) -> Chapter:
    """Return the chapter about a directory. Raises InputError if it has no results."""
    there = [name for name in KINDS if (directory / name).is_file()]
    if not there:
        raise InputError(f"{directory} has no results: it has none of {', '.join(KINDS)}")
    sections = [KINDS[name][1](directory) for name in there]
    if "steady.csv" in there:
        sections.insert(0, result_sections.describe_friction(directory))
    found, title, cited, places = (
        log.read_logs(directory),
        "",
        origin.list_citations(None),
        [f"{directory.absolute()}/"],
    )
    of_cases = (path for name in (RESOLVED, STEADY_RESOLVED) for path in sorted(directory.glob(f"cases/*/{name}")))
    jobs_there = [*(directory / name for name in JOBS), *of_cases]
    if resolved := next(
        (path for path in jobs_there if path.is_file()), None
    ):  # for a sweep, the job of its first case
        job, warnings = _read_job(resolved)
        title, places = job.title, [*_places(job), *places]
        asked = _describe_job(job, resolved.with_name(JOBS[resolved.name]))
        of_job = [asked, material.material_section(job), road_section.road_section(job)]
        if there == ["sweep.csv"]:
            of_job[0] = replace(asked, sentences=[_describe_swept(directory)])
            of_job = [replace(one, title=f"{one.title} of the first case") for one in of_job]
            warnings = log.warnings_of_cases(directory) or warnings
        sections += of_job
        if there[0] in ("measures.csv", "steady.csv"):
            sections += origin.costs(Results(directory, "run" if there[0] == "measures.csv" else "curve"), found, job)
        cited = origin.list_citations(job)
        sections.append(ReportSection("Warnings", found.warnings or warnings or ["There was no warning."]))
    data = [embed_file(directory / name) for name in (*KINDS, *MORE_TABLES) if (directory / name).is_file()]
    text = "The tables, in SI units and with all digits, are stored in this file:"
    sections += [origin.origin_section(directory, found), cited, ReportSection("Data", [text], downloads=data)]
    kinds = " and ".join(KINDS[name][0] for name in there)
    shown = [one.without(sorted(places, key=len, reverse=True)) for one in sections if one]
    here, there_is = Path.cwd(), directory.absolute()
    named = there_is.relative_to(here) if there_is.is_relative_to(here) else Path(there_is.name)
    return Chapter(title or there_is.name, named, kinds, shown, headline.find_headline(directory))


def compare_directories(directories: Sequence[Path]) -> Iterator[Chapter]:
    """Yield a chapter that compares several directories in common pictures, with one colour per directory."""
    if len(directories) > 1:
        shared = plots.compare_charts(directories, least=2)
        if shared:
            tables = compared_table(directories, plots.name_directories(directories))
            together = ReportSection("Together", tables=tables, pictures=[draw_chart(one) for one in shared])
            yield Chapter("Comparison", Path(), "", [together])


def _read_job(resolved: Path) -> tuple[Job, Sequence[str]]:
    """Return the job of an output directory and its warnings, which are omitted if its files no longer exist."""
    try:
        job = jobs.load(resolved)
        return job, job.warnings
    except InputError:
        return shown_job(resolved), ()


def _places(job: Job) -> list[str]:
    """Return the directories of this machine in a job, to be omitted in the report."""
    parts = [value for part in (*job.surface, job.material) for _, value in listing.items(part)]
    return [f"{path.parent}/" for path in (job.path, *parts) if isinstance(path, Path) and path.is_absolute()]


def _describe_swept(directory: Path) -> str:
    """Return a sentence on the swept keys and their values."""
    rows = Results(directory, "sweep").cases
    swept = {name: dict.fromkeys(str(row[name]) for row in rows) for name in swept_keys(rows)}
    values = "; ".join(f"{name} ({', '.join(found)})" for name, found in swept.items())
    return f"The sweep has {len(rows)} cases, with {values}."


def _describe_job(job: Job, given: Path) -> ReportSection:
    """Return a table of all keys with every default, and the original job file, if it exists."""
    rows = [row for row in listing.rows(job) if not row[0].startswith(ELSEWHERE)]
    texts = [("the original job file", given.read_text(errors="replace"))] if given.is_file() else []
    return ReportSection("Job", tables=[ReportTable(("key", "value", "unit"), rows)], texts=texts)
