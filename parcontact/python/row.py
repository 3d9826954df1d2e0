"""Measures of a step, by the names of columns of measures.csv."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ..storage import step_row as recorded


class Row(Mapping[str, float]):
    """An instant of a run: `row.friction` and `row["friction"]` are the column of measures.csv, in the same unit.

    Energies [J] that the job does not request (`output.energy`) are NaN. `dict(row)` has all columns. Type checkers
    know the columns of the page `outputs` as attributes; columns of branches and of other effects are
    `row["dissipated_0"]`. A column that the job does not have raises AttributeError.
    """

    step: int
    time: float
    distance: float
    pressure: float
    force_x: float
    force_y: float
    friction: float
    contact_area: float
    approach: float
    mean_gap: float
    max_pressure: float
    iterations: int
    residual: float
    penetration: float
    operator_calls: int
    work: float
    stored: float
    dissipated: float
    seconds: float
    friction_x: float
    contact_area_corrected: float
    error_friction: float
    error_area: float
    error_gap: float
    error_energy: float
    cut_off: int
    tensile_area: float
    adhesive_force: float
    surface_energy: float
    snap_loss: float
    friction_viscous: float
    friction_interface: float
    flow_x: float
    flow_y: float
    constriction: float
    high_pressure: float
    low_pressure: float
    fluid_pressure: float
    flow_rate: float
    mass_flow: float
    error_x: float
    error_leak: float
    error_rounds: float
    rounds: float
    stick_area: float
    slip_loss: float
    flash_temperature: float
    max_temperature: float
    error_flash: float

    def __init__(self, numbers: Mapping[str, float]) -> None:
        self._numbers = dict(numbers)

    @classmethod
    def from_record(cls, row: recorded.StepRow, added: tuple[str, ...] = ()) -> Row:
        """Return a recorded row; `added` are the names of columns of effects."""
        branches = len(row.branch_dissipation)
        return cls(dict(zip(recorded.columns(branches, added), recorded.row_numbers(row, branches), strict=True)))

    @classmethod
    def from_line(cls, line: str, added: tuple[str, ...] = ()) -> Row:
        """Return the row in a line of measures.csv; the number of branches follows from its length."""
        cells = [int(cell) if cell.isdecimal() else float(cell or "nan") for cell in line.split(",")]
        branches = len(cells) - len(recorded.columns(0, added))
        return cls(dict(zip(recorded.columns(branches, added), cells, strict=True)))

    def __getitem__(self, name: str) -> float:
        return self._numbers[name]

    if not TYPE_CHECKING:  # type checkers must not accept misspelt columns

        def __getattr__(self, name: str) -> Any:
            known = self.__dict__.get("_numbers", {})
            if name not in known:
                raise AttributeError(f"measures have no {name!r}; known names:  {', '.join(known)}")
            return known[name]

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._numbers]

    def __iter__(self) -> Iterator[str]:
        return iter(self._numbers)

    def __len__(self) -> int:
        return len(self._numbers)

    def __repr__(self) -> str:
        return f"Row({', '.join(f'{name}={value:.6g}' for name, value in self._numbers.items())})"
