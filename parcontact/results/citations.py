"""References to cite for a run: this program, and the references of its job (`storage.provenance`)."""

from pathlib import Path

from ..errors import InputError
from ..storage.provenance import PROGRAM, references_of
from .results import Results


def describe_citations(directory: Path) -> str:
    """Return the references to cite for the run in a directory. Raises InputError without a run, or if its job is
    damaged."""
    found = Results(directory)
    job, theory = found.plain_job(), ["theory"] * any(map(found.has, ("theory.csv", "steady_theory.csv")))
    try:
        cited = references_of(job, theory)
    except (AttributeError, KeyError, TypeError) as error:
        damaged = f"the job in {directory} is damaged: it lacks sections of a resolved job; run it again"
        raise InputError(damaged) from error
    lines = [f"{directory}: please cite", "", f"* {found.program or PROGRAM}", "    this program (CITATION.cff)"]
    return "\n".join([*lines, *(line for reference, what in cited for line in (f"* {reference}", f"    {what}"))])
