"""Loads and velocities of a stage that oscillate with one frequency, for whole cycles."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pydantic import Field, ValidationInfo, ValidatorFunctionWrapHandler, WrapValidator

from ..text.fault import Fault
from .part import Part
from .quantities import Positive, Vector

FREQUENCY: Any = (Positive, Field(description="a positive frequency [Hz]"))
PARTS_OF_CYCLE = 4  # steps end with each of these parts of a cycle, and so at both turns


@dataclass(frozen=True)
class Oscillation:
    """A load `mean + amplitude sin(2 pi frequency t)`, with the time t from the start of its stage."""

    mean: float
    amplitude: float
    frequency: float
    constant = False

    @property
    def start(self) -> float:
        return self.mean

    @property
    def end(self) -> float:
        """Return the load after whole cycles."""
        return self.mean

    @property
    def lowest(self) -> float:
        return self.mean - self.amplitude

    @property
    def highest(self) -> float:
        return self.mean + self.amplitude

    @property
    def seconds(self) -> float:
        """Return 0: the number of cycles is a key of the stage."""
        return 0.0

    def at(self, fraction: float, seconds: float) -> float:
        """Return the load some `seconds` after the start of the stage; exact at both turns."""
        phase = math.remainder(seconds * self.frequency, 1.0)
        return self.mean + self.amplitude * math.sin(2.0 * math.pi * phase)


class Swing(tuple[float, float]):
    """The amplitude (x, y) [m/s] of a velocity `amplitude cos(2 pi frequency t)`, with the time t from the start of its
    stage: the surface moves to and fro by `amplitude/(2 pi frequency)`."""

    frequency: float

    def __new__(cls, amplitude: tuple[float, float], frequency: float) -> Swing:
        made = super().__new__(cls, amplitude)
        made.frequency = frequency
        return made

    def __getnewargs__(self) -> tuple[tuple[float, float], float]:
        return (self[0], self[1]), self.frequency

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Swing) and tuple(self) == tuple(other) and self.frequency == other.frequency

    def __hash__(self) -> int:
        return hash((*self, self.frequency))

    def moving(self, seconds: float) -> float:
        """Return the time [s] in which the amplitude as a constant velocity leads to the same position."""
        turn = 2.0 * math.pi
        return math.sin(turn * math.remainder(seconds * self.frequency, 1.0)) / (turn * self.frequency)


class SwingKeys(Part):
    """A velocity that oscillates."""

    amplitude: Vector = Field(description="an amplitude [m/s]: a number along x, or [vx, vy]")
    frequency: Positive = Field(description="a positive frequency [Hz]")


def _swing(value: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
    """Return a `Swing` for {amplitude, frequency}, and the constant velocity for other values."""
    if isinstance(value, dict) and not value.keys() & {"from", "to"}:
        keys = SwingKeys.model_validate(value, context=info.context)
        return Swing(keys.amplitude, keys.frequency)
    return value if isinstance(value, Swing) else handler(value)


OR_SWING = WrapValidator(_swing, json_schema_input_type=Vector | SwingKeys)  # of velocities that may oscillate


def check_cycles(cycles: int | None, velocity: tuple[float, float], *loads: Any) -> Iterator[Fault]:
    """Check that a stage oscillates in one quantity, and has cycles if and only if it oscillates."""
    names = ("velocity", "pressure", "force", "approach")
    found = [
        name for name, value in zip(names, (velocity, *loads), strict=True) if isinstance(value, Swing | Oscillation)
    ]
    if len(found) > 1:
        yield Fault(f"oscillates, and so does the {found[1]}: one of them may", (found[0],))
    if found and cycles is None:
        yield Fault("oscillates, which needs cycles: a whole number", (found[0],))
    if isinstance(velocity, Swing) and not any(velocity):
        yield Fault("must not be zero: nothing would move", ("velocity", "amplitude"))
    if cycles is not None and not found:
        yield Fault("needs a load {mean, amplitude, frequency}, or a velocity {amplitude, frequency}", ("cycles",))
