"""Leakage: the flow of a fluid through the gap of the contact during a run (`effects.leakage.flow`).

This module has the `leakage` section of a job, the pressures of the fluid in the stages of its history, and the effect.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, PlainValidator, TypeAdapter, ValidationInfo

from ...columns import added_by
from ...contact.problem import Mask
from ...job import limits
from ...job.parts import Count, NonNegative, Part, Positive, Rule, rules_of
from ...job.stages import Ramp, Stage
from ...job.yaml_text import Fault, quote, refuse
from ...parallel.root import with_whole_maps
from ...parallel.slab import Array
from ...physics.records import Entry, Saved, Units
from ..effect import Changes, ContactLaw, Decision, Detached, Effect, Instant, end_in
from .flow import FLUIDS, Fluid, PressureDrop, leak

PAIR = "two pressures [HIGH, LOW] of zero or more [Pa]"
ENDS: TypeAdapter[tuple[float, float]] = TypeAdapter(tuple[NonNegative, NonNegative])
VISCOSITY: TypeAdapter[float] = TypeAdapter(Positive)
Pair = tuple[float, float]


def _pair(value: Any, info: ValidationInfo) -> Pair:
    if not isinstance(value, list | tuple) or len(value) != 2:
        refuse(Fault(f"must be {PAIR}, got {quote(value)}"))
    high, low = ENDS.validate_python(tuple(value), context=info.context)
    if high < low:
        refuse(Fault(f"must be {PAIR}, the high one first, got {quote(value)}"))
    return high, low


def _fluid(value: Any, info: ValidationInfo) -> str | float:
    if isinstance(value, str) and value in FLUIDS:
        return value
    try:
        return VISCOSITY.validate_python(value, context=info.context)
    except ValueError:
        refuse(Fault(f"must be a fluid ({', '.join(FLUIDS)}) or a positive viscosity [Pa s], got {quote(value)}"))


Pressures = Annotated[Pair, PlainValidator(_pair, json_schema_input_type=tuple[NonNegative, NonNegative])]


@dataclass(frozen=True)
class FluidRamp(Ramp):
    """High and low pressure of the fluid [Pa], which change linearly from `start` to `end` within a stage."""

    start: Pair  # type: ignore[assignment]
    end: Pair  # type: ignore[assignment]

    def at(self, fraction: float, seconds: float) -> Pair:  # type: ignore[override]
        """Return the high and the low pressure [Pa] at a fraction of the stage. They are exact at both ends, and
        constant after the stage."""
        fraction = min(fraction, 1.0)
        high, low = ((1 - fraction) * first + fraction * last for first, last in zip(self.start, self.end, strict=True))
        return high, low


def _ramp(value: Any, info: ValidationInfo) -> FluidRamp:
    if isinstance(value, FluidRamp):
        return value
    if isinstance(value, dict) and value.keys() == {"from", "to"}:
        return FluidRamp(_pair(value["from"], info), _pair(value["to"], info))
    if isinstance(value, dict):
        refuse(Fault(f"must be {PAIR}, or {{from: [HIGH, LOW], to: [HIGH, LOW]}}, got {quote(value)}"))
    return FluidRamp(_pair(value, info), _pair(value, info))


class SealStage(Stage):
    """A stage of a history in which the fluid may carry a part of the load."""

    fluid_pressures: Annotated[FluidRamp | None, PlainValidator(_ramp, json_schema_input_type=Any)] = Field(
        default=None, description=f"{PAIR}, or {{from, to}}"
    )


def _only_total(key: str, load: str, given: Any) -> Iterator[Fault]:
    if given is not None and load == "net":
        yield Fault("needs load: total; of a net load `parcontact leak --fluid --pressures` gives the flow", (key,))


def _whole(load: str, every: int, pressures: Pair | None) -> Iterator[Fault]:
    if load == "total" and every > 1:
        yield Fault(f"must be 1 with load: total, as the fluid acts in every step, got {every}", ("every",))
    if load == "total" and pressures is None:
        yield Fault(f"is missing; with load: total it must be {PAIR}", ("pressures",))


class Leakage(Part):
    """The `leakage` section: the fluid, and the number of steps between two calculations of the flow.

    With `load: total` the fluid carries a part of the load.
    """

    label: ClassVar[str] = "leakage"
    every: Count = Field(default=1, description="a positive whole number of steps")
    pressures: Pressures | None = Field(default=None, description=PAIR)
    ambient: NonNegative | None = Field(default=None, description="a pressure [Pa] of zero or more")
    fluid: Annotated[str | float, PlainValidator(_fluid, json_schema_input_type=str | Positive)] | None = Field(
        default=None, description=f"a fluid ({', '.join(FLUIDS)}) or a positive viscosity [Pa s]"
    )
    load: Literal["net", "total"] = "net"

    rules = (
        *(Rule(("load", key), partial(_only_total, key)) for key in ("pressures", "ambient", "fluid")),
        *rules_of(_whole),
    )

    def left_out(self) -> tuple[str, ...]:
        return () if self.total else ("load",)  # so that a job without a fluid is written as it is given

    @property
    def total(self) -> bool:
        """True if the fluid carries a part of the load."""
        return self.load == "total"

    @property
    def substance(self) -> Fluid:
        """The fluid; water by default."""
        name = "water" if self.fluid is None else self.fluid
        return FLUIDS[name] if isinstance(name, str) else Fluid("the fluid", name)

    def drop(self, pressures: Pair) -> PressureDrop:
        """Return the fluid with the two `pressures` [Pa] between which it flows, the high one first."""
        assert self.pressures is not None
        ambient = self.pressures[1] if self.ambient is None else self.ambient
        return PressureDrop(self.substance, *pressures, True, ambient)

    def drop_at(self, history: Any, stage: int, time: float) -> PressureDrop:
        """Return the fluid with the two pressures between which it flows at a `time` [s] of the `history`. `stage` is
        the number of the stage at this time."""
        lasts, given = history[stage].seconds, history[stage].fluid_pressures
        if given is None:
            return self.drop(self.before(history, stage))
        started = sum(each.seconds for each in history[:stage])
        return self.drop(given.at((time - started) / lasts if lasts else 1.0, lasts))

    def before(self, history: Any, stage: int) -> Pair:
        """Return the high and the low pressure [Pa] with which a stage of the `history` begins if the stage gives no
        pressures."""
        given = (each.fluid_pressures for each in reversed(history[:stage]))
        assert self.pressures is not None
        return next((ramp.end for ramp in given if ramp is not None), self.pressures)


def _needs_steps(leakage: Leakage, history: Any) -> Iterator[Fault]:
    if not leakage.total and not history:  # `_no_steady` refuses a curve with a load: total
        yield Fault("needs a history: the flow of a friction curve is not calculated", ("leakage",))


def _stages(leakage: Leakage, history: Any) -> Iterator[Fault]:
    """Yield errors of the fluid's pressures in all stages, and of the directions in which stages slide."""
    if any(stage is None for stage in history):
        return
    for number, stage in enumerate(history):
        ramp, place = stage.fluid_pressures, ("history", number, "fluid_pressures")
        if leakage.total and stage.velocity[0]:
            sentence = "must be [0, vy] with leakage.load: total: a flow along the sliding, along x, is not solved for"
            yield Fault(sentence, ("history", number, "velocity"))
        if ramp is None:
            continue
        if not leakage.total:
            yield Fault("needs leakage: {load: total}", place)
            continue
        before = leakage.before(history, number)
        if not ramp.constant and not stage.seconds:
            yield Fault("is a ramp, which needs a duration [s] or a distance [m]", place)
        elif stage.seconds and ramp.start != before:
            was, now = (f"[{high:g}, {low:g}]" for high, low in (before, ramp.start))
            yield Fault(f"must begin with {was}, got {now}: a stage without duration makes a jump", place)


