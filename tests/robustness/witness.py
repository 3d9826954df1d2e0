"""What must hold after every step of a scene, and between two tellings of it."""

import math
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import numpy as np
from mpi4py import MPI

from parcontact.errors import RunError
from parcontact.files.recorder import StepRow
from parcontact.job import history
from parcontact.job.history import Step, Timeline
from parcontact.march import scene
from parcontact.march.laws import StepError
from parcontact.march.loop import March, run_steps
from parcontact.parallel.slab import Array, Slab

from . import scenes, twins
from .scenes import Sketch

EPS = float(np.finfo(float).eps)
ROUNDINGS = 64  # that a number may be off by, of the largest it is a difference of
LOAD = 1e-12  # relative, of the sum over all points
ENERGY = 1e-10  # relative, of sums over all steps: the weights of very short steps have ten digits


@dataclass
class Scales:
    """The largest sizes so far, to judge roundings by: lengths [m] (heights and displacements), energy [J], and force
    [N], with the rounding of heights felt by the stiffest modulus and not by that of the step."""

    length: float = 0.0
    certified: float = 0.0  # the length of a certificate [m]: what a step got wrong is remembered by the next
    energy: float = 0.0
    force: float = 0.0


@dataclass
class Witness:
    """Marches a scene to its end, or to the first step that fails, and writes down what was not as it must be.

    `pressures` [Pa] are this rank's, a map for the number of each step; `blurs` [Pa m] say how far apart two solutions
    may be, see `distance`; `last` is the row of the last step. `failure` is what the step that failed said, `beyond`
    whether it asks for more digits than a number has.
    """

    march: March
    violations: list[str] = field(default_factory=list)
    pressures: dict[int, Array] = field(default_factory=dict)
    blurs: dict[int, tuple[float, float]] = field(default_factory=dict)
    failure: str = ""
    beyond: bool = False
    iterations: int = 0
    last: StepRow = field(default_factory=StepRow)
    scales: Scales = field(default_factory=Scales)

    @property
    def steps(self) -> int:
        return len(self.blurs)

    @property
    def retries(self) -> int:
        return self.march.scene.slab.tally["retry"]

    def see(self) -> "Witness":
        """To the end; collective."""
        job = self.march.scene.job
        timeline = Timeline.from_job(job)
        try:
            run_steps(self.march, [lambda march: self._note(timeline, march.row)])
        except RunError as error:
            self.failure, self.beyond = str(error), isinstance(error, StepError) and error.beyond_precision
        return self

    def _note(self, timeline: history.Timeline, row: StepRow) -> None:
        if row.step:
            step = timeline[row.step]
            self.iterations = max(self.iterations, row.iterations)
            self.pressures[row.step] = self.march.field("pressure")
            for broken, sentence in [*self._contact(step), *self._energy(), *self._numbers()]:
                if broken:
                    self.violations.append(f"step {step.number} (dt = {step.dt:g} s): {sentence}")
            self.blurs[row.step] = self._blur()
        self.last = row

    # -- what must hold ------------------------------------------------------------------------------------------------

    def _contact(self, step: Step) -> Iterator[tuple[bool, str]]:
        """From the maps as a user gets them: no tension, no penetration and no gap under pressure beyond the
        certificate, the load met."""
        march, grid = self.march, self.march.scene.job.grid
        slab, numerics = march.scene.slab, march.scene.job.numerics
        p, u, gap = (march.field(name) for name in ("pressure", "displacement", "gap"))
        finite = all(np.isfinite(values).all() for values in (p, u, gap))
        heights = march.scene.motion.at(step.position).base * march.scene.units.height
        load, wrong, tension, deepest, *sizes, infinite = slab.reduce(
            [float(p.sum()), float((p * np.abs(gap)).sum())],
            [*(float(a.max(initial=0.0)) for a in (-p, -gap, np.abs(u), np.abs(heights))), float(not finite)],
        )
        self.scales.length = max(self.scales.length, *sizes)
        allowed = numerics.tolerance * self._length() * (1 + 1e-6) + ROUNDINGS * EPS * self.scales.length
        mean = {"pressure": step.load, "force": step.load / (grid.lx * grid.ly)}.get(step.control)
        found = load / slab.points
        yield infinite > 0.0, "a map is not finite"
        yield tension > 0.0, f"tension of {tension:g} Pa"
        yield not deepest <= allowed, f"penetration of {deepest:g} m where {allowed:g} m is certified"
        yield (
            not wrong <= allowed * load,
            f"gap under pressure of {wrong / (load or 1):g} m where {allowed:g} m is allowed",
        )
        yield (
            mean is not None and not abs(found - mean) <= LOAD * mean,
            f"mean pressure {found!r} instead of {mean!r} Pa",
        )

    def _energy(self) -> Iterator[tuple[bool, str]]:
        """Nothing is gained: energies are not negative and no branch gives back what it has dissipated. With the
        integrator that knows the motion within a step, work is what is stored and what is dissipated."""
        row, scene, scales = self.march.row, self.march.scene, self.scales
        if scene.energy is None:
            return
        lost = [b - a for a, b in zip(self.last.branch_dissipation, row.branch_dissipation, strict=True)]
        grid, prony = scene.job.grid, scene.setup.prony
        stiffest = prony.modulus_inf + float(prony.moduli.sum())
        scales.energy = max(scales.energy, abs(row.work), abs(row.stored), abs(row.dissipated))
        load, alpha = row.measures.pressure * grid.lx * grid.ly, self.march.state.contact.last.alpha
        scales.force = max(scales.force, load * stiffest / alpha)
        slack = ENERGY * scales.energy + ROUNDINGS * EPS * scales.length * scales.force
        sums = f"work {row.work:g}, stored {row.stored:g}, dissipated {row.dissipated:g} J"
        closes = scene.job.numerics.integrator == "exponential"
        yield min(row.stored, row.dissipated) < -slack, f"negative energy: {sums}"
        yield min(lost, default=0.0) < -slack, f"a branch gives back {-min(lost, default=0.0):g} J: {sums}"
        yield closes and not abs(row.work - row.stored - row.dissipated) <= slack, f"energy is lost: {sums}"

    def _numbers(self) -> Iterator[tuple[bool, str]]:
        row, tolerance = self.march.row, self.march.scene.job.numerics.tolerance
        numbers = list(vars(row.measures).values())
        if self.march.scene.energy is not None:
            numbers += [row.work, row.stored, row.dissipated, *row.branch_dissipation]
        yield not all(map(math.isfinite, numbers)), f"a number is not finite: {row}"
        yield not 0.0 <= row.measures.contact_area <= 1.0, f"contact area {row.measures.contact_area}"
        yield not row.certificate.worst <= tolerance, f"{row.certificate} where {tolerance:g} was asked for"

    # -- how exact it can be -------------------------------------------------------------------------------------------

    def _length(self) -> float:
        """What the certificate compares gaps with [m]; without contact the surface's height."""
        length, scene = self.march.row.certificate.length, self.march.scene
        return scene.setup.height if math.isnan(length) else length * scene.units.height

    def _blur(self) -> tuple[float, float]:
        scene, modulus = self.march.scene, self.march.state.contact.last.alpha * self.march.scene.units.modulus
        self.scales.certified = max(self.scales.certified, self._length())
        return 2.0 * scene.job.numerics.tolerance * self.scales.certified * modulus, 2.0 * self.scales.length * modulus


