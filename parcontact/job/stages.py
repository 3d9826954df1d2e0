"""The `initial`, `history` and `steady` sections: loads and velocities, also oscillating ones.

Loads and velocities of a stage oscillate with one frequency, for whole cycles.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    PlainValidator,
    TypeAdapter,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    create_model,
)

from .. import capabilities
from .parts import (
    AUTO,
    Auto,
    Celsius,
    Count,
    Flag,
    Instead,
    Origin,
    Part,
    Positive,
    Real,
    Rule,
    Vector,
    along_x,
    listed,
    log_range,
    rules_of,
    unit_in,
)
from .yaml_text import Fault, quote, refuse

FREQUENCY: Any = (Positive, Field(description="a positive frequency [Hz]"))
PARTS_OF_CYCLE = 4  # steps end with each of these parts of a cycle, and so at both turns


@dataclass(frozen=True)
class Oscillation:
    """A load `mean + amplitude sin(2 pi frequency t)`, with the time t from the start of its stage."""

    mean: float
    amplitude: float
    frequency: float
    constant = False
    seconds = 0.0  # the duration follows from the number of cycles of the stage

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

    def at(self, fraction: float, seconds: float) -> float:
        """Return the load `seconds` after the start of the stage; it is exact at the highest and at the lowest load.
        The `fraction` of the stage has no effect."""
        phase = math.remainder(seconds * self.frequency, 1.0)
        return self.mean + self.amplitude * math.sin(2.0 * math.pi * phase)


class Swing(tuple[float, float]):
    """Amplitude (x, y) [m/s] of a velocity `amplitude cos(2 pi frequency t)`, with the time t from the start of its
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
        """Return the displacement after `seconds`, divided by the amplitude of the velocity: a time [s]."""
        turn = 2.0 * math.pi
        return math.sin(turn * math.remainder(seconds * self.frequency, 1.0)) / (turn * self.frequency)


class SwingKeys(Part):
    """The keys of a velocity that oscillates, as they are written in a job."""

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
    """Yield errors if several quantities of a stage oscillate, if one oscillates and the stage has no number of cycles,
    and if the stage has cycles and nothing oscillates."""
    given = zip(("velocity", *CONTROLS), (velocity, *loads), strict=True)
    found = [name for name, value in given if isinstance(value, Swing | Oscillation)]
    if len(found) > 1:
        yield Fault(f"oscillates, and so does the {found[1]}: one of them may", (found[0],))
    if found and cycles is None:
        yield Fault("oscillates, which needs cycles: a whole number", (found[0],))
    if isinstance(velocity, Swing) and not any(velocity):
        yield Fault("must not be zero: nothing would move", ("velocity", "amplitude"))
    if cycles is not None and not found:
        yield Fault("needs a load {mean, amplitude, frequency}, or a velocity {amplitude, frequency}", ("cycles",))


Control = Literal["pressure", "force", "approach"]
CONTROLS: tuple[Control, ...] = ("pressure", "force", "approach")
LASTS = ("duration", "distance", "cycles")  # keys of which one gives the duration of a stage
PRESSURE = "a pressure [Pa] of zero or more"
FORCE = "a force [N] of zero or more"
VELOCITY = "a velocity [m/s]: a number along x, or [vx, vy]"
SLIDES = (1.0, 0.0)  # physics: creep of a surface that slides without rolling
SIGNED = ", with adhesion also below zero"
APPROACH = "a finite approach [m]"
SECONDS: TypeAdapter[float] = TypeAdapter(Positive)


def _no_ramp(value: Any) -> Any:
    """Refuse {from, to} of a velocity."""
    if isinstance(value, dict):
        refuse(Fault(f"must be {VELOCITY}; it does not ramp: a stage has one velocity, write several stages"))
    return value


Velocity = Annotated[Vector, BeforeValidator(_no_ramp), Field(description=VELOCITY)]
CREEP = "a creep [-] from -1000 to 1000: a number along the velocity, or [along, across]"
AnyCreep = Annotated[Real, Field(ge=-1e3, le=1e3)]
Creep = Annotated[tuple[AnyCreep, AnyCreep], BeforeValidator(along_x), Field(description=CREEP)]


