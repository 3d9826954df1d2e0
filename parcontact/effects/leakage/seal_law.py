"""Contact law of a seal whose fluid carries a part of the load.

The contact pressure q and the pressure p~ of the fluid above ambient press the body together. p~ is continued into
contact (`fluid_pressure`). The displacement of the body is A (q + p~), where A is the linear operator from pressure to
displacement. With the heights h of the rigid surface and its approach d, the gap g satisfies

    g = A (q + p~) - h - d >= 0,    q >= 0,    q g = 0,    <q> = p0 - <p~>,

where p0 is the load above ambient, and <> the mean over the box. Each round first solves the contact of the heights
`h - A p~` under the load `p0 - <p~>` by the usual contact law, and then the flow through its gap, which gives the next
p~. Rounds end when the flow and p~ no longer change. The body remembers the whole pressure q + p~.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ...contact.problem import Contact, Control, MeanPressure
from ...job.history import Step
from ...parallel import regrid
from ...parallel.root import on_root
from ...parallel.slab import Array
from ...physics.body import Trial
from ...physics.records import Entry, Measures, Saved, Units
from ...physics.surface import cells_between
from ..effect import (
    ContactLaw,
    Detached,
    EdgeMotion,
    End,
    PreviousContacts,
    PreviousPressure,
    SolvedContact,
    end_in,
    entries_of_end,
)
from .flow import PressureDrop
from .fluid_pressure import Rounds, linear_share, pressure_of, seal_flow
from .section import drop_at

MOST_ROUNDS = 100  # tuning: limit on the rounds of a step
LEAST_LOAD = 1e-3  # accuracy: least load of the contact over the load, below which the seal lifts off
SHARP = 1e-4  # accuracy: largest tolerance of a contact with a fluid; K is then within 0.1 %
OPEN = 1e-30  # rounding: least open gap [m], as contact has the gap 0


@dataclass(frozen=True)
class SealMemory:
    """Memory of a seal after a step.

    `share` is the map of the share s of the pressure drop (`fluid_pressure`), and `gap` the map of the gap [m], 0 in
    contact. `spare` holds two maps for the next step. `pressures` are the high and the low pressure of the fluid [Pa],
    and `modulus` is the modulus of the body in the step; these are 0 before the first step. `flows` is True if the
    share is known. `end` has the time and the load at which the seal lifted off, None if it has not.
    """

    share: Array
    gap: Array
    spare: tuple[Array, Array]
    pressures: tuple[float, float] = (0.0, 0.0)
    modulus: float = 0.0
    flows: bool = False
    end: Detached | None = None


class _Verdict(NamedTuple):
    """Verdict on the last round: True in `settled` if the rounds have settled, True in `lifted` if the seal lifts off,
    and in `change` the estimated relative error of the flow."""

    settled: bool
    lifted: bool
    change: float


class SealLaw:
    """Contact law of a scene with `leakage: {load: total}`; contacts are solved by the usual law of the scene."""

    may_shorten = False

    def __init__(self, scene: Any) -> None:
        self.scene, self.slab, self._size = scene, scene.slab, scene.choices.grid.size
        self._start, self._fluid, self._image, self._heights = (scene.slab.empty() for _ in range(4))
        self._dry: ContactLaw[Any] | None = None

    def upon(self, dry: ContactLaw[Any]) -> SealLaw:
        """Take the usual law `dry`, which solves the contacts, and return this law."""
        self._dry = dry
        return self

    def solve(
        self,
        trial: Trial,
        step: Step,
        control: Control,
        memory: SealMemory,
        past: PreviousContacts,
        before: Measures,
        tolerance: float | None,
    ) -> SolvedContact[SealMemory]:
        """Solve for the contact and the flow of a step; see `effects.effect.ContactLaw.solve`. If the pressure of the
        fluid differs from ambient, contacts are solved to the job's tolerance or to SHARP, whichever is smaller, and
        `tolerance` is not used."""
        assert self._dry is not None
        drop, (share, gap) = drop_at(self.scene.job, step.stage, step.time), memory.spare
        flows = memory.flows or drop.high > drop.low
        spare, pressures = (memory.share, memory.gap), (drop.high, drop.low)
        now = SealMemory(share, gap, spare, pressures, trial.alpha, flows, memory.end)
        self._begin(memory, past, step)
        if drop.high == drop.low == drop.outside:
            solved = self._dry.solve(trial, step, control, None, past, before, tolerance)
            self._put_gap(trial.effective, solved.contact, gap)
            self._fluid.fill(0.0)
            return replace(solved, memory=now, numbers=self._numbers(drop, share, gap, None))
        sharp = min(self.scene.choices.numerics.tolerance, SHARP)
        rounds, known, iterations, left = Rounds(drop, self._size), memory.modulus, 0, MOST_ROUNDS
        while True:
            load = self._press(trial, drop, share, control)
            pasts = PreviousContacts((PreviousPressure(self._start, known),), past.spare, past.approach)
            pressed = replace(trial, effective=self._heights)
            solved = self._dry.solve(pressed, step, load, None, pasts, before, sharp)
            contact, known, iterations = solved.contact, trial.alpha, iterations + solved.contact.iterations
            self._put_gap(self._heights, contact, gap)
            verdict = self._advance(rounds, share, gap, self._most(trial, control))
            left -= 1
            if contact.failure or verdict.settled or verdict.lifted or not left:
                break
            self._start[...] = contact.p
        contact.p[...] += self._fluid
        contact.u[...] += self._image
        late = f"has a flow that still changes by {verdict.change:.2g} after {MOST_ROUNDS} rounds"
        failure = contact.failure or ("" if verdict.settled or verdict.lifted else late)
        contact = replace(contact, iterations=iterations, failure=failure)
        end: End = "detached" if verdict.lifted else "equilibrium"
        numbers = self._numbers(drop, share, gap, rounds)
        return replace(solved, contact=contact, memory=now, touching=gap == 0.0, numbers=numbers, end=end)

    def _begin(self, memory: SealMemory, past: PreviousContacts, step: Step) -> None:
        """Prepare the first round of a step from the last contact; collective. Its pressure, in the units of the
        solver, goes into the map of starts, and its share into the spare map of the share. Both are moved with the
        surface by whole cells."""
        (share, _), last, start = memory.spare, past.last, self._start
        if not memory.flows:
            share[...] = linear_share(self.slab.shape)
        else:
            share[...] = memory.share
        start.fill(0.0)
        if memory.modulus:
            unit = memory.modulus * self.scene.units.pressure
            fluid = pressure_of(self.scene.job.section("leakage").drop(memory.pressures), memory.share)
            np.subtract(last.pressure, fluid / unit, out=start)
            np.maximum(start, 0.0, out=start)
            start[memory.gap > 0.0] = 0.0
        grid = self.scene.choices.grid
        cells = round(cells_between(last.position, step.position, (grid.dx, grid.dy))[1]) % grid.ny
        if cells:
            for map_ in (share, start):
                map_[...] = regrid.roll_rows(self.slab, map_, cells, self._image)

    def _press(self, trial: Trial, drop: PressureDrop, share: Array, control: Control) -> Control:
        """Compute the fluid's pressure and the heights `h - A p~` of the contact below it, in maps of this object.
        Return the load of the contact; collective."""
        np.divide(pressure_of(drop, share), trial.alpha * self.scene.units.pressure, out=self._fluid)
        self.scene.operators.operator.apply(self._fluid, self._image)
        np.subtract(trial.effective, self._image, out=self._heights)
        if not isinstance(control, MeanPressure):
            return control
        mean = self.slab.sum(float(self._fluid.sum()))[0] / self.slab.points
        return MeanPressure(max(control.value - mean, LEAST_LOAD * control.value))

    def _most(self, trial: Trial, control: Control) -> float:
        """Return the largest mean pressure of the fluid [Pa] at which contact still carries a load."""
        if not isinstance(control, MeanPressure):
            return math.inf
        return (1.0 - LEAST_LOAD) * control.value * trial.alpha * self.scene.units.pressure

    def _put_gap(self, heights: Array, contact: Contact, gap: Array) -> None:
        """Put the gap [m] of a contact into a map, 0 where the surfaces touch; local."""
        np.subtract(contact.u, heights, out=gap)
        gap -= contact.d
        gap *= self.scene.units.height
        np.maximum(gap, OPEN, out=gap)
        gap[contact.p > 0.0] = 0.0

    def _advance(self, rounds: Rounds, share: Array, gap: Array, most: float) -> _Verdict:
        """Solve for the flow in a gap, and put the share of the next round into a map unless the rounds end;
        collective."""
        whole, old = self.slab.to_root(gap), self.slab.to_root(share)
        found = list[Array]()

        def act() -> _Verdict:
            assert whole is not None
            assert old is not None
            verdict, then = rounds.advance(whole, old, most)
            found.append(then)
            return _Verdict(*verdict)

        verdict = on_root(self.slab.comm, act)
        if not (verdict.settled or verdict.lifted):
            share[...] = self.slab.from_root(found[0] if found else None)
        return verdict

    def _numbers(self, drop: PressureDrop, share: Array, gap: Array, rounds: Rounds | None) -> dict[str, float]:
        """Return the columns of the flow; collective."""
        whole, shares = self.slab.to_root(gap), self.slab.to_root(share)

        def act() -> dict[str, float]:
            assert whole is not None
            assert shares is not None
            return seal_flow(whole, drop, shares, self._size, rounds)

        return on_root(self.slab.comm, act)

    def motion(self, solved: SolvedContact[SealMemory], before: Measures, now: Measures) -> EdgeMotion:
        """Return no motion: the motion of edges in a step is not limited."""
        return EdgeMotion()

    # -- as a part of the run ------------------------------------------------------------------------------------------

    def gap(self, memory: SealMemory) -> Array | None:
        """Return the map of the last gap in the run's units, None before the first step."""
        return memory.gap / self.scene.units.height if memory.modulus else None

    def detached(self, memory: SealMemory) -> Detached | None:
        """Return the time and the load at which the seal lifted off; None if it has not."""
        return memory.end

    def with_end(self, memory: SealMemory, end: Detached) -> SealMemory:
        """Return the memory with the lift-off `end` added."""
        return replace(memory, end=end)

    def at_rest(self) -> SealMemory:
        """Return the memory before the first step, in new maps."""
        share, gap, *spare = (self.slab.zeros() for _ in range(4))
        return SealMemory(share, gap, (spare[0], spare[1]))

    def entries(self, memory: SealMemory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries: the share, the gap, the pressures of the fluid, and the lift-off."""
        return {
            "share": Entry(memory.share),
            "gap": Entry(memory.gap, 1.0, "m"),
            "pressures": Entry(np.array(memory.pressures), 1.0, "Pa"),
            "modulus": Entry(memory.modulus, units.modulus, "Pa"),
            "flows": Entry(float(memory.flows)),
            **entries_of_end(memory.end, self.scene.job),
        }

    def restored(self, memory: SealMemory, saved: Saved) -> SealMemory:
        """Return the memory that a checkpoint holds, whose maps have been read into `memory`."""
        high, low = saved["pressures"].tolist()
        known, flows = float(saved["modulus"]), bool(saved["flows"])
        end = end_in(self.scene.job, saved)
        return replace(memory, pressures=(high, low), modulus=known, flows=flows, end=end)
