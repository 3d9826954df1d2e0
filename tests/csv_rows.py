"""Tables as the program writes them, for tests: each row as texts by the names of its columns."""

import csv
from pathlib import Path

Rows = list[dict[str, str]]


def rows(table: Path) -> Rows:
    with table.open(newline="") as file:
        return list(csv.DictReader(file))


def measures(out: Path) -> Rows:
    """All that a run measured but the wall time."""
    return [{key: text for key, text in row.items() if key != "seconds"} for row in rows(out / "measures.csv")]
