"""study.csv: one line per case, written when the case is done, with its errors once all are."""

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..job import AUTO
from ..storage import files
from . import cases, outcome
from .cases import Case
from .outcome import QUANTITIES, Outcome

ERRORS = tuple(f"error_{name}" for name in QUANTITIES)
COLUMNS = ("fingerprint", *cases.NAMES, *outcome.NAMES, *ERRORS)
WORDS = ("integrator", "precision", "kernel")
COUNTS = ("mesh", "steps", "operator_calls")


def read(path: Path, wanted: Mapping[Case, str]) -> dict[Case, Outcome]:
    """The outcomes of the wanted cases that a table already has, if their jobs have the same fingerprints."""
    if not path.exists():
        return {}
    found = {}
    with path.open(newline="") as file:
        for row in csv.DictReader(line for line in file if line.endswith("\n")):
            if set(row) == set(COLUMNS) and None not in row.values():
                case = Case(**{name: _value(name, row[name]) for name in cases.NAMES})
                if wanted.get(case) == row["fingerprint"]:
                    found[case] = Outcome(**{name: _value(name, row[name]) for name in outcome.NAMES})
    return found


def write(
    path: Path,
    wanted: Mapping[Case, str],
    outcomes: Mapping[Case, Outcome],
    errors: Mapping[Case, Mapping[str, float]] | None = None,
) -> None:
    """Put all outcomes into the table, in the place of the old one."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for case, result in outcomes.items():
        settings = [AUTO if (value := getattr(case, name)) is None else value for name in cases.NAMES]
        results = [getattr(result, name) for name in outcome.NAMES]
        missed = [errors[case][name] if errors else "" for name in QUANTITIES]
        writer.writerow([wanted[case], *settings, *results, *missed])
    files.write(path, text.getvalue())


def _value(name: str, text: str) -> Any:
    if name in WORDS:
        return text
    if text == AUTO:
        return None
    return int(text) if name in COUNTS else float(text)