def _no_free_box(leakage: Leakage, grid: Any) -> Iterator[Fault]:
    if leakage.total and not all(grid.cyclic):
        yield Fault("must be periodic with leakage.load: total: the seal is one of many", ("grid", "boundary"))


def _refused(leakage: Leakage, material: Any, numerics: Any) -> Iterator[Fault]:
    if not leakage.total:
        return
    if material.hardness is not None:
        sentence = "cannot be used with leakage.load: total: a fluid between surfaces that yield is not solved for"
        yield Fault(f"{sentence}; leave one of them out", ("material", "hardness"))
    if numerics.precision == "mixed":
        yield Fault("must be double with leakage.load: total: gaps are small", ("numerics", "precision"))


def _excludes(section: str, why: str) -> Rule:
    def check(leakage: Leakage, other: Any) -> Iterator[Fault]:
        if leakage.total and (section != "interface" or other.stick):
            sentence = f"cannot be used with {section}{'.stick' * (section == 'interface')}: {why} is not solved for"
            yield Fault(f"{sentence}; leave one of them out, or give load: net", ("leakage", "load"))

    return Rule(("leakage", section), check)


def _no_steady(leakage: Leakage, initial: Any, steady: Any) -> Iterator[Fault]:
    if leakage.total:
        yield from limits.refuse_steady("leakage").check(leakage, initial, steady)


def _has_map(leakage: Leakage, output: Any) -> Iterator[Fault]:
    if not leakage.total:
        yield from limits.no_field["fluid_pressure"](output)


NOTHING = (math.nan, math.nan, math.nan)


def compile_loops() -> None:
    """Solve for the flow through a small map, which compiles the loops."""
    leak(np.random.default_rng(1).random((16, 16)), (1.0, 1.0))


