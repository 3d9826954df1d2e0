"""The contact law of surfaces that attract each other, for periodic and free bodies. Its unknown is the gap.

Under one load there are several equilibria, and the history decides which one is reached. A solve starts from the
last two gaps, extrapolated in time and moved with the surface by whole cells.

The solver of gaps (`gap_solver`) needs the inverse of its operator. `AdhesiveSolver` extends it to a free body, whose
operator A the FFT does not invert. A is replaced by the operator B of a periodic body with the same Green's function up
to half the box (`HalfSpace.gap_operators`), and the pressure p of the pass before gives the difference: each pass
solves for the heights `h - (A - B) p`. One or two passes are usual.

A contact that fills its box may be softer on B than on A, in its mean or in waves that continue across the edges. A
state that is stable on A is then unstable on B, and passes alternate between two states. So if later passes jump or
detach, or MAX_PASSES is reached, the solve restarts with A itself, whose inverse takes some iterations (`FreeInverse`).
Then the energy E of `gap_solver` falls monotonically. Under a given mean pressure P, `p = K (g + h - P A 1) + P` with K
the inverse of A on pressures of mean 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ...contact.problem import Approach, Contact, Control, MeanPressure, Operator, Workspace
from ...job.history import Step
from ...parallel import regrid
from ...parallel.slab import Array, Slab
from ...physics import loops
from ...physics.body import Trial
from ...physics.records import SIDE, Certificate, Entry, Measures, Saved, Units
from ...physics.surface import cells_between
from ..effect import Detached, EdgeMotion, End, PreviousContacts, SolvedContact, end_in, entries_of_end, nothing_holds
from .gap_solver import (
    DUGDALE,
    EXPONENTIAL,
    SHARPER,
    GapOperators,
    GapProblem,
    GapSolution,
    GapSolver,
    Law,
    surface_energy,
)

MAX_STEPS = 100  # accuracy: limit on the steps; a dozen are usual


@dataclass(frozen=True)
class FreeInverse:
    """Inverse of the operator `free` of a free body, by conjugate gradients. The preconditioner is the inverse for the
    periodic body `repeated`. This body has the same Green's function up to half the box, so that a dozen steps give
    five digits.

    The energy of the error is below `tolerance^2` times the energy of the solution. Four `maps` hold intermediate
    results. If `means` is False, the mean of a displacement is ignored, and pressures get the mean 0.
    """

    slab: Slab
    free: Operator
    repeated: GapOperators
    tolerance: float
    maps: tuple[Array, Array, Array, Array]
    means: bool

    def apply(self, field: Array, out: Array) -> Array:
        """Put the pressure that causes the displacement `field` into `out`; collective."""
        r, z, t, image = self.maps
        r[...] = field
        t[...] = self._precondition(r, z)
        size = self._product(r, z)
        goal = self.tolerance**2 * size
        out.fill(0.0)
        for _ in range(MAX_STEPS):
            if not size > goal:
                break
            self.free.apply(t, image)
            step, before = size / self._product(t, image), size
            out += np.multiply(t, step, out=z)
            r -= np.multiply(image, step, out=z)
            size = self._product(r, self._precondition(r, z))
            t *= size / before
            t += z
        return out

    def _precondition(self, r: Array, z: Array) -> Array:
        self.repeated.inverse.apply(r, z)
        if self.means:
            z += self.slab.sum(float(r.sum()))[0] / self.slab.points / self.repeated.least_mean
        return z

    def _product(self, a: Array, b: Array) -> float:
        return self.slab.sum(float(np.vdot(a, b)))[0]


MAX_PASSES = 12  # tuning: limit on passes of a free body before A itself is used; one to three are usual
LEFT = 0.8  # accuracy: tolerance of a solve with A over the tolerance of the run; the rest is for the inverse
DIGITS = 0.01  # accuracy: relative error of the inverse of A, over the tolerance
UNSETTLED = "did not settle in a free box"
LEAST_SHARE, MOST_SHARE = 0.1, 4.0  # tuning: limits on the share of a change of the lagged part that is made


@dataclass
class AdhesiveSolver:
    """Solver of contacts with adhesion. It uses the solver `gaps` for a periodic body. `free` is the operator A of a
    free body; it is None if the body is periodic."""

    gaps: GapSolver
    workspace: Workspace
    tolerance: float
    free: Operator | None = None

    def solve(
        self, problem: GapProblem, gap: Array, free_correction: Array | None, out: Array, loose: float = 1.0
    ) -> tuple[Contact, bool]:
        """Solve, starting from the gap in the map `gap`. Put the solution into the same map, and the pressure into
        `out`; collective.

        `free_correction` is `(A - B) p` of a free body and is updated. `loose` multiplies the tolerance. Return the
        contact, whose displacement is in the workspace, and True if the surfaces have detached.
        """
        tolerance, u = loose * self.tolerance, self.workspace.displacement
        if self.free is None or free_correction is None:
            found = self.gaps.solve(problem, gap, tolerance)
            iterations = found.iterations
            out[...] = found.p
            np.add(gap, problem.heights, out=u)
            u += found.d
        else:
            start = self.workspace.pressure
            start[...] = gap
            found, iterations = self._solve_fixed_point(problem, gap, free_correction, out, tolerance)
            if found.failure:
                gap[...] = start
                found = self._solve_free(problem, gap, free_correction, out, tolerance)
                iterations += found.iterations
        return Contact(out, u, found.d, found.certificate, iterations, found.failure), found.detached

    def _solve_fixed_point(
        self, problem: GapProblem, gap: Array, free_correction: Array, out: Array, tolerance: float
    ) -> tuple[GapSolution, int]:
        """Repeat the solve of a free body until `free_correction` is constant. Return the solution, with a failure if
        it does not settle, and the iterations of all passes; collective."""
        iterations, share, last = 0, 1.0, free_correction
        for passes in range(1, MAX_PASSES + 1):
            lagged = problem._replace(heights=problem.heights - free_correction)
            found = self.gaps.solve(lagged, gap, tolerance)
            iterations += found.iterations
            found, change, worst = self._compare(problem, gap, found, out)
            share = self._share(share, out, change, last) if passes > 1 else 1.0
            last = change
            free_correction += share * change
            if found.failure or worst <= tolerance or (found.detached and passes == 1):
                return found, iterations
            if passes > 1 and (found.jumped or found.detached):
                break
        return replace(found, failure=UNSETTLED), iterations

    def _solve_free(
        self, problem: GapProblem, gap: Array, free_correction: Array, out: Array, tolerance: float
    ) -> GapSolution:
        """Solve with the operator of the free body and update `free_correction`; collective."""
        assert self.free is not None
        work, repeated, (law, heights, control) = self.workspace, self.gaps.operators, problem
        maps = (work.pressure, work.displacement, work.other_displacement, free_correction)  # all in double precision
        inverse = FreeInverse(work.slab, self.free, repeated, DIGITS * tolerance, maps, isinstance(control, Approach))
        operators = repeated._replace(operator=self.free, inverse=inverse)
        if isinstance(control, Approach):
            operators = operators._replace(mean=math.inf, least_mean=math.inf)
            moved = GapProblem(law, heights + control.value, Approach(0.0))
            found = replace(self.gaps.solve(moved, gap, LEFT * tolerance, operators), d=control.value)
        else:
            work.displacement.fill(1.0)
            lifted = heights - control.value * self.free.apply(work.displacement, work.displacement)
            found = self.gaps.solve(GapProblem(law, lifted, control), gap, LEFT * tolerance, operators)
        found, _, worst = self._compare(problem, gap, found, out)
        repeated.operator.apply(out, free_correction)
        np.subtract(work.displacement, free_correction, out=free_correction)
        if not found.failure and worst > tolerance:
            asked = f"changes are {worst:.3g} where {tolerance:.3g} was asked for"
            return replace(found, failure=f"{UNSETTLED}: {asked}")
        return found

    def _compare(
        self, problem: GapProblem, gap: Array, found: GapSolution, out: Array
    ) -> tuple[GapSolution, Array, float]:
        """Put the pressure into `out`; collective. Return the solution with its error on the free body in the
        certificate, the displacement of the free body minus that of the solution, and the size of this difference
        without a change of the approach."""
        assert self.free is not None
        out[...] = found.p
        change = self.free.apply(out, self.workspace.displacement) - (problem.heights + gap)
        change -= found.d
        certificate, slab, weight = found.certificate, self.workspace.slab, np.abs(out)
        load, sum_change = slab.sum(float(weight.sum()), float(np.vdot(weight, change)))
        shift = sum_change / load if isinstance(problem.control, MeanPressure) and load > 0.0 else 0.0
        (wrong,) = slab.sum(float(np.vdot(weight, np.abs(change - shift))))
        worst = SHARPER * wrong / load / certificate.length if load > 0.0 else 0.0
        certificate = replace(certificate, complementarity=max(certificate.complementarity, worst))
        return replace(found, certificate=certificate, d=found.d + shift), change, worst

    def _share(self, share: float, p: Array, change: Array, last: Array) -> float:
        """Return the share of a change to make: Aitken's extrapolation of the last two, weighted by the pressure;
        collective."""
        weight, difference = np.abs(p), change - last
        along = float((weight * last * difference).sum())
        along, size = self.workspace.slab.sum(along, float((weight * difference**2).sum()))
        wanted = -share * along / size if size > 0.0 else 1.0
        return min(max(wanted, LEAST_SHARE), MOST_SHARE)


JUMP_STRIDE = 1.0 / 8.0  # accuracy: longest part of a jump that is solved at once
LEAST_STRIDE = 1.0 / 16.0  # accuracy: shortest part of these, and of a step
PART_TOLERANCE = 0.05  # tuning: tolerance of all parts of a step except the last
OPEN = 10.0  # physics: gap of detached surfaces over the range
LEAST_LOAD = 1e-9  # accuracy: least load over all tension, and over the strength of a point
LEAST_TENSION = 1e-2  # physics: least tension over the strength in the area under tension


class PastGap(NamedTuple):
    """The map of the gap after a step, and the position of the surface [m]. `known` is False as long as the map
    contains no gap, as before the first step."""

    gap: Array
    position: tuple[float, float] = (0.0, 0.0)
    known: bool = False


@dataclass(frozen=True)
class AdhesiveMemory:
    """Memory of a contact with adhesion: maps of the gap.

    `pasts` are the gaps after the last two steps, the newest first. `spare` receives the gap of the next step, and
    `gap_backup` the gap at the last equilibrium within this step. `free_correction` is `(A - B) p` (see the module) of
    the last solve of a free body; it is None for a periodic body. `modulus` is the modulus of that step, by which p is
    multiplied to get the pressure. `end` holds the time and the load of the detachment; it is None as long as the
    surfaces have not detached.
    """

    pasts: tuple[PastGap, PastGap]
    spare: Array
    gap_backup: Array
    free_correction: Array | None
    modulus: float = 0.0
    end: Detached | None = None


@dataclass(frozen=True)
class LoadPath:
    """Path of the prescribed load from the last step to the present step. The load is an approach or a mean pressure,
    in the run's units for a body of modulus 1.

    The load is `before` at the last step, and `control` at the present step. `approach` and `pressure` are the approach
    and the mean pressure of the last step. `closes_gap_first` is True for a compressive load on detached surfaces: they
    are first moved together until they touch.
    """

    before: float
    control: Control
    approach: float
    pressure: float
    closes_gap_first: bool = False

    def at(self, share: float) -> Control:
        """Return the prescribed load at a `share` of the path, 0 to 1; exact at its end."""
        if share == 1.0:
            return self.control
        return replace(self.control, value=self.before + share * (self.control.value - self.before))


class _Walk(NamedTuple):
    """Result of solving along the path of a load: the last contact, True if it is `detached`, True if it has `snapped`,
    and approaches and mean pressures of all equilibria on the path, in the run's units, if energies are requested."""

    contact: Contact
    detached: bool
    snapped: bool
    equilibria: list[tuple[float, float]]

    @property
    def work(self) -> float:
        """Mean work of the load per area along the path, by the trapezoidal rule."""
        return sum(0.5 * (p + p_next) * (d_next - d) for (d, p), (d_next, p_next) in pairwise(self.equilibria))


