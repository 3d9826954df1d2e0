"""Which step is next. At rest under a constant load one step ends the stage, once the body has relaxed or at once if it
has no memory.

Were the displacement u kept from now on, the branches would after the time t lack

    sum_k (1 - exp(-t/tau_k)) h_k     out of     A p = G_inf u + sum_k h_k.

Over the modulus that is left then, `G(t) = G_inf + sum_k G_k exp(-t/tau_k)`, this is a displacement; it grows with t.
Where it is below SHARE of the tolerance, the contact of now also meets the conditions of every instant up to t, and
neither displacements nor `A p/G` change by much more: in the norm of the elastic energy a contact follows its heights
without enlarging their differences, of which the past weighs `1 - G(t)/alpha` at most.

Only stages whose time steps grow are ended so: who gives one time step asks for a row at each.
"""

import math

from ..history.timeline import Span, Step, Timeline
from ..physics.body import ZenerBody, surface_of
from ..scene import Scene
from .choosing import StepChooser
from .state import State

SHARE = 0.1  # accuracy: of the largest displacement: about the length that certificates compare gaps with


def next_step(scene: Scene, state: State, timeline: Timeline, stop: int) -> Step:
    """Return the step after the last one made; collective.

    One that stands for several does not pass one after which fields are due, nor the step number `stop`. What is
    decided follows from the state, and so is the same after a restart.
    """
    number = state.row.step + 1
    span = timeline.span(number)
    if state.chosen is not None and span.stage.chooses and span.place(number) > 0:
        chooser = StepChooser(scene, state.chosen, state.starts.prefers_moved)
        return chooser.propose(span, number, is_relaxed=_is_relaxed(scene, state, span, number))
    output = scene.choices.output
    due = [-(-number // output.every) * output.every] if output.fields else []
    target = min([span.last, *due, *([stop] if stop >= number else [])]) if span.rests else number
    if target > number and span.place(number) >= 1 and _is_relaxed(scene, state, span, number):
        return span.leap(number, target)
    return span.step(number)


def _is_relaxed(scene: Scene, state: State, span: Span, number: int) -> bool:
    """Return whether from a step on nothing changes until the end of its stage; collective."""
    index = span.place(number)
    if not span.rests:
        return False
    if scene.material.branched is None:
        return True
    if index == 1:  # a jump of the load has just been: branches that have no map have not relaxed yet
        return False
    change = remaining(scene, state, scene.material.branched, span.ends.interval(span.count, since=index - 1))
    return scene.slab.agree(change <= SHARE * scene.choices.numerics.tolerance)


def remaining(scene: Scene, state: State, body: ZenerBody, seconds: float) -> float:
    """Return by how much displacements at most change within some time, over the smaller of the largest displacement
    and the surface's height; over the latter where nothing is pressed; collective."""
    body.settle(state.body)
    share, modulus = body.relaxation_in(seconds)
    fields = *state.body.branches, surface_of(state.body), state.pressure
    sizes = [max(float(field.max(initial=0.0)), -float(field.min(initial=0.0))) for field in fields]
    *branches, u, p = scene.slab.reduce((), sizes)
    lacking, height = float(share @ branches), scene.solver.height
    if lacking == 0.0:
        return 0.0
    scale = modulus * (min(u, height) if p > 0.0 else height)
    return lacking / scale if scale > 0.0 else math.inf
