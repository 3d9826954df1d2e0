"""measures.csv: a row per step and one for the initial state, written by root; its columns and units."""

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from ..accuracy.budget import ErrorBudget
from ..column import Column
from ..columns import MEASURES, cells, choose_columns, names_of, values_of
from ..errors import InputError
from ..physics.measures import Measures
from ..solve.certificate import Certificate
from . import files
from .checkpoint import TableMark
from .tables import MEND, GrowingTable, whole_lines


@dataclass(frozen=True)
class StepRow:
    """An instant of a run, as in measures.csv; SI units, energies [J] since the start.

    `errors` is the error budget of the instant, None without contact. `added` are the values of the columns of effects.
    `remark` is a sentence for run.log about an unusual step, or ''.
    """

    step: int = 0
    time: float = 0.0
    distance: float = 0.0
    measures: Measures = field(default_factory=Measures)
    iterations: int = 0
    certificate: Certificate = field(default_factory=lambda: Certificate(0.0, 0.0, 0.0))
    operator_calls: int = 0
    work: float = math.nan
    stored: float = math.nan
    dissipated: float = math.nan
    error_energy: float = math.nan
    branch_dissipation: tuple[float, ...] = ()
    seconds: float = 0.0
    remark: str = ""
    errors: ErrorBudget | None = None
    added: tuple[float, ...] = ()

    @property
    def error_friction(self) -> float:
        """Return the estimated relative error of friction; 1 or more if friction may be 0, NaN if unknown."""
        return self.errors.friction.of_friction if self.errors and self.errors.friction else math.nan

    @property
    def error_area(self) -> float:
        """Return the estimated relative error of the contact area, NaN if unknown."""
        return self.errors.area.total if self.errors else math.nan

    @property
    def error_gap(self) -> float:
        """Return the estimated relative error of the mean gap: of the open share; NaN in full contact or if unknown."""
        area = self.measures.contact_area_corrected
        return self.error_area * area / (1.0 - area) if area < 1.0 else math.nan


def columns(branches: int, added: Sequence[str] = ()) -> list[str]:
    """Return the names of the columns, with the dissipation of `branches` and columns `added` by effects.

    Raises InputError for a repeated name.
    """
    names = [*names_of(_always(branches)), *added]
    if twice := {name for name in added if names.count(name) > 1}:
        raise InputError(f"measures.csv has a column {', '.join(sorted(twice))}: its effect must give it another name")
    return names


def row_numbers(row: StepRow, branches: int) -> list[float]:
    """Return the values of a row in the order of `columns`; NaN if not requested."""
    return [*values_of(_always(branches), row), *row.added]


@cache
def _always(branches: int) -> list[Column]:
    return choose_columns(MEASURES, branches)


class MeasuresFile(GrowingTable):
    """The growing measures.csv of a run; `table` is its state."""

    def __init__(self, path: Path, table: TableMark, branches: int = 0, added: Sequence[str] = ()) -> None:
        """Continue the file with the state `table`, or begin it."""
        super().__init__(path, columns(branches, added))
        self.table, self._branches = table, branches

    def write(self, row: StepRow) -> None:
        """Append a row; after an error the file is unchanged, but `table` includes the row, which the next run adds."""
        line = cells(row_numbers(row, self._branches))
        self.table = TableMark(self.table.rows + 1, ",".join(line))
        self.append(line)


def cut_back_table(
    path: Path, step: int, then: TableMark, branches: int = 0, added: Sequence[str] = ()
) -> tuple[TableMark, list[str]]:
    """Remove rows after `step`, and an incomplete row; the columns become the columns of the present job.

    `then` is the state when the checkpoint was written: its last row is added if the disk was full. Returns the new
    state and messages on lost rows. Raises InputError for a damaged file, which is not changed.
    """
    if not path.exists():
        return TableMark(), [f"{path} is missing: the rows up to step {step} are lost"]
    found, wanted = whole_lines(path), columns(branches, added)
    names = next(found, [])
    if "step" not in names:
        raise InputError(f"{path}, line 1, must name the columns, including step; correct it, or move the file away")
    last, kept, problems = -1, TableMark(), list[str]()
    with files.replaced(path) as new:
        new.write(f"{','.join(wanted)}\n".encode())
        for number, line in enumerate(found, 2):
            row = dict(zip(names, line, strict=True))
            if not row["step"].isdecimal():
                raise InputError(f"{path}, line {number}: the step {row['step']!r} is not a whole number; {MEND}")
            if int(row["step"]) > step:
                break
            last, kept = int(row["step"]), TableMark(kept.rows + 1, ",".join(row.get(name, "") for name in wanted))
            new.write(f"{kept.last}\n".encode())
        if last < step and kept.rows + 1 == then.rows and names == wanted:
            kept = then
            new.write(f"{then.last}\n".encode())
        elif last < step:
            problems = [f"{path} ends with step {last}: the rows up to step {step} are lost"]
        new.flush()
        os.fsync(new.fileno())
    return kept, problems