@dataclass(frozen=True)
class Ramp:
    """A load [Pa, N or m] that changes linearly from `start` to `end` within a stage.

    An approach may have a normal `velocity` [m/s], which then determines the duration of the stage.
    """

    start: float
    end: float
    velocity: float | None = None

    @property
    def constant(self) -> bool:
        return self.start == self.end

    @property
    def seconds(self) -> float:
        """Return the duration [s] of a ramp with a given normal velocity, or 0 without a velocity."""
        return abs(self.end - self.start) / self.velocity if self.velocity else 0.0

    @property
    def lowest(self) -> float:
        return min(self.start, self.end)

    @property
    def highest(self) -> float:
        return max(self.start, self.end)

    def at(self, fraction: float, seconds: float) -> float:
        """Return the load at a fraction of the stage. The load is exact at both ends of the stage, and constant after
        it."""
        fraction = min(fraction, 1.0)
        return (1 - fraction) * self.start + fraction * self.end


Load = Ramp | Oscillation


def _load(number: Any, description: str, **more: Any) -> PlainValidator:
    """Return a validator that makes a `Ramp` of one number, or of {from, to} and the keys in `more`, and an
    `Oscillation` of {mean, amplitude, frequency}."""
    end: Any = (number, Field(description=description))
    keys = create_model("Ends", __base__=Part, **{"from": end, "to": end}, **more)
    size: Any = (Positive, Field(description=f"a positive amplitude [{unit_in(description)}]"))
    turns = create_model("Oscillating", __base__=Part, mean=end, amplitude=size, frequency=FREQUENCY)

    def read(value: Any, info: ValidationInfo) -> Ramp | Oscillation:
        if isinstance(value, Ramp | Oscillation):
            return value
        if isinstance(value, dict) and value.keys() & turns.model_fields.keys():
            return Oscillation(*(one for _, one in turns.model_validate(value, context=info.context)))
        if isinstance(value, list | tuple) and len(value) == 2:
            ends = f"{{from: {quote(value[0])}, to: {quote(value[1])}}}"
            refuse(Fault(f"must be {description}, got a list; give {ends} for a ramp, or a stage for each"))
        given = value if isinstance(value, dict) else {"from": value, "to": value}
        ramp = Ramp(*(number for _, number in keys.model_validate(given, context=info.context)))
        if ramp.velocity and ramp.constant:
            refuse(Fault("needs different ends: a constant approach has no velocity", ("velocity",)))
        return ramp

    return PlainValidator(read, json_schema_input_type=number | keys | turns)


NORMAL: Any = (Positive | None, Field(default=None, description="a positive velocity along the normal [m/s]"))


class GeometricStep(Part):
    """Time steps that grow by a factor: `first`, `first growth`, `first growth^2`, ... [s]."""

    first: Positive = Field(description="a positive time step [s]")
    growth: Real = Field(ge=1, description="a factor [-] of one or more")


def _time_step(value: Any, info: ValidationInfo) -> float | GeometricStep | Auto:
    if value == AUTO:
        return AUTO
    if isinstance(value, dict | GeometricStep):
        return GeometricStep.model_validate(value, context=info.context)
    return SECONDS.validate_python(value, context=info.context)


TimeStep = Annotated[
    float | GeometricStep | Auto, PlainValidator(_time_step, json_schema_input_type=Positive | GeometricStep | Auto)
]


def _stepping(
    duration: float | None,
    distance: float | None,
    cycles: int | None,
    velocity: tuple[float, float],
    time_step: float | GeometricStep | Auto | None,
    cells_per_step: float | None,
    approach: Load | None,
    creep: tuple[float, float],
) -> Iterator[Fault]:
    """Check that a stage with time steps has a duration, and a stage with a distance or a creep a velocity."""
    lasts = any(value is not None for value in (duration, distance, cycles)) or bool(approach and approach.seconds)
    if not lasts and (time_step or cells_per_step):
        key = "time_step" if time_step else "cells_per_step"
        yield Fault("needs a duration [s] or a distance [m]: without them a stage is one solve", (key,))
    rolls = None if creep == SLIDES else creep
    for name, value in (("distance", distance), ("cells_per_step", cells_per_step), ("creep", rolls)):
        if value is not None and not any(velocity):
            yield Fault("needs a velocity [m/s] that is not zero", (name,))


