"""Reading of tables of results for display; incomplete tables are refused.

A growing table must have all rows that the marker or a checkpoint states. A table written at once must end with a whole
line.
"""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from ..errors import InputError
from . import curve_points, marker, tables
from .tables import Columns

RUN, CURVE = "measures.csv", "steady.csv"
GROWING = (RUN, CURVE, "bands.csv", "steady_waves.csv")
THEORY_FILE, OF_THEORY = "theory.csv", ("time", "distance", "friction", "contact_area")
MEND = "correct it, or move it away"


def read_results(path: Path) -> Columns:
    """Return the columns of a table of results by name. Raises InputError if it is damaged, foreign or incomplete."""
    lasts = list(_find_ends(path))  # read before the table, which may grow
    columns = tables.read_columns(path)
    if path.name not in GROWING:
        refuse_cut(path)
    if path.name == THEORY_FILE and (without := [name for name in OF_THEORY if name not in columns]):
        raise InputError(
            f"{path} has no column {', '.join(without)}: it was not written by `parcontact theory`; move it away"
        )
    for end, what in lasts:
        count = _last_step(columns) if path.name == RUN else len(columns["velocity"])
        if count < end:
            raise InputError(f"{path} is damaged: {what}, and the table lacks rows; {MEND}")
    if path.name == "bands.csv" and "velocity" in columns and (curve := path.with_name(CURVE)).is_file():
        points = [curve_points.of_table(one) for one in (tables.read_columns(curve), columns)]
        if lacking := curve_points.lacking(*points):
            raise InputError(f"{path} is damaged: it lacks {points[0][lacking[0]]}, which {CURVE} has; {MEND}")
    return columns


def refuse_cut(path: Path) -> None:
    """Raise InputError for a text that does not end with a whole line."""
    if not path.read_bytes().endswith(b"\n"):
        raise InputError(f"{path} is incomplete: it does not end with a whole line; write it again, or move it away")


def find_lost_rows(directory: Path) -> str:
    """Return a message if the table of a finished run is damaged or lacks rows, or ''; raises InputError for an
    unreadable marker."""
    claim = marker.claim_of_run(directory)
    if claim is None or claim.finished is None:
        return ""
    with suppress(InputError, OSError):
        read_results(directory / RUN)
        return ""
    return (
        f"{directory / RUN} is damaged: its run has finished with step {claim.finished[0]}, and the table lacks rows; "
        f"correct it, or move {directory} away to run the job again"
    )


def _last_step(columns: Columns) -> float:
    steps = columns["step"]
    return steps[-1] if steps else -1.0


def _find_ends(path: Path) -> Iterator[tuple[float, str]]:
    """Yield the last step, or the number of points, that a table must have, with the reason. Raises InputError for an
    unreadable marker."""
    verb = {RUN: "run", CURVE: "steady"}.get(path.name, "")
    claim = marker.sound_claims(path.parent).get(verb) if verb else None
    if claim is not None and claim.finished is not None:
        number = claim.finished[0]
        yield number, f"its run has finished with step {number}" if verb == "run" else f"its curve has {number} points"
    if verb == "run":
        saved = [int(one.stem[5:]) for one in path.parent.glob("checkpoint/step-*.h5") if one.stem[5:].isdecimal()]
        if saved:
            yield max(saved), f"its run has a checkpoint after step {max(saved)}"