class AdhesiveLaw:
    """Contact law of a run whose job has the section `adhesion` (`effects.effect.ContactLaw`). `attraction` is the law
    of attraction of the job, an `effect.AdhesionLaw`."""

    may_shorten = True

    def __init__(self, scene: Any, attraction: Any) -> None:
        setup, numerics = scene.setup, scene.choices.numerics
        by_gap = GapOperators(*setup.half_space.gap_operators(setup.fft))
        gaps = GapSolver(setup.slab, by_gap, numerics.max_iterations)
        free = scene.operators.operator if scene.choices.isolated.on else None
        self.solver = AdhesiveSolver(gaps, scene.solver.workspace, numerics.tolerance, free)
        self.scene, self.slab, self.grid = scene, setup.slab, scene.choices.grid
        self._goes_on_open = scene.job.section("adhesion").detached == "open"
        self._attraction = attraction

    def law(self, alpha: float) -> Law:
        """Return the law of attraction for a step with the modulus alpha: in the run's units, with its strength divided
        by alpha."""
        law = self._attraction
        kind, unit = DUGDALE if law.kind == "dugdale" else EXPONENTIAL, self.scene.units.height
        return Law(kind, law.strength / (alpha * self.scene.units.pressure), law.range / unit, law.ramp / unit)

    # -- a step --------------------------------------------------------------------------------------------------------

    def solve(
        self,
        trial: Trial,
        step: Step,
        control: Control,
        memory: AdhesiveMemory,
        past: PreviousContacts,
        before: Measures,
        tolerance: float | None,
    ) -> SolvedContact[AdhesiveMemory]:
        """Solve the contact of a step from the last gap; see `effects.effect.ContactLaw.solve`. Solves use the job's
        tolerance. If no equilibrium exists and the job has `detached: open`, the surfaces are moved far from each
        other."""
        law, path = self.law(trial.alpha), self._path(trial, control, past, before)
        walk = self._walk(law, memory, step, trial, path, past.spare)
        contact, gap = walk.contact, memory.spare
        last, changed = memory.pasts[0], 0.0
        pasts = PastGap(gap, step.position, True), last
        now = AdhesiveMemory(pasts, memory.pasts[1].gap, memory.gap_backup, memory.free_correction, trial.alpha)
        if last.known:
            changed = self.slab.sum(float(np.count_nonzero((last.gap == 0.0) != (gap == 0.0))))[0]
        end: End = "detached" if walk.detached else "equilibrium"
        snapped, remark = walk.snapped, ""
        if walk.detached and self._goes_on_open:
            contact, now = self._open_up(contact, now, law, trial)
            separate = before.contact_area == before.pressure == 0.0
            end, snapped = ("open", False) if separate else ("opened", snapped)
            remark = "" if separate else nothing_holds(step.control, step.load)
        numbers = self._tension(law, contact.p, trial.alpha) | {"points_changed": changed}
        if self.scene.energy is not None:
            sum_gamma = 0.0 if walk.detached else self.slab.sum(surface_energy(law, gap))[0]
            numbers["surface_energy"] = sum_gamma * trial.alpha * self.scene.energy.unit
            numbers["work_of_load"] = walk.work * self.slab.points * trial.alpha * self.scene.energy.unit
            numbers["leaves_equilibrium"] = float(walk.detached or path.closes_gap_first)
        pull = numbers["adhesive_force"]
        least_load = self._least_load(law, trial.alpha, control, contact.p, pull)
        return SolvedContact(contact, now, now.pasts[0].gap == 0.0, numbers, pull, least_load, end, snapped, remark)

    def _walk(
        self, law: Law, memory: AdhesiveMemory, step: Step, trial: Trial, path: LoadPath, pressure: Array
    ) -> _Walk:
        """Solve along the path of the load up to its end, with gap and pressure in maps; collective.

        A jump is solved in parts, so that it does not pass over an equilibrium. A step that fails or detaches is
        solved in parts, too, and accepted as it is if the shortest parts do not help.
        """
        gap, correction = memory.spare, memory.free_correction
        if correction is not None and memory.modulus:
            correction *= memory.modulus / trial.alpha
        whole = JUMP_STRIDE if step.jump else 1.0
        self._start(memory, step, trial, path, gap, still=step.jump)
        reached, stride, iterations, backup, snapped = 0.0, whole, 0, memory.gap_backup, False
        equilibria = [(path.approach, path.pressure)]
        while True:
            share = min(reached + stride, 1.0)
            loose = 1.0 if share == 1.0 else max(1.0, PART_TOLERANCE / self.scene.choices.numerics.tolerance)
            problem = GapProblem(law, trial.effective, path.at(share))
            contact, detached = self.solver.solve(problem, gap, correction, pressure, loose)
            iterations += contact.iterations
            hard = detached or (bool(contact.failure) and share == 1.0)
            if hard and stride > LEAST_STRIDE * whole:
                if reached == 0.0:
                    self._start(memory, step, trial, path, gap, still=True)
                else:
                    gap[...] = backup
                stride *= 0.5
                continue
            if not (detached or path.closes_gap_first or self.scene.energy is None):
                equilibria.append((contact.d, self.slab.sum(float(contact.p.sum()))[0] / self.slab.points))
            snapped |= hard and memory.pasts[0].known
            if detached or share == 1.0:
                return _Walk(replace(contact, iterations=iterations), detached, snapped, equilibria)
            reached = share
            backup[...] = gap

    def motion(self, solved: SolvedContact[AdhesiveMemory], before: Measures, now: Measures) -> EdgeMotion:
        """Return by how much the edges of contact have moved in a step, in half process zones.

        In cells, the motion is the number of points that entered or left the contact, divided by the length of the
        edges. This length is pi/4 of the number of cell sides along the edges. The step is `untouched` if the loads
        before and after the step are within the error of the solver.
        """
        least = LEAST_LOAD * self._attraction.strength
        separate = not (before.contact_area or now.contact_area or solved.numbers["tensile_area"])
        if separate or (not solved.loaded and max(before.max_pressure, -before.pressure) <= least):
            return EdgeMotion(0.0, True)
        begins = (before.contact_area == 0.0) != (now.contact_area == 0.0)
        excess = max(each.contact_area - each.contact_area_corrected for each in (before, now))
        sides = excess * self.slab.points / SIDE
        if sides <= 0.0:
            return EdgeMotion(begins=begins)
        moved = solved.numbers["points_changed"] / (0.25 * math.pi * sides) * self._attraction.cell
        zone = self._attraction.zone
        return EdgeMotion(2.0 * moved / zone if zone > 0.0 else 0.0, begins=begins)

    def _path(self, trial: Trial, control: Control, past: PreviousContacts, before: Measures) -> LoadPath:
        """Return the path of the prescribed load since the last step, in the run's units."""
        pressure = before.pressure / (trial.alpha * self.scene.units.pressure)
        if isinstance(control, MeanPressure):
            closes = control.value >= 0.0 and before.contact_area == 0.0
            return LoadPath(0.0 if closes else pressure, control, past.approach, pressure, closes)
        # before the first contact the surfaces were not closer
        approach = past.approach if past.last.alpha else min(past.approach, control.value)
        return LoadPath(approach, control, approach, pressure)

    def _start(
        self, memory: AdhesiveMemory, step: Step, trial: Trial, path: LoadPath, out: Array, still: bool = False
    ) -> None:
        """Put the start of a step into a map: the extrapolated gap, or the last one if `still`; collective. Before the
        first step it is the gap of an undeformed body, at the approach, or where the surface touches."""
        now, before = memory.pasts
        if not now.known:
            control = path.at(0.0 if still else 1.0)
            highest = self._highest(trial)
            np.maximum(-trial.effective - (control.value if isinstance(control, Approach) else -highest), 0.0, out=out)
            return
        growth = step.growth if before.known and not still else 0.0
        cells = cells_between(now.position, step.position, (self.grid.dx, self.grid.dy))
        along_x, along_y = (round(moved) % count for moved, count in zip(cells, self.grid.points, strict=True))
        older = before.gap
        if along_y and growth > 0.0:
            older = regrid.roll_rows(self.slab, before.gap, along_y, out)
        loops.travel(now.gap, older, 1.0 + growth, growth, along_x, 0.0, np.inf, out)
        if along_y:
            out[...] = regrid.roll_rows(self.slab, out, along_y, self.scene.solver.workspace.pressure)
        if path.closes_gap_first:
            out += self.slab.reduce((), [-float(out.min(initial=np.inf))])[0]

    def _open_up(
        self, contact: Contact, memory: AdhesiveMemory, law: Law, trial: Trial
    ) -> tuple[Contact, AdhesiveMemory]:
        """Return the contact with the surfaces far from each other, and its memory; collective."""
        now, before = memory.pasts
        contact.p.fill(0.0)
        contact.u.fill(0.0)
        d = -self._highest(trial) - OPEN * law.range
        np.subtract(-d, trial.effective, out=now.gap)
        if memory.free_correction is not None:
            memory.free_correction.fill(0.0)
        memory = replace(memory, pasts=(now, before._replace(known=False)))
        return replace(contact, d=d, failure="", certificate=Certificate(0.0, 0.0, 0.0)), memory

    def _highest(self, trial: Trial) -> float:
        return self.slab.reduce((), [float(trial.effective.max(initial=-np.inf))])[0]

    def _tension(self, law: Law, p: Array, alpha: float) -> dict[str, float]:
        """Return the share of points under tension and the force of all tension [N]; collective."""
        tense = float(np.count_nonzero(p < -LEAST_TENSION * law.strength))
        count, pull = self.slab.sum(tense, float(np.maximum(-p, 0.0).sum()))
        unit = alpha * self.scene.units.pressure * self.grid.lx * self.grid.ly / self.slab.points
        return {"tensile_area": count / self.slab.points, "adhesive_force": pull * unit}

    def _least_load(self, law: Law, alpha: float, control: Control, p: Array, pull: float) -> float:
        """Return the largest load [N] that may be an error of the solver; collective. It is a share of all tension and
        of the strength of one point, and infinite if no point has more pressure or tension than this."""
        largest = self.slab.reduce((), [float(np.abs(p).max(initial=0.0))])[0]
        least = LEAST_LOAD * law.strength
        unloaded = isinstance(control, MeanPressure) and abs(control.value) * self.slab.points <= least
        if largest <= (LEAST_TENSION * law.strength if unloaded else least):
            return math.inf
        point = self.grid.lx * self.grid.ly / self.slab.points
        return LEAST_LOAD * max(pull, law.strength * alpha * self.scene.units.pressure * point)

    # -- as a part of the run ------------------------------------------------------------------------------------------

    def gap(self, memory: AdhesiveMemory) -> Array | None:
        """Return the map of the last gap, None before the first step."""
        return memory.pasts[0].gap if memory.pasts[0].known else None

    def detached(self, memory: AdhesiveMemory) -> Detached | None:
        """Return time and load of the detachment; None before it."""
        return memory.end

    def with_end(self, memory: AdhesiveMemory, end: Detached) -> AdhesiveMemory:
        """Return the memory with the detachment `end` added."""
        return replace(memory, end=end)

    def at_rest(self) -> AdhesiveMemory:
        """Return the memory before the first step, in new maps."""
        correction = self.slab.zeros() if self.scene.choices.isolated.on else None
        pasts = PastGap(self.slab.zeros()), PastGap(self.slab.zeros())
        return AdhesiveMemory(pasts, self.slab.zeros(), self.slab.zeros(), correction)

    def entries(self, memory: AdhesiveMemory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries: the gaps, the positions of the surface, and the detachment."""
        now, before = memory.pasts
        found = {
            "gap": Entry(now.gap, units.height, "m"),
            "earlier gap": Entry(before.gap, units.height, "m"),
            "position": Entry(np.array(now.position), 1.0, "m"),
            "earlier position": Entry(np.array(before.position), 1.0, "m"),
            "gap is known": Entry(float(now.known)),
            "earlier gap is known": Entry(float(before.known)),
            "modulus": Entry(memory.modulus, units.modulus, "Pa"),
            **entries_of_end(memory.end, self.scene.job),
        }
        if memory.free_correction is None:
            return found
        return {**found, "free correction": Entry(memory.free_correction, units.height, "m")}

    def restored(self, memory: AdhesiveMemory, saved: Saved) -> AdhesiveMemory:
        """Return the memory of a checkpoint. The saved maps have already been read into `memory`."""
        now, before = (
            PastGap(past.gap, _place(saved[f"{age}position"]), bool(saved[f"{age}gap is known"]))
            for age, past in zip(("", "earlier "), memory.pasts, strict=True)
        )
        end = end_of(self.scene.job, saved)
        return replace(memory, pasts=(now, before), modulus=float(saved["modulus"]), end=end)


def end_of(job: Any, saved: Saved) -> Detached | None:
    """Return the time and the load of the detachment in a checkpoint. Return None if there was no detachment, if the
    job continues after a detachment, or if the checkpoint belongs to a job with another history."""
    section = job.section("adhesion")
    return None if section is None or section.detached == "open" else end_in(job, saved)


def _place(saved: Array) -> tuple[float, float]:
    x, y = saved.tolist()
    return x, y