def _lasting_ramp(
    duration: float | None, distance: float | None, cycles: int | None, *loads: Load | None
) -> Iterator[Fault]:
    """Check that each ramp has one duration: from a key of the stage, or from the velocity of the approach."""
    lasts = zip(LASTS, (duration, distance, cycles), strict=True)
    given = [key for key, value in lasts if value is not None]
    for name, ramp in zip(CONTROLS, loads, strict=True):
        if not isinstance(ramp, Ramp):
            continue
        if ramp.velocity and given:
            sentence = f"already gives the duration, {ramp.seconds:.4g} s; leave out the velocity or {given[0]}"
            yield Fault(sentence, (name, "velocity"))
        if not ramp.constant and not ramp.velocity and not given:
            normal = ", or a velocity [m/s] in its braces" if name == "approach" else ""
            yield Fault(f"is a ramp, which needs a duration [s] or a distance [m]{normal}", (name,))


WHICH_LOAD = "give a pressure [Pa], a force [N] or an approach [m]"


class Stage(Part):
    """One stage of the history: a load, a velocity, and a duration. A stage without duration is one step, in which
    nothing slides and no time passes."""

    name: str = Field(default="stage", description="text (put numbers in quotes)")
    pressure: Annotated[Load | None, _load(Real, PRESSURE)] = Field(default=None, description=PRESSURE + SIGNED)
    force: Annotated[Load | None, _load(Real, FORCE)] = Field(default=None, description=FORCE + SIGNED)
    approach: Annotated[Load | None, _load(Real, APPROACH, velocity=NORMAL)] = Field(default=None, description=APPROACH)
    velocity: Annotated[Velocity, OR_SWING] = (0.0, 0.0)
    creep: Creep = SLIDES
    duration: Positive | None = Field(default=None, description="a positive time [s]")
    distance: Positive | None = Field(default=None, description="a positive length [m]")
    cycles: Count | None = Field(default=None, description="a positive whole number of cycles")
    time_step: TimeStep | None = Field(
        default=None, description="a positive time step [s], {first, growth}, or auto"
    )  # default: auto, if the stage has a duration and no cells_per_step
    cells_per_step: Positive | None = Field(
        default=None, description="a positive number of cells (a fraction is allowed)"
    )

    foreign = dict.fromkeys(("load", "normal_load"), Instead(WHICH_LOAD, CONTROLS))
    one_of = (CONTROLS,)
    at_most_one = (LASTS, ("time_step", "cells_per_step"))
    rules = (
        Rule((*LASTS, "velocity", "time_step", "cells_per_step", "approach", "creep"), _stepping),
        Rule((*LASTS, *CONTROLS), _lasting_ramp),
        Rule(("cycles", "velocity", *CONTROLS), check_cycles),
    )

    @classmethod
    def filled(cls, data: dict[str, Any], context: Origin | None) -> dict[str, Any]:
        """Return the keys `data` of a stage, with `time_step: auto` if the stage lasts and its steps are not given."""
        approach, given = data.get("approach"), data.keys() & {"time_step", "cells_per_step"}
        moves = approach.get("velocity") if isinstance(approach, dict) else getattr(approach, "velocity", None)
        lasts = moves or data.keys() & {*LASTS}
        return {**data, "time_step": AUTO} if lasts and not given else data

    @classmethod
    def _instead(cls, word: str) -> Instead:
        """Return advice for an unknown word, also for a key that an effect adds to the stages of its jobs."""
        adds = (each.SECTION for each in capabilities.folders() if word in getattr(each, "STAGE_KEYS", ()))
        section = next(adds, "")
        return Instead(f"it needs a section {section}") if section else super()._instead(word)

    @property
    def chooses(self) -> bool:
        """Return True if the program chooses the steps of the stage (`time_step: auto`)."""
        return self.time_step == AUTO

    @property
    def rolls(self) -> bool:
        """Return True if the shape rolls: its points then move at another velocity than the shape as a whole."""
        return self.creep != SLIDES

    @property
    def control(self) -> Control:
        """Return the kind of the prescribed load: pressure, force or approach."""
        return next(name for name in CONTROLS if getattr(self, name) is not None)

    @property
    def load(self) -> Load:
        """Return the prescribed load, in the unit of its control: Pa, N or m."""
        load: Load = getattr(self, self.control)
        return load

    @property
    def frequency(self) -> float:
        """Return the frequency of the load or of the velocity [Hz], or 0 for a stage that does not oscillate."""
        found = (each for each in (self.load, self.velocity) if isinstance(each, Oscillation | Swing))
        return next((each.frequency for each in found), 0.0)

    @property
    def slides(self) -> bool:
        """Return True if the surface slides at a constant velocity."""
        return any(self.velocity) and not isinstance(self.velocity, Swing)

    @property
    def constant(self) -> bool:
        """Return True if the load is constant within the stage."""
        return all(getattr(getattr(self, name), "constant", True) for name in type(self).model_fields)

    @property
    def speed(self) -> float:
        """Return the magnitude of the velocity [m/s], the largest one if it oscillates."""
        return math.hypot(*self.velocity)

    def moving(self, seconds: float) -> float:
        """Return the displacement of the surface `seconds` after the start of the stage, divided by `velocity`: a time
        [s]. This time equals `seconds` unless the velocity oscillates."""
        return self.velocity.moving(seconds) if isinstance(self.velocity, Swing) else seconds

    @property
    def seconds(self) -> float:
        """Return the duration of the stage [s], or 0 for a stage that is one step without duration."""
        if self.distance is not None:
            return self.distance / self.speed
        if self.cycles is not None:
            return self.cycles / self.frequency
        return self.duration or self.load.seconds


