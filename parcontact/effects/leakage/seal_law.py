"""Contact law of a seal whose fluid carries a part of the load, and the pressure of this fluid.

The contact pressure q and the pressure p~ of the fluid above ambient press the body together. The displacement of the
body is A (q + p~), where A is the linear operator from pressure to displacement. With the heights h of the rigid
surface and its approach d, the gap g satisfies

    g = A (q + p~) - h - d >= 0,    q >= 0,    q g = 0,    <q> = p0 - <p~>,

where p0 is the load above ambient, and <> the mean over the box. Each round first solves the contact of the heights `h
- A p~` under the load `p0 - <p~>` by the usual contact law, and then the flow through the gap of this contact, which
gives the next p~. Rounds end when the flow and p~ no longer change. The body remembers the whole pressure q + p~.

The fluid flows along x. In contact and in closed pools the flow does not determine the pressure p. There, a small leak
eps determines the pressure. It is SMALL times the mean of g^3:

    div((g^3 + eps) grad p) = 0                            for a liquid,
    div((g^3 + 6 lambda g^2 + eps) grad p^2) = 0           for a gas.

The pressure falls from p1 at the high end to p2 at the low end. The unknown of the rounds is the share s, which falls
from 1 to 0:

    p = p2 + s (p1 - p2)            for a liquid,
    p^2 = p2^2 + s (p1^2 - p2^2)    for a gas.

The flow of each round gives another map of s. Anderson's method (D. G. Anderson, J. ACM 12 (1965) 547) finds the map
for the next round from this round and the `DEPTH` rounds before it. Near percolation, pools open and close again.
Therefore, after `ANDERSON` rounds, each cell changes its s by a part of the difference of both maps only, and this part
is halved whenever the difference changes its sign. If the flow has not settled after `EACH` rounds, eps is multiplied
by `GROWTH`, and the rounds begin again with Anderson's method.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...contact.problem import Contact, Control, MeanPressure
from ...job.history import Step
from ...parallel import regrid
from ...parallel.root import with_whole_maps
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
from .flow import Balance, PressureDrop, flow_mesh_error, least_section, solve_flow

Map = NDArray[np.floating]
SMALL = 1e-9  # accuracy: small leak over the mean of g^3
DEPTH = 3  # tuning: differences of earlier rounds
ANDERSON = 9  # tuning: rounds of Anderson's method
SHORTER, LONGER, LEAST = 0.5, 1.1, 0.01  # tuning: factors of the part of its change that a cell makes, and the least
EACH, GROWTH = 20, 100.0  # tuning: rounds with one small leak, and its growth after these
MOST_REST = 5.0  # tuning: largest sum of further changes over the next one
RIDGE = 1e-12  # rounding: of the products of differences
SETTLED = 1e-4  # accuracy: estimated relative error of the flow by the rounds, and rms error of the share


def pressure_of(drop: PressureDrop, share: Map) -> Map:
    """Return the map of the fluid's pressure above ambient [Pa], from a map of the share s of the pressure drop."""
    if drop.fluid.molar_mass is None:
        return drop.low + share * (drop.high - drop.low) - drop.outside
    return np.sqrt(drop.low**2 + share * (drop.high**2 - drop.low**2)) - drop.outside


def conducting(gap: Map, drop: PressureDrop, share: Map) -> Map:
    """Return the map of conducting gaps [m], in place of the gaps `gap` [m]: as much fluid flows through the conducting
    gaps without slip as through the gaps with slip. `share` is the map of s, which gives the local pressure."""
    if not drop.mean_free_path:
        return gap
    local = np.maximum(pressure_of(drop, share) + drop.outside, 0.0)
    path = drop.mean_free_path * drop.pressures[0] / np.maximum(local, 1e-3 * drop.high)
    return np.asarray(np.cbrt(gap**2 * (gap + 6.0 * path)))


@dataclass(frozen=True)
class Filled:
    """The map of s, the share of the pressure drop in each cell, shape (ny, nx), and the conductivity of the gap [m^3]
    including the small leak."""

    share: Map
    conductivity: float


def fill_share(gap: Map, size: tuple[float, float], small: float = SMALL) -> Filled:
    """Return the map of s, the share of the pressure drop in each cell, and the conductivity. `gap` is a map of
    conducting gaps g [m], shape (ny, nx), on a box of `size` (lx, ly) [m]. `small` is the small leak eps of the module,
    divided by the mean of g^3."""
    cubes = gap.T**3
    mean = float(cubes.mean())
    resistances = 1.0 / (cubes / mean + small) if mean > 0.0 else np.ones(cubes.shape)
    balance, given = Balance(resistances, size[1] / size[0] * gap.shape[1] / gap.shape[0], True), np.zeros(cubes.shape)
    given[0] = balance.first
    share = balance.solve(given)
    return Filled(share.T.copy(), mean * balance.power(share) * size[0] / size[1])


class Verdict(NamedTuple):
    """Verdict on an iteration between contact and flow: `settled` is True if it has settled, and `lifted` is True if
    the fluid lifts the seal off. `change` is the estimated relative error of the flow."""

    settled: bool
    lifted: bool
    change: float


