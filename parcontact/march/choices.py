"""Choices for a run that follow from its job alone: which effects are on, why, and with which parameters.

`scene.py` makes the objects chosen here, and `parcontact plan` prints the choices. The solver and the operators do not
read the job. An effect that is off allocates nothing, calls nothing and writes nothing. Each decision is a method of
`Choices` that is called once. It returns True if the effect is on, and the reason.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..contact.problem import LOOSE, VERY_LOOSE
from ..effects.branches import FoldedBranches, bounded_error, fold_branches, relaxation_of, time_factor_of, time_scales
from ..effects.effect import EXTRAPOLATION, SINGLE, Decision, Effect, guarded
from ..job import Grid, Job, Numerics, Output, Spectral, listing
from ..job.history import Timeline, describe_steps
from ..physics.prony import Prony
from ..physics.surface import Shear

Verdict = tuple[bool, str]  # True if an effect is on, and the reason


class Decided(cached_property[Decision]):
    """A decision, made at its first use. `parcontact plan` prints all decisions in the order of this file."""


def decided(name: str) -> Callable[[Callable[[Any], Verdict]], Decided]:
    """Return a decorator for methods that return a verdict. It turns a method into the decision called `name`."""
    return lambda method: Decided(lambda choices: Decision(name, *method(choices)))


def choices(job: Job, until: float = 0.0) -> "Choices":
    """Return the choices for a job whose last stage is extended to the time `until` [s] if that is later."""
    return Choices(job, job.grid, job.numerics, job.output, until)


@dataclass(frozen=True)
class Choices:
    """Choices that follow from a job alone: a `Decision` for each effect, and the parameters of the effects.

    `job` is read by the modules of this room that use `scene`, and by effects of other packages, but by no other
    module.
    """

    job: Job
    grid: Grid
    numerics: Numerics
    output: Output
    until: float = 0.0

    @property
    def decisions(self) -> list[Decision]:
        """The decision of every effect, on or off, with its reason."""
        own = [getattr(self, name) for name, part in vars(Choices).items() if isinstance(part, Decided)]
        return own + [self._decide(section, effect) for section, effect in listing.find_effects().items()]

    def _decide(self, section: str, effect: type[Effect[Any]]) -> Decision:
        """Return the decision of an effect. Effects of other packages are only called for jobs with their section."""
        if self.job.section(section) is None and not listing.is_ours(section):
            return Decision(section, False, f"there is no {section} section")
        return guarded(section, effect).decide(self.job)

    @cached_property
    def effects(self) -> dict[str, type[Effect[Any]]]:
        """The effects that are on and have a section of their own in the job, by the names of the effects in
        checkpoints."""
        known = listing.effects_of(type(self.job).model_fields)
        found = [guarded(section, effect) for section, effect in known.items()]
        return {effect.decide(self.job).name: effect for effect in found if effect.decide(self.job).on}

    # -- the body -----------------------------------------------------------------------------------------------------

    @cached_property
    def prony(self) -> Prony:
        """Relaxation function of the material [Pa, s]."""
        return relaxation_of(self.job.material)

    @cached_property
    def time_factor(self) -> float:
        """Shift factor a_T [-]: relaxation times divided by their values at the reference temperature."""
        return time_factor_of(self.job.material)

    @property
    def hardness(self) -> float | None:
        """Bound on the pressure [Pa]; None without one."""
        return self.job.material.hardness

    def forbidden(self, what: str) -> str:
        """Return the reason why an effect of the job forbids a method of calculation, such as single precision; '' if
        no effect does. `what` is a key of `effects.effect.Effect.forbids`."""
        return next((effect.forbids[what] for effect in self.effects.values() if what in effect.forbids), "")

    @cached_property
    def shears(self) -> tuple[Shear, ...]:
        """Laws of the shear stress in the contact area, from all effects that add such a law."""
        found = [effect.shear(self.job) for effect in self.effects.values()]
        return tuple(shear for shear in found if shear is not None)

    @cached_property
    def folded(self) -> FoldedBranches:
        """The division of the branches of the material into branches with maps and folded branches without maps
        (`effects.branches`)."""
        reason = "" if self.numerics.branch_error else "numerics.branch_error is 0"
        reason = "output.energy counts the energy of every branch" if self.energies.on else reason
        reason = next(filter(None, (why(self.job) for why in self.job.asked("why_not_folded"))), reason)
        reason = reason if self.prony.moduli.size else "the body has no branch"
        scales = time_scales(Timeline.from_job(self.job, self.until), self.steady_start.on)
        return fold_branches(self.prony, scales, self.numerics.integrator, self.numerics.branch_error, reason)

    @decided("viscoelasticity")
    def viscoelasticity(self) -> Verdict:
        """Decision to store the memory of a viscoelastic body: one map per relaxing branch, and the last
        displacement."""
        count = self.prony.moduli.size
        what = "a branch relaxes" if count == 1 else f"{count} branches relax"
        return count > 0, what if count else "the body has one modulus and no memory"

    @decided("folded branches")
    def folded_branches(self) -> Verdict:
        """Decision to fold branches that are far faster or slower than the history: no map is stored for a folded
        branch."""
        found = self.folded
        if not found.folded:
            return False, found.reason or "no branch is far faster or slower than the history"
        folded = f"{found.folded} of {self.prony.moduli.size} are too fast or too slow to need a map"
        return True, f"{folded}; {bounded_error(found, bool(self.job.directions))}"

    @decided("isolated contact")
    def isolated(self) -> Verdict:
        """Decision to calculate in a free box, whose padded transforms are four times as large."""
        free = not all(self.grid.cyclic)
        return free, f"the boundary is {listing.text(self.grid.boundary)}" + ": padded" * free

    @decided("yielding counterbody")
    def yielding(self) -> Verdict:
        """Decision to bound pressures by the hardness of the counterbody. The solver then uses bounds from 0 to the
        hardness."""
        bound = self.hardness
        return bound is not None, "material.hardness is not set" if bound is None else f"at a pressure of {bound:g} Pa"

    # -- the history --------------------------------------------------------------------------------------------------

    @cached_property
    def timeline(self) -> Timeline:
        """All steps of the job's history; the number of steps is an estimate for stages that choose their steps."""
        return Timeline.from_job(self.job)

    @cached_property
    def slides_along_x(self) -> bool:
        """True if the surface slides along x only, on a periodic box. Motions by whole cells then shift the indices of
        maps, and no heights are computed again."""
        across = [span.stage.velocity[1] for span in self.timeline.spans if span.moves]
        return bool(across) and not self.isolated.on and not any(across)

    @decided("sliding")
    def sliding(self) -> Verdict:
        """Decision to move the surface along the body."""
        moves = self.timeline.moves
        return moves, "the surface moves" if moves else "the surface does not move in any stage"

    @decided("sub-cell or oblique sliding")
    def part_cells(self) -> Verdict:
        """Decision to compute heights again after each motion of the surface. A motion by whole cells along x of a
        periodic box does not need this."""
        if not self.sliding.on:
            return False, "the surface does not move"
        if self.isolated.on:
            return True, "a free box is not cyclic: the heights are computed again"
        if self.slides_along_x and self.further_starts.on:
            return True, "chosen steps may be parts of a cell"
        if (step := self.timeline.first_between_cells()) is None:
            return False, "every step is of whole cells along x"
        return True, "the surface moves along y too" if step.position[1] else f"step {step.number} ends between cells"

    @decided("extrapolated starts")
    def extrapolated_starts(self) -> Verdict:
        """Decision to store the pressure before the last one, for extrapolation to the next step."""
        if reason := self.forbidden(EXTRAPOLATION):
            return False, reason
        return (on := self.timeline.lasts), "stages have steps" if on else "every stage is a single solve"

    @decided("starts from a whole cell earlier")
    def further_starts(self) -> Verdict:
        """Decision to store two more pressures, of three and four steps ago: steps of 1/3 or 1/4 cell start from the
        pressure one whole cell earlier."""
        moves = any(span.moves and span.stage.chooses for span in self.timeline.spans)
        on = self.extrapolated_starts.on and self.timeline.chooses and moves
        return on, f"the surface slides in {'' if on else 'no '}chosen steps"

    @decided("chosen time steps")
    def chosen_steps(self) -> Verdict:
        """Decision to choose time steps from the error of the last step (`march.controller`)."""
        why = describe_steps(self.job)
        return bool(why) and self.job.remembers, why or "every stage gives its steps"

    @decided("rest cut short")
    def short_rest(self) -> Verdict:
        """Decision to make a single step to the end of a stage at rest, once the contact no longer changes. The body
        must have no memory."""
        if self.prony.moduli.size:
            return False, "the body relaxes"
        if (span := next((span for span in self.timeline.spans if span.rests), None)) is None:
            return False, "no stage holds a constant load with growing time steps"
        return True, f"stage {span.stage.name!r} holds a constant load"

    @decided("steady start")
    def steady_start(self) -> Verdict:
        """Decision to start the march from a solve of steady sliding."""
        return self.job.initial.state == "steady", f"the initial state is {self.job.initial.state}"

    @decided("displacement control")
    def approach(self) -> Verdict:
        """Decision to prescribe the approach and solve for the load."""
        stage = next((stage.name for stage in self.job.history if stage.control == "approach"), None)
        return bool(stage), f"stage {stage!r} prescribes the approach" if stage else "every stage prescribes its load"

    # -- the solver ---------------------------------------------------------------------------------------------------

    @decided("preconditioner in single precision")
    def mixed_precision(self) -> Verdict:
        """Decision to use a preconditioner in single precision with its own transforms. Solves then take as many
        iterations as in double precision."""
        if reason := self.forbidden(SINGLE):
            return False, reason
        if self.numerics.precision != "double":
            return True, f"numerics.precision is {self.numerics.precision}"
        if self.numerics.tolerance < LOOSE:
            return False, f"numerics.tolerance is below {LOOSE:g}"
        if self._relaxing_energies and self._inverse_is_known:
            return False, "energies use the preconditioner as the inverse of the operator"
        return True, f"a solve to a tolerance of {LOOSE:g} or more takes as many iterations with it"

    @decided("operator in single precision")
    def single_operator(self) -> Verdict:
        """Decision to use the operator in single precision, too, with the transforms of the preconditioner."""
        if reason := self.forbidden(SINGLE):
            return False, reason
        if self.numerics.precision != "mixed":
            return False, f"numerics.precision is {self.numerics.precision}"
        if self.numerics.tolerance < VERY_LOOSE:
            return False, f"numerics.tolerance is below {VERY_LOOSE:g}"
        if self.energies.on:
            return False, "the energy balance needs more digits"
        return True, f"a solve to a tolerance of {VERY_LOOSE:g} or more does not need more digits"

    @property
    def operator_type(self) -> type[np.floating]:
        """Floating-point type of the operator and of displacements."""
        return np.float32 if self.single_operator.on else np.float64

    @decided("surface spectrum")
    def spectrum(self) -> Verdict:
        """Decision to store the transform of the surface. Moments of the surface are then computed once, and forces are
        sums over waves."""
        on = any(isinstance(shape, Spectral) for shape in self.job.surface)
        return on, "the surface has waves or heights from a file" if on else "all its shapes are in closed form"

    @property
    def transforms(self) -> list[Any]:
        """Settings that, together with the number of ranks, determine the transforms of a run. Plans of transforms that
        an earlier run has stored on this machine are found by these settings (`files.wisdom`)."""
        kinds = self.grid.points, self.grid.boundary, self.numerics.kernel, self.numerics.precision
        single, steady = [self.mixed_precision.on, self.single_operator.on], self.job.steady is not None
        return [*kinds, single, [self.job.initial.state, steady]]

    # -- the output ---------------------------------------------------------------------------------------------------

    @decided("energies")
    def energies(self) -> Verdict:
        """Decision to compute energies. This takes one reduction per step, and in a viscoelastic body one application
        of the operator per step."""
        asked = self.output.energy
        return asked, "output.energy asks for them" if asked else "output.energy is not set"

    @decided("energy memory")
    def energy_memory(self) -> Verdict:
        """Decision to store a map of `A^-1 u` for each branch, if the inverse of the operator is not available."""
        if not self._relaxing_energies:
            return False, "no energies of a viscoelastic body are asked for"
        known = self._inverse_is_known and self.numerics.precision == "double"
        return not known, f"the preconditioner is {'' if known else 'not '}the inverse"

    @property
    def _relaxing_energies(self) -> bool:
        return self.energies.on and self.viscoelasticity.on

    @property
    def _inverse_is_known(self) -> bool:
        """True if the preconditioner is the inverse of the operator, up to its precision."""
        return not self.isolated.on and self.numerics.kernel == "spectral" and not self.job.asked("response")

    @decided("dissipation per branch")
    def branch_dissipation(self) -> Verdict:
        """Decision to write the dissipated energy of each branch as a column of measures.csv."""
        asked = self.output.branch_dissipation
        if asked and not self.viscoelasticity.on:
            return False, "the body has no branch"
        return asked, f"output.branch_dissipation is {'' if asked else 'not '}set"

    @decided("fields")
    def fields(self) -> Verdict:
        """Decision to write maps to fields.h5."""
        names, every = self.output.fields, self.output.every
        when = "after every step" if every == 1 else f"every {every} steps"
        return bool(names), f"{', '.join(names)} {when}" if names else "output.fields names none"

    @decided("checkpoints")
    def checkpoints(self) -> Verdict:
        """Decision to write checkpoints during the run. A checkpoint at the end is always written."""
        rules = self.job.checkpoint
        when = f"every {rules.every} steps" if rules.every is not None else f"every {rules.minutes:g} minutes"
        return True, f"{when} and at the end; {rules.keep} are kept"