def _steady_start(state: str, velocity: tuple[float, float], pressure: float | None) -> Iterator[Fault]:
    if state == "steady" and pressure is None:
        yield Fault("needs a pressure [Pa] for the steady state to start from")
    if state == "virgin" and (any(velocity) or pressure is not None):
        yield Fault("must be steady if velocity or pressure is given: a virgin body has no history", ("state",))


class Initial(Part):
    """The state of the body at time 0: undeformed, or in steady sliding under a pressure. Steady sliding at a velocity
    of zero is a contact that has relaxed completely."""

    state: Literal["virgin", "steady"] = "virgin"
    velocity: Velocity = (0.0, 0.0)
    pressure: Positive | None = Field(default=None, description="a positive pressure [Pa]")

    rules = rules_of(_steady_start)


def expand_range(value: Any) -> Any:
    """Return a list as it is, or the numbers of a range first:last:count."""
    if not isinstance(value, str):
        return listed(value)
    try:
        return log_range(value)
    except ValueError as error:
        refuse(Fault(f"must be {error}, got {quote(value)}"))


SomeNumbers = Annotated[tuple[Positive, ...], Field(min_length=1), BeforeValidator(expand_range)]


def _directed(direction: tuple[float, float]) -> Iterator[Fault]:
    if not any(direction):
        yield Fault("must not be zero in both components, got [0, 0]", ("direction",))


class Steady(Part):
    """Steady sliding, which is solved directly for all combinations of the speeds, pressures and temperatures."""

    velocities: SomeNumbers = Field(description="positive speeds [m/s]: a list, or first:last:count")
    pressures: SomeNumbers | None = Field(
        default=None, description="positive pressures [Pa]: a list, or first:last:count"
    )
    temperatures: Annotated[tuple[Celsius, ...], Field(min_length=1), BeforeValidator(listed)] | None = Field(
        default=None, description="temperatures [deg C], up to 5000: a list"
    )  # default: the temperature of the material
    direction: tuple[Real, Real] = Field(default=(1.0, 0.0), description="a direction [x, y] [-]")
    waves: Flag = False

    rules = rules_of(_directed)

    @property
    def unit_direction(self) -> tuple[float, float]:
        """Return the direction as a unit vector."""
        x, y = self.direction
        length = math.hypot(x, y)
        return x / length, y / length
