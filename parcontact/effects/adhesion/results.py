"""Results of adhesion in texts and tables: pull-offs (`pull_off`)."""

from collections.abc import Iterator

from ...job import Job
from ...printed import quantity
from ...results.results import Results
from . import pull_off

SWEPT = (("pull_off", "the pull-off force", "N", "pull_off_error"),)  # results of a sweep for its headline


def sentences(run: Results) -> Iterator[str]:
    """Yield a sentence for each pull-off, and for the largest pull of a contact that holds."""
    if run.job is not None:
        tolerance = run.job.numerics.tolerance
        yield from pull_off.describe_pull_off(run.table, _box(run.job), tolerance, bool(run.detached))


said_at_end = sentences  # also at the end of a run


def headline(run: Results) -> Iterator[str]:
    """Yield the force of the last pull-off and its error, where that is known."""
    lost = [pull for pull in pull_off.find(run.table, bool(run.detached)) if pull.lost is not None]
    if lost and run.job is not None:
        box = _box(run.job)
        force, within = -lost[-1].pressure * box, lost[-1].error(run.job.numerics.tolerance) * box
        known = f" ± {quantity(within, 'N', 2)}" if within == within else ""
        yield f"the pull-off force is {quantity(force, 'N', 4)}{known}"


def swept(run: Results) -> Iterator[tuple[str, float]]:
    """Yield the last pull-off of a case of a sweep and its error [N], and its approach [m]; nothing if the contact
    holds."""
    if run.job is None or run.job.section("adhesion") is None:
        return
    if lost := [each for each in pull_off.find(run.table, bool(run.detached)) if each.lost]:
        area, pull = _box(run.job), lost[-1]
        yield "pull_off", -pull.pressure * area
        yield "pull_off_error", pull.error(run.job.numerics.tolerance) * area
        yield "pull_off_approach", run.table["approach"][pull.row]


def telling_row(run: Results) -> Iterator[int]:
    """Yield the row of the last pull-off."""
    yield from (pull.row for pull in pull_off.find(run.table, bool(run.detached))[-1:])


def _box(job: Job) -> float:
    return job.grid.lx * job.grid.ly