class LeakageColumns(Effect[tuple[float, ...]]):
    """Columns of leakage: the conductivity K [m^3] of the gap along x and along y, and the critical constriction [m],
    which is the smallest gap on the widest path.

    The gap is gathered on root, which solves for the flow.
    """

    section: ClassVar[type[Part]] = Leakage
    columns: ClassVar[tuple[str, ...]] = added_by("leakage")
    stage: ClassVar[type[Stage]] = SealStage
    rules: ClassVar[tuple[Rule, ...]] = (
        *rules_of(_needs_steps, _stages, _no_free_box, _has_map, _refused, _no_steady),
        _excludes("adhesion", "a fluid between surfaces that attract each other"),
        _excludes("interface", "a fluid that carries load in a contact that sticks"),
        _excludes("thermal", "the heat that a fluid carries away"),
    )
    lifts: ClassVar[tuple[Any, ...]] = (limits.no_field["fluid_pressure"],)

    @staticmethod
    def decide(job: Any) -> Decision:
        section: Leakage | None = job.section("leakage")
        if section is None:
            return Decision("leakage", False, "there is no leakage section")
        carried = f"{section.substance.name} carries a part of the load"
        return Decision(
            "leakage", True, carried if section.total else f"the flow is calculated every {section.every} steps"
        )

    @staticmethod
    def touches(job: Any, pressure: Array, gap: Array) -> Mask | None:
        return gap == 0.0 if job.section("leakage").total else None

    @staticmethod
    def why_no_theory(job: Any) -> str:
        total = job.section("leakage").total
        return "the theory excludes a fluid that carries a part of the load: give leakage: {load: net}" if total else ""

    @staticmethod
    def ended(job: Any, saved: Saved) -> Detached | None:
        return end_in(job, saved) if job.section("leakage").total else None

    def __new__(cls, scene: Any) -> Any:
        """Return the effect of a job: `Seal` with `load: total`, and otherwise `LeakageColumns`."""
        return super().__new__(Seal if scene.job.section("leakage").total else cls)

    def __init__(self, scene: Any) -> None:
        self._scene, self._every = scene, scene.job.section("leakage").every

    def at_rest(self) -> tuple[float, ...]:
        return NOTHING

    def follow(self, instant: Instant, memory: tuple[float, ...]) -> Changes[tuple[float, ...]]:
        if instant.step.number % self._every:
            return Changes(NOTHING)
        scene, setup = self._scene, self._scene.setup
        approach = (instant.measures.approach + setup.surface.datum) / scene.units.height
        gap = scene.gap(instant.displacement, instant.step.position, approach)

        def act(whole: Array) -> tuple[float, float, float]:
            found = leak(whole, setup.grid.size, setup.grid.cyclic)
            return found.flow_x, found.flow_y, found.constriction

        return Changes(with_whole_maps(scene.slab, act, np.where(instant.touching, 0.0, np.maximum(gap, 0.0))))

    def values(self, memory: tuple[float, ...]) -> Sequence[float]:
        return memory


@dataclass(frozen=True)
class SealColumns:
    """Memory of the effect `Seal`: the values of its columns, and the map of the fluid's pressure above ambient [Pa].
    `warned` is True after a warning about inertia."""

    columns: tuple[float, ...]
    pressure: Array
    warned: bool = False


class Seal(LeakageColumns):
    """Effect of a fluid that flows through a seal and carries a part of the load. Its contact law is
    `seal_law.SealLaw`, and its map is the pressure of the fluid."""

    columns: ClassVar[tuple[str, ...]] = ("flow_x", "constriction", *added_by("leakage.load"))
    fields: ClassVar[tuple[str, ...]] = ("fluid_pressure",)
    brings_law: ClassVar[bool] = False  # a rule excludes steady sliding with `load: total`

    def __init__(self, scene: Any) -> None:
        self._scene = scene

    def law(self) -> ContactLaw[Any]:
        from .seal_law import SealLaw

        return SealLaw(self._scene)

    def at_rest(self) -> Any:
        return SealColumns((math.nan,) * len(self.columns), self._scene.slab.zeros())

    def follow(self, instant: Instant, memory: Any) -> Changes[Any]:
        from .seal_law import pressure_of

        numbers, step, job = instant.solved.numbers, instant.step, self._scene.job
        drop = job.section("leakage").drop_at(job.history, step.stage, step.time)
        pressure = pressure_of(drop, instant.solved.memory.share)
        warning = drop.describe_inertia("x", numbers["mass_flow"], numbers["bound"])
        columns = tuple(numbers[name] for name in self.columns)
        said = f"{warning}; flow_rate and mass_flow are viscous; further steps are not checked"
        remark = said if warning and not memory.warned else ""
        return Changes(SealColumns(columns, pressure, memory.warned or bool(warning)), remark)

    def values(self, memory: Any) -> Sequence[float]:
        return tuple(memory.columns)

    def field(self, memory: Any, name: str) -> Array:
        return memory.pressure.copy()

    def entries(self, memory: Any, units: Units) -> dict[str, Entry]:
        return {"fluid pressure": Entry(memory.pressure, 1.0, "Pa"), "warned": Entry(float(memory.warned))}

    def restored(self, memory: Any, saved: Saved) -> Any:
        return replace(memory, warned=bool(saved["warned"]))