def distance(one: Witness, other: Witness, stated: Callable[[Array], Array]) -> float:
    """How far apart the pressures of two witnesses are, the largest of all steps, over what certificates allow.

    Two pressures p of the same load or approach with gaps g that meet the certificate (complementarity and penetration
    below c H, H the length of the certificates) obey, for a body of modulus alpha and the operator A of modulus 1,

        <p1 - p2, A (p1 - p2)> = alpha <p1 - p2, g1 - g2> <= 2 c H alpha (sum p1 + sum p2).

    That is for one solve; what a history adds is much less than this bound leaves. If one of them has folded branches,
    displacements are wrong by the bound that it gives, times the largest length, and gaps with them.
    """
    folded, largest = abs(one.march.scene.folded.bound - other.march.scene.folded.bound), 0.0
    for step in one.pressures.keys() & other.pressures.keys():
        p, q = one.pressures[step], stated(other.pressures[step])
        certified, by_folding = one.blurs[step]
        allowed = (certified + folded * by_folding) * one.march.scene.slab.sum(float(p.sum() + q.sum()))[0]
        apart = energy_of(one.march, p - q)
        if apart > 0.0:
            largest = max(largest, apart / allowed)
    return largest


def energy_of(march: March, pressure: Array) -> float:
    """`<p, A p>` of a map of pressures [Pa]; collective."""
    scene = march.scene
    moved = scene.operators.operator.apply(np.ascontiguousarray(pressure), np.empty(scene.slab.shape))
    return scene.slab.sum(float((pressure * moved).sum()))[0] * scene.units.length


# -- one random scene and its twin, marched and compared --------------------------------------------------------------


@dataclass(frozen=True)
class Trial:
    """What came of a scene: sentences about what must not be, and numbers to count."""

    sketch: Sketch
    twin: str
    violations: list[str]
    failures: list[str]
    counts: Counter[str]
    iterations: int
    distance: float

    @property
    def about(self) -> str:
        ny, nx = self.sketch.heights.shape
        x, y = self.sketch.size
        numerics = " ".join(str(value) for value in self.sketch.numerics.values())
        return f"{nx} x {ny} points, {x:.2g} x {y:.2g} m, {self.sketch.boundary}, {numerics}; {self.twin}"


def witness(sketch: Sketch, directory: Path, comm: MPI.Intracomm = MPI.COMM_SELF) -> Witness:
    """A witness of the whole scene; its heights pass through a file in `directory`, each rank's own; collective."""
    job = sketch.job(directory)
    return Witness(March(scene.build(job, Slab(comm, *job.grid.points)))).see()


def trial(dice: Random, directory: Path, stages: int = 6) -> Trial:
    """March a random scene and the same described in another way."""
    sketch = scenes.sketch(dice, stages)
    twin = twins.twin(dice, sketch)
    one, other = witness(sketch, directory), witness(twin.sketch, directory)
    apart = distance(one, other, twin.stated)
    violations = [*one.violations, *(f"{twin.name}: {sentence}" for sentence in other.violations)]
    alike = {
        step: np.array_equal(p, twin.stated(other.pressures[step]))
        for step, p in one.pressures.items()
        if step in other.pressures
    }
    if twin.exact and not (len(alike) == one.steps == other.steps and all(alike.values())):
        violations.append(f"{twin.name}: not the same to the last bit, {apart:g} of what certificates allow apart")
    if not apart <= 1.0:
        violations.append(f"{twin.name}: {apart:g} of what certificates allow apart")
    both = (one, other)
    counts = Counter(
        steps=one.steps + other.steps,
        retries=one.retries + other.retries,
        beyond=sum(bool(w.failure) and w.beyond for w in both),
        failed=sum(bool(w.failure) and not w.beyond for w in both),
        violations=len(violations),
    )
    failures = [w.failure for w in both if w.failure]
    return Trial(sketch, twin.name, violations, failures, counts, max(w.iterations for w in both), apart)
