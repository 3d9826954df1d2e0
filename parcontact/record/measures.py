"""measures.csv: one row per step and one for the initial state, written by root."""

import csv
from pathlib import Path
from typing import Any

from .row import Row

COLUMNS = (
    "step,time,distance,pressure,force_x,force_y,friction,contact_area,approach,mean_gap,max_pressure,"
    "iterations,residual,penetration,operator_calls,work,stored,dissipated,seconds"
).split(",")
FLUSH_SECONDS = 1.0


def values(row: Row) -> list[Any]:
    """One line of the file, in the order of COLUMNS, then the dissipation of each branch if there is any."""
    m, c = row.measures, row.certificate
    forces = (m.pressure, m.force_x, m.force_y, m.friction)
    lengths = (m.contact_area, m.approach, m.mean_gap, m.max_pressure)
    solve = (row.iterations, c.worst, c.penetration, row.operator_calls)
    energies = (row.work, row.stored, row.dissipated)
    shown = [row.step, row.time, row.distance, *forces, *lengths, *solve, *energies, round(row.seconds, 6)]
    return [_text(value) for value in (*shown, *row.branch_dissipation)]


def _text(value: float) -> str:
    """Shortest text that reads back to the same number; nothing for what was not asked for."""
    return "" if value != value else repr(value)


class MeasuresFile:
    """The growing file; a line is complete when the next one begins."""

    def __init__(self, path: Path, branches: int) -> None:
        """Continue the file or begin it."""
        new = not path.exists() or path.stat().st_size == 0
        self._file = path.open("a", newline="")
        self._writer = csv.writer(self._file, lineterminator="\n")
        if new:
            self._writer.writerow([*COLUMNS, *(f"dissipated_{k}" for k in range(branches))])

    def write(self, row: Row) -> None:
        self._writer.writerow(values(row))
        self._file.flush()

    def close(self) -> None:
        self._file.close()


def cut_back(path: Path, step: int) -> None:
    """Remove the rows after `step`, and one that is incomplete."""
    lines = path.read_text().splitlines(keepends=True)
    kept = [line for line in lines[1:] if line.endswith("\n") and int(line.split(",", 1)[0]) <= step]
    replacement = path.with_suffix(".csv.part")
    replacement.write_text("".join([*lines[:1], *kept]))
    replacement.replace(path)


def read(path: Path) -> dict[str, list[float]]:
    """Columns of a measures file by name; NaN for what was not asked for."""
    with path.open(newline="") as file:
        table = list(csv.reader(file))
    columns = zip(*table[1:], strict=True) if len(table) > 1 else [[] for _ in table[0]]
    return {name: [float(text or "nan") for text in column] for name, column in zip(table[0], columns, strict=True)}
