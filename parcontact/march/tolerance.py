"""The tolerance of a step's solve, from what the last steps have shown of the error that solves make.

`numerics.tolerance` is chosen for the worst scene. Where `numerics.accuracy` has chosen it, solves of steps may have a
larger one, such that the error of friction by the solver is SHARES of the accuracy that is asked for, and no more than
what time steps, folded branches and mesh leave of it; where these make more than is asked for, SHARES of what they
make. That of the area likewise. Errors go with the certificate that a solve has reached, and a mean over the last
steps tells in which proportion. It is a power of the root of two times the job's tolerance, so that rounding has no
part in it, and part of the state: a run goes on as if it had never stopped.

The last solve before a change of velocity or load is a close one, and so is a steady start. The body remembers a
displacement that is as wrong as the certificate allows. After the change it is held to this with the modulus of the
first step, which may be far above the one with which the surface passed before: on the compound synthetic_tyre,
300 times as fast, forty times.

The last step of a stage seldom moves the surface by whole cells. Its start is then worse than those of the steps before
it, from which its tolerance was learnt.
"""

import math
from dataclasses import dataclass

from ..accuracy.budget import ErrorBudget, Parts
from ..history.chosen import reached
from ..history.timeline import Step
from ..job.sections.calculation import Accuracy
from ..physics.entries import Entry, Saved
from ..physics.units import Units
from ..scene import Scene
from ..scene.choices import Choices
from ..solve.contact import Contact

SHARES = 0.1, 0.4  # accuracy: of the error of friction and of that of the area, for the solver; the latter is less by
# half and more than is estimated
MOST = 8.0  # accuracy: times the job's tolerance, at most
LOOSEST = 0.05  # accuracy: the largest tolerance, with which single steps may be wrong by a few times the mean
CLOSE = 2.5e-4  # accuracy: before a change, if the tolerance is not smaller: 1 % over a rise of the modulus by 40
FIRST = 0.01  # accuracy: in the first step of a stage, and in the last, which is seldom of whole cells, at most
NEWEST = 0.25  # tuning: weight of the last step in the mean
NAME = "mean logarithm"  # in a checkpoint


@dataclass(frozen=True)
class StepTolerance:
    """Memory of the tolerance that steps may have over that of the job, the mean over the last ones of its logarithm
    to the base 2."""

    mean: float = 0.0

    def of(self, scene: Scene, step: Step) -> float | None:
        """Return the tolerance of the solve of a step, None where it is that of the job, as it is in a jump. Before a
        change and in the first and last step of a stage it is smaller."""
        own = scene.choices.numerics.tolerance
        if step.dt == 0.0:
            return None
        ends = _ends_stage(scene.choices, step)
        most = tolerance_before(scene.choices, step.stage + 1) if ends else math.inf
        if (step.growth == 0.0 or ends) and scene.material.branched is not None:
            most = min(most, FIRST)
        if not follows(scene):
            return most if most < own else None
        return float(min(own * 2.0 ** (0.5 * round(2.0 * self.mean)), max(LOOSEST, own), most))

    def after(self, scene: Scene, contact: Contact, budget: ErrorBudget | None) -> "StepTolerance":
        numerics, reached = scene.choices.numerics, contact.certificate.worst
        if not follows(scene) or budget is None or reached <= 0.0:
            return self
        ratio = reached * _room(budget, numerics.asked) / numerics.tolerance
        now = min(max(math.log2(ratio) if ratio > 0.0 else 0.0, 0.0), math.log2(MOST))
        return StepTolerance(self.mean + NEWEST * (now - self.mean))


class TolerancePart:
    """The tolerance of solves; with a checkpoint that lacks it all is to be learnt again."""

    def at_rest(self) -> StepTolerance:
        return StepTolerance()

    def entries(self, memory: StepTolerance, units: Units) -> dict[str, Entry]:
        return {NAME: Entry(memory.mean, optional=True)}

    def restored(self, memory: StepTolerance, saved: Saved) -> StepTolerance:
        return StepTolerance(float(saved[NAME])) if NAME in saved else StepTolerance()


def tolerance_before(chosen: Choices, stage: int) -> float:
    """Return the largest tolerance of the solve before a stage: CLOSE where velocity, control or load change there and
    the body relaxes, else infinite."""
    history, start = chosen.timeline.history, chosen.job.initial
    if stage == len(history) or not chosen.prony.moduli.size:
        return math.inf
    before = start.velocity, "pressure", start.pressure or 0.0
    if stage:
        before = history[stage - 1].velocity, history[stage - 1].control, history[stage - 1].load.end
    after = history[stage].velocity, history[stage].control, history[stage].load.start
    return math.inf if before == after else CLOSE


def _ends_stage(chosen: Choices, step: Step) -> bool:
    span = chosen.timeline.spans[step.stage]
    return step.dt > 0.0 and reached(step.time, span.time(span.count))


def follows(scene: Scene) -> bool:
    """Return whether the tolerance of steps follows the error budget: where `numerics.accuracy` has chosen that of the
    job, and stages last. Contacts with adhesion are solved to that of the job."""
    choices = scene.choices
    return "tolerance" in choices.numerics.chosen and choices.timeline.lasts and choices.adhesion is None


def _room(budget: ErrorBudget, asked: Accuracy) -> float:
    """Return how many times the error by the solver may be; infinite where it makes none."""
    parts = (budget.friction, asked.friction), (budget.area, asked.area)
    both = zip(parts, SHARES, strict=True)
    return min(_room_of(each, accuracy, share) for (each, accuracy), share in both if each is not None)


def _room_of(parts: Parts, accuracy: float, share: float) -> float:
    rest = parts.total - parts.solver
    allowed = min(share * accuracy, accuracy - rest) if rest < accuracy else share * rest
    return allowed / parts.solver if parts.solver > 0.0 else math.inf
