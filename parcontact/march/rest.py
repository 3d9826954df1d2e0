"""At rest under a constant load: once the body has relaxed, or at once if it has no memory, one step ends the stage.

Were the displacement u kept from now on, the branches would after the time t lack

    sum_k (1 - exp(-t/tau_k)) h_k     out of     A p = G_inf u + sum_k h_k.

Over the modulus that is left then, `G(t) = G_inf + sum_k G_k exp(-t/tau_k)`, this is a displacement; it grows with t.
Where it is below SHARE of the tolerance, the contact of now also meets the conditions of every instant up to t, and
neither displacements nor `A p/G` change by much more: in the norm of the elastic energy a contact follows its heights
without enlarging their differences, of which the past weighs `1 - G(t)/alpha` at most.

Only stages whose time steps grow are ended so: who gives one time step asks for a row at each.
"""

import math
from collections.abc import Iterator

from ..history.timeline import Span, Step, Timeline
from ..parallel.slab import Array
from ..physics.body import ZenerBody
from .choosing import StepChooser
from .step import March

SHARE = 0.1  # of the largest displacement: about the length that certificates compare gaps with


def steps_to_make(march: March, timeline: Timeline, until: float | None = None) -> Iterator[Step]:
    """The steps after the last one made, each decided on when it is asked for; collective.

    A step that stands for several does not pass one after which fields are due, nor the first that reaches `until` [s].
    What is decided follows from the state of the march, and so is the same after a restart.
    """
    stop = len(timeline) if until is None else timeline.first_reaching(until)
    chooser = StepChooser(march.scene, march.chosen, march.starts) if march.chosen is not None else None
    while (number := march.row.step + 1) <= len(timeline):
        span = timeline.span(number)
        if chooser is not None and span.stage.chooses and span.place(number) > 0:
            yield chooser.propose(span, number, is_relaxed=_is_relaxed(march, span, number))
            continue
        target = min([span.last, *_due(march, number), *([stop] if stop >= number else [])]) if span.rests else number
        yield span.leap(number, target) if _at_rest(march, span, number, target) else span.step(number)


def _due(march: March, number: int) -> list[int]:
    """The next step after which fields are saved, if they are."""
    output = march.scene.job.output
    return [-(-number // output.every) * output.every] if output.fields else []


def _at_rest(march: March, span: Span, number: int, target: int) -> bool:
    """Whether from a step on nothing changes until the end of its stage, and there is a step to spare; collective."""
    index = span.place(number)
    return target > number and index >= 1 and _is_relaxed(march, span, number)


def _is_relaxed(march: March, span: Span, number: int) -> bool:
    """Whether from a step on nothing changes until the end of its stage; collective."""
    index = span.place(number)
    if not span.rests:
        return False
    material = march.scene.material
    if not isinstance(material, ZenerBody):
        return True
    if index == 1:  # a jump of the load has just been: branches that have no map have not relaxed yet
        return False
    change = remaining(march, material, span.interval(span.count, since=index - 1))
    return march.scene.slab.agree(change <= SHARE * march.scene.job.numerics.tolerance)


def remaining(march: March, material: ZenerBody, seconds: float) -> float:
    """By how much displacements at most change within some time, over the smaller of the largest displacement and the
    surface's height; over the latter where nothing is pressed; collective."""
    scene = march.scene
    material.settle()
    share, modulus = material.relaxing(seconds)
    sizes = [_largest(field) for field in (*material.branches, material.u, march.state.pressure)]
    *branches, u, p = scene.slab.reduce((), sizes)
    lacking, height = float(share @ branches), scene.solver.height
    if lacking == 0.0:
        return 0.0
    scale = modulus * (min(u, height) if p > 0.0 else height)
    return lacking / scale if scale > 0.0 else math.inf


def _largest(field: Array) -> float:
    return max(float(field.max(initial=0.0)), -float(field.min(initial=0.0)))
