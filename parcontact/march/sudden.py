"""Tolerance of a solve that a sudden change follows: of the last step of a stage, or of a steady start.

A solve leaves a displacement that is wrong by as much as its certificate allows. The body keeps it in memory, and holds
the next step to it with the modulus of that step, alpha(dt) (`physics.prony.coefficients`). Where that is far above the
modulus |G| with which the surface passed before, pressures are then wrong by more than the certificate of either solve
says: the corrected area by up to half of it times alpha/|G|, friction by less (a rough surface on the compound
synthetic_tyre, after a jump of velocity by 300). So what comes before is solved the more closely.
"""

import math
from collections.abc import Sequence

import numpy as np

from ..history.chosen import reached
from ..history.timeline import Step
from ..job import Stage
from ..job.checks.cells import along
from ..physics.prony import coefficients, complex_modulus
from ..scene.choices import Choices

ALLOWED = 0.01  # accuracy: over by how much the modulus rises: the tolerance, at most; the area is then right to 0.5 %
LEAST = 1e-4  # accuracy: no smaller tolerance is needed


def tolerance_of_start(chosen: Choices) -> float:
    """Return the largest tolerance of the steady state from which a march starts, infinite where nothing is sudden."""
    initial, following = chosen.job.initial, chosen.job.history[0]
    if following.velocity == initial.velocity and _goes_on("pressure", initial.pressure or 0.0, following):
        return math.inf
    return _tolerance(chosen, _frequency(chosen, initial.velocity, math.inf), 0)


def tolerance_at_end(chosen: Choices, step: Step) -> float:
    """Return the largest tolerance of a step; infinite where it ends no stage, and where nothing sudden follows."""
    spans, following = chosen.timeline.spans, step.stage + 1
    span = spans[step.stage]
    if step.dt == 0.0 or following == len(spans) or not reached(step.time, span.time(span.count)):
        return math.inf
    stage, after = span.stage, spans[following].stage
    if after.velocity == stage.velocity and _goes_on(stage.control, stage.load.end, after):
        return math.inf
    return _tolerance(chosen, _frequency(chosen, stage.velocity, stage.seconds), following)


def _goes_on(control: str, load: float, following: Stage) -> bool:
    return (control, load) == (following.control, following.load.start)


def _frequency(chosen: Choices, velocity: Sequence[float], seconds: float) -> float:
    """Return the frequency [rad/s] with which waves of two cells pass, at rest that of so many seconds."""
    speed = math.hypot(*velocity)
    return math.pi * speed / along((velocity[0], velocity[1]), speed, chosen.grid) if speed else 1.0 / seconds


def _tolerance(chosen: Choices, frequency: float, following: int) -> float:
    """Return the tolerance before the first step of this stage."""
    if not chosen.prony.moduli.size:
        return math.inf
    span = chosen.timeline.spans[following]
    dt = 0.0 if span.jumps else span.ends.interval(1)
    at_once = chosen.prony.modulus_inf + float(coefficients(chosen.prony, chosen.numerics.integrator, dt)[1].sum())
    before = abs(complex(complex_modulus(np.array(frequency), *chosen.prony)))
    return max(LEAST, ALLOWED * before / (at_once - before)) if at_once > before else math.inf
