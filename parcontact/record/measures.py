"""measures.csv: one row per step and one for the initial state, written by root."""

import csv
import os
from pathlib import Path
from typing import Any

from . import hdf5
from .row import Row

SOLVED = ("iterations", "residual", "penetration", "operator_calls")
COLUMNS = (
    *("step", "time", "distance", "pressure", "force_x", "force_y", "friction", "contact_area", "approach", "mean_gap"),
    *("max_pressure", *SOLVED, "work", "stored", "dissipated", "seconds"),
)
LAST = ("friction_x", "contact_area_corrected")  # columns that came later stand at the end: nothing before them shifts


def columns(branches: int) -> list[str]:
    """Names of the columns when the dissipation of so many branches is asked for."""
    return [*COLUMNS, *(f"dissipated_{k}" for k in range(branches)), *LAST]


def values(row: Row, branches: int) -> list[Any]:
    """One line of the file, in the order of `columns(branches)`."""
    m, c = row.measures, row.certificate
    forces = (m.pressure, m.force_x, m.force_y, m.friction)
    lengths = (m.contact_area, m.approach, m.mean_gap, m.max_pressure)
    solve = (row.iterations, c.worst, c.penetration, row.operator_calls)
    energies = (row.work, row.stored, row.dissipated)
    shown = [row.step, row.time, row.distance, *forces, *lengths, *solve, *energies, round(row.seconds, 6)]
    last = (m.friction_x, m.contact_area_corrected)
    return [_text(value) for value in (*shown, *row.branch_dissipation[:branches], *last)]


def _text(value: float) -> str:
    """Shortest text that reads back to the same number; nothing for what was not asked for."""
    return "" if value != value else repr(value)


class MeasuresFile:
    """The growing file; a line that does not end in a newline is none."""

    def __init__(self, path: Path, branches: int) -> None:
        """Continue the file or begin it."""
        new = not path.exists() or path.stat().st_size == 0
        self._branches = branches
        self._file = path.open("a", newline="")
        self._writer = csv.writer(self._file, lineterminator="\n")
        if new:
            self._writer.writerow(columns(branches))
            self._file.flush()

    def write(self, row: Row) -> None:
        self._writer.writerow(values(row, self._branches))
        self._file.flush()

    def sync(self) -> None:
        """Wait until all rows are on the disk."""
        os.fsync(self._file.fileno())

    def close(self) -> None:
        self._file.close()


def cut_back(path: Path, step: int, branches: int) -> str:
    """Remove the rows after `step`, and one that is incomplete; the columns become those of the present job.

    Returns what is missing, or ''.
    """
    if not path.exists():
        return f"{path} is missing: the rows up to step {step} are lost"
    last = -1
    with path.open(newline="") as file, hdf5.replaced(path) as part, part.open("w", newline="") as new:
        table = csv.DictReader((line for line in file if line.endswith("\n")), restval="")
        writer = csv.DictWriter(new, columns(branches), restval="", extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        for row in table:
            if int(row["step"]) <= step:
                last = int(row["step"])
                writer.writerow(row)
        new.flush()
        os.fsync(new.fileno())
    return "" if last == step else f"{path} ends with step {last}: the rows up to step {step} are lost"


def read(path: Path) -> dict[str, list[float]]:
    """Columns of a measures file by name, also of one that still grows; NaN for what was not asked for."""
    with path.open(newline="") as file:
        table = list(csv.reader(line for line in file if line.endswith("\n")))
    series = zip(*table[1:], strict=True) if len(table) > 1 else [[] for _ in table[0]]
    return {name: [float(text or "nan") for text in column] for name, column in zip(table[0], series, strict=True)}
