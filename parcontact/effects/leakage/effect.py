"""Leakage: the flow of a fluid through the gap of the contact during a run (`effects.leakage.flow`)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from ...columns import added_by
from ...contact.problem import Mask
from ...job import limits
from ...job.parts import Part, Rule
from ...job.stages import Stage
from ...parallel.root import on_root
from ...parallel.slab import Array
from ...physics.records import Entry, Saved, Units
from ..effect import Changes, ContactLaw, Decision, Detached, Effect, Instant, end_in
from .flow import leak
from .section import RULES, Leakage, SealStage, drop_at

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
    rules: ClassVar[tuple[Rule, ...]] = RULES
    lifts: ClassVar[tuple[Any, ...]] = (limits.no_field["fluid_pressure"],)
    brings_law: ClassVar[bool] = False  # a rule excludes steady sliding with `load: total`

    @staticmethod
    def decide(job: Any) -> Decision:
        section: Leakage | None = job.section("leakage")
        why = (
            "there is no leakage section" if section is None else f"the flow is calculated every {section.every} steps"
        )
        if section is not None and section.total:
            why = f"{section.substance.name} carries a part of the load"
        return Decision("leakage", section is not None, why)

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
        whole = scene.slab.to_root(np.where(instant.touching, 0.0, np.maximum(gap, 0.0)))

        def act() -> tuple[float, float, float]:
            assert whole is not None
            found = leak(whole, setup.grid.size, setup.grid.cyclic)
            return found.flow_x, found.flow_y, found.constriction

        return Changes(on_root(scene.slab.comm, act))

    def values(self, memory: tuple[float, ...]) -> Sequence[float]:
        return memory


@dataclass(frozen=True)
class SealColumns:
    """Memory of the effect `Seal`: the values of its columns, the map of the fluid's pressure above ambient [Pa], and
    True in `warned` if a warning about inertia was given."""

    columns: tuple[float, ...]
    pressure: Array
    warned: bool = False


class Seal(LeakageColumns):
    """Effect of a fluid that flows through a seal and carries a part of the load. Its contact law is
    `seal_law.SealLaw`, and its map is the pressure of the fluid."""

    columns: ClassVar[tuple[str, ...]] = ("flow_x", "constriction", *added_by("leakage.load"))
    fields: ClassVar[tuple[str, ...]] = ("fluid_pressure",)
    brings_law: ClassVar[bool] = False

    def __init__(self, scene: Any) -> None:
        self._scene = scene

    def law(self) -> ContactLaw[Any]:
        from .seal_law import SealLaw

        return SealLaw(self._scene)

    def at_rest(self) -> Any:
        return SealColumns((math.nan,) * len(self.columns), self._scene.slab.zeros())

    def follow(self, instant: Instant, memory: Any) -> Changes[Any]:
        from .seal_law import pressure_of

        numbers, step = instant.solved.numbers, instant.step
        drop = drop_at(self._scene.job, step.stage, step.time)
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