class Rounds:
    """Iterations between contact and flow (rounds) in one step, for a pressure drop on a box of `size` (lx, ly) [m].
    The object keeps the maps of earlier rounds, and lives on root only."""

    def __init__(self, drop: PressureDrop, size: tuple[float, float]) -> None:
        self._drop, self._size, self.count = drop, size, 0
        self._shares, self._residuals = list[Map](), list[Map]()
        self.conductivity, self.error = 0.0, math.inf
        self._parts, self._small = np.ones(()), SMALL
        self._last: tuple[Map, Map] | None = None

    def advance(self, gap: Map, share: Map, most: float) -> tuple[Verdict, Map]:
        """Make one iteration (round): find the flow through a gap. The map `gap` [m] is the gap of the contact under
        the pressure of the fluid that belongs to the map `share` of s.

        Return the verdict on the round, and the map of s for the next one, whose mean pressure is at most `most` [Pa].
        """
        if self.count and self.count % EACH == 0:
            self._restart()
        self.count += 1
        drop, last = self._drop, self.conductivity
        filled = fill_share(conducting(gap, drop, share), self._size, self._small)
        change = abs(filled.conductivity / last - 1.0) if last else math.inf
        self.conductivity = filled.conductivity
        mean, wanted = (float(pressure_of(drop, one).mean()) for one in (share, filled.share))
        lifted = mean >= (1.0 - SETTLED) * most and wanted >= most
        rest = self._rest(share, filled.share)
        moved = rest * math.sqrt(float(np.mean((filled.share - share) ** 2)))
        settled = drop.high == drop.low or (rest * change < SETTLED and moved < SETTLED)
        self.error = rest * change
        if lifted or settled:
            return Verdict(settled and not lifted, lifted, self.error), share
        by_cells = (self.count - 1) % EACH >= ANDERSON
        mixed = self._damped(share, filled.share, rest) if by_cells else self._mixed(share, filled.share)
        following = np.clip(mixed, 0.0, 1.0)
        then = float(pressure_of(drop, following).mean())
        if then > most:
            following = (
                share + max(0.0, (most - mean) / (then - mean)) * (following - share) if mean < most else filled.share
            )
        return Verdict(False, False, self.error), following

    def _restart(self) -> None:
        """Forget the rounds so far, and go on with a larger leak."""
        self._small *= GROWTH
        self._shares.clear()
        self._residuals.clear()
        self._parts, self._last = np.ones(()), None

    def _rest(self, share: Map, found: Map) -> float:
        """Return the sum of all changes still to come, divided by the next one, as the changes of the last two rounds
        predict it (A. C. Aitken)."""
        residual, last = found - share, self._last
        self._last = share, residual
        if last is None:
            return 1.0
        change = residual - last[1]
        square = float(np.vdot(change, change))
        return min(max(1.0, -float(np.vdot(share - last[0], change)) / square), MOST_REST) if square else 1.0

    def _damped(self, share: Map, found: Map, rest: float) -> Map:
        """Return the map of s for the next round, in which each cell changes by a part of the difference
        `found - share`."""
        residual, last = found - share, self._residuals[-1]
        self._parts = np.where(last * residual < 0.0, SHORTER, LONGER) * self._parts
        self._parts = np.clip(self._parts, LEAST, 1.0)
        self._residuals[-1] = residual
        return share + rest * self._parts * residual

    def _mixed(self, share: Map, found: Map) -> Map:
        """Return the map of s for the next round by Anderson's method, from the map `share` of this round and the map
        `found` that its gap gives."""
        self._shares.append(share)
        self._residuals.append(found - share)
        del self._shares[: -DEPTH - 1], self._residuals[: -DEPTH - 1]
        residual = self._residuals[-1]
        changes = np.array([(residual - old).ravel() for old in self._residuals[:-1]])
        if not changes.any():
            return found
        moves = np.array([(share - old).ravel() for old in self._shares[:-1]])
        products = changes @ changes.T
        products[np.diag_indices_from(products)] += RIDGE * np.trace(products) / len(products)
        weights = np.linalg.solve(products, changes @ residual.ravel())
        return share + (residual.ravel() - weights @ (moves + changes)).reshape(share.shape)


