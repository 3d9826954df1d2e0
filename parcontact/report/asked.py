"""The section about what was asked: the job with its units, every default filled in."""

from pathlib import Path

from .. import job as jobs
from ..errors import InputError
from ..job import Job
from ..job.resolved import shown_job
from ..job.sections import listing
from .parts import Section, Table

ELSEWHERE = ("output.directory", "material.branches", "material.band")  # told by other sections


def read(resolved: Path) -> tuple[Job, bool]:
    """The job that an output directory was made by, and whether all of it can still be read: its files may be gone."""
    try:
        return jobs.load(resolved), True
    except InputError:
        return shown_job(resolved), False


def section(job: Job, given: Path) -> Section:
    """A table of all keys, and the job file as it was given, if it is there."""
    rows = [row for row in listing.rows(job) if not row[0].startswith(ELSEWHERE)]
    texts = [("the job file as it was given", given.read_text(errors="replace"))] if given.is_file() else []
    return Section("What was asked", tables=[Table(("key", "value", "unit"), rows)], texts=texts)
