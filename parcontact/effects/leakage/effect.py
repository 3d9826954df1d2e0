"""Leakage: the flow of a fluid through the gap of the contact during a run (`effects.leakage.flow`)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from ...columns import added_by
from ...job.sections.part import Part, Rule
from ...job.sections.quantities import Count
from ...job.text.fault import Fault
from ...parallel.root import on_root
from ..effect import Changes, Decision, Effect, Instant
from .flow import leak

NOTHING = (math.nan, math.nan, math.nan)


def _needs_steps(leakage: Leakage | None, history: Any) -> Iterator[Fault]:
    if leakage is not None and not history:
        yield Fault("needs a history: the flow of a friction curve is not calculated", ("leakage",))


class Leakage(Part):
    """The `leakage` section: the number of steps between two calculations of the flow."""

    label: ClassVar[str] = "leakage"
    every: Count = Field(default=1, description="a positive whole number of steps")


def compile_loops() -> None:
    """Solve for a small flow, which compiles the loops."""
    leak(np.random.default_rng(1).random((16, 16)), (1.0, 1.0))


class LeakageColumns(Effect[tuple[float, ...]]):
    """The conductivity K [m^3] of the gap along x and along y, and its critical constriction [m].

    The gap is gathered on root, which solves for the flow.
    """

    section: ClassVar[type[Part]] = Leakage
    columns: ClassVar[tuple[str, ...]] = added_by("leakage")
    rules: ClassVar[tuple[Rule, ...]] = (Rule(("leakage", "history"), _needs_steps),)

    @staticmethod
    def decide(job: Any) -> Decision:
        section: Leakage | None = job.section("leakage")
        why = (
            "there is no leakage section" if section is None else f"the flow is calculated every {section.every} steps"
        )
        return Decision("leakage", section is not None, why)

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