def seal_flow(
    gap: Map, drop: PressureDrop, share: Map, size: tuple[float, float], rounds: Rounds | None
) -> dict[str, float]:
    """Return the values of a seal's columns by name, and as `bound` the largest mass flow [kg/s] that the inertia of a
    gas lets pass.

    `gap` [m] and `share` are the maps of the gap and of s, and `size` is (lx, ly) [m]. `rounds` are the finished
    iterations of the fluid pressure; None if this pressure is ambient everywhere. The gap counts as closed if less
    flows through it than through the small leak.
    """
    filled = 0.0 if rounds is None else rounds.conductivity
    through = conducting(gap, drop, share).astype(np.float64, copy=False)
    flow = solve_flow(through, size, "x", True)
    leaks = max(filled - flow.conductivity, 0.0)
    closed = flow.conductivity <= SMALL * float(np.mean(through**3))
    return {
        "flow_x": 0.0 if closed else flow.conductivity,
        "constriction": 0.0 if closed else flow.constriction,
        "flow_rate": drop.flow_rate(0.0 if closed else flow.conductivity, *size),
        "mass_flow": drop.mass_flow(0.0 if closed else flow.conductivity, *size),
        "error_x": math.nan if closed else flow_mesh_error(through, flow, size, "x", True),
        "error_leak": math.nan if closed else leaks / flow.conductivity,
        "error_rounds": 0.0 if rounds is None or drop.high == drop.low else rounds.error,
        "rounds": 1.0 if rounds is None else float(rounds.count),
        "high_pressure": drop.high,
        "low_pressure": drop.low,
        "fluid_pressure": float(pressure_of(drop, share).mean()),
        "bound": drop.inertial_bound(least_section(gap.astype(np.float64, copy=False), flow, size, "x")),
    }


MOST_ROUNDS = 100  # tuning: limit on the rounds of a step
LEAST_LOAD = 1e-3  # accuracy: least load of the contact over the load, below which the seal lifts off
SHARP = 1e-4  # accuracy: largest tolerance of a contact with a fluid; K is then within 0.1 %
OPEN = 1e-30  # rounding: least open gap [m], as contact has the gap 0


@dataclass(frozen=True)
class SealMemory:
    """Memory of a seal after a step.

    `share` is the map of the share s of the pressure drop, and `gap` the map of the gap [m], 0 in contact. `spare`
    holds two maps for the next step. `pressures` are the high and the low pressure of the fluid [Pa], and `modulus` is
    the modulus of the body in the step; these are 0 before the first step. `flows` is True if the share is known. `end`
    has the time and the load of the lift-off; it is None as long as the seal has not lifted off.
    """

    share: Array
    gap: Array
    spare: tuple[Array, Array]
    pressures: tuple[float, float] = (0.0, 0.0)
    modulus: float = 0.0
    flows: bool = False
    end: Detached | None = None


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
        job, (share, gap) = self.scene.job, memory.spare
        drop = job.section("leakage").drop_at(job.history, step.stage, step.time)
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
        rounds, known, iterations, most = Rounds(drop, self._size), memory.modulus, 0, math.inf
        if isinstance(control, MeanPressure):  # mean pressure of the fluid at which contact still carries a load
            most = (1.0 - LEAST_LOAD) * control.value * trial.alpha * self.scene.units.pressure
        for _ in range(MOST_ROUNDS):
            load = self._press(trial, drop, share, control)
            pasts = PreviousContacts((PreviousPressure(self._start, known),), past.spare, past.approach)
            pressed = replace(trial, effective=self._heights)
            solved = self._dry.solve(pressed, step, load, None, pasts, before, sharp)
            contact, known, iterations = solved.contact, trial.alpha, iterations + solved.contact.iterations
            self._put_gap(self._heights, contact, gap)
            verdict = self._advance(rounds, share, gap, most)
            if contact.failure or verdict.settled or verdict.lifted:
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
        nx = self.slab.nx  # the share in a gap of constant height is linear
        share[...] = memory.share if memory.flows else 1.0 - (np.arange(nx) + 0.5) / nx
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

    def _put_gap(self, heights: Array, contact: Contact, gap: Array) -> None:
        """Put the gap [m] of a contact into a map, 0 where the surfaces touch; local."""
        np.subtract(contact.u, heights, out=gap)
        gap -= contact.d
        gap *= self.scene.units.height
        np.maximum(gap, OPEN, out=gap)
        gap[contact.p > 0.0] = 0.0

    def _advance(self, rounds: Rounds, share: Array, gap: Array, most: float) -> Verdict:
        """Solve for the flow in a gap, and put the share of the next round into a map unless the rounds end;
        collective."""
        found = list[Array]()

        def act(whole: Array, old: Array) -> Verdict:
            verdict, then = rounds.advance(whole, old, most)
            found.append(then)
            return verdict

        verdict = with_whole_maps(self.slab, act, gap, share)
        if not (verdict.settled or verdict.lifted):
            share[...] = self.slab.from_root(found[0] if found else None)
        return verdict

    def _numbers(self, drop: PressureDrop, share: Array, gap: Array, rounds: Rounds | None) -> dict[str, float]:
        """Return the columns of the flow; collective."""

        def act(whole: Array, shares: Array) -> dict[str, float]:
            return seal_flow(whole, drop, shares, self._size, rounds)

        return with_whole_maps(self.slab, act, gap, share)

    def motion(self, solved: SolvedContact[SealMemory], before: Measures, now: Measures) -> EdgeMotion:
        """Return no motion: this law does not limit the motion of edges of contact in a step."""
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
        """Return the memory of a checkpoint. The saved maps have already been read into `memory`."""
        high, low = saved["pressures"].tolist()
        known, flows = float(saved["modulus"]), bool(saved["flows"])
        end = end_in(self.scene.job, saved)
        return replace(memory, pressures=(high, low), modulus=known, flows=flows, end=end)
