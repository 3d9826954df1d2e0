"""What a job calls for, decided once: what is on and why, and everything else that follows from the job alone.

`scene.py` makes what is decided here, `parcontact plan` prints it, and rooms below never see the job. An effect that is
off allocates nothing, calls nothing and writes nothing.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..effects.effect import Decision, Effect
from ..effects.folded_branches import bands, phases
from ..effects.interface import interface_of
from ..effects.relaxation import relaxation_of, time_factor_of
from ..history.chosen import describe_steps
from ..history.timeline import Timeline
from ..job import Grid, Job, Numerics, Output, Spectral, extension
from ..physics.folding import FoldedBranches, fold_branches, keep_all
from ..physics.interface import InterfaceFriction
from ..physics.prony import Prony
from ..solve.precision import LOOSE, VERY_LOOSE


def choices(job: Job, until: float = 0.0) -> "Choices":
    """Return what a job calls for, if its last stage goes on to `until` [s]; each choice is made when first asked for,
    and then kept."""
    return Choices(job, job.grid, job.numerics, job.output, until)


class decided(cached_property[Decision]):  # noqa: N801 (read as the decorator that it is)
    """A decision, made when it is first asked for. `parcontact plan` prints all of them in the order of their code."""


@dataclass(frozen=True)
class Choices:
    """Everything that follows from a job alone: a `Decision` for each effect, then what it is made with.

    `job` itself is for rooms above `scene`, and for effects of other packages, which have sections of their own.
    """

    job: Job
    grid: Grid
    numerics: Numerics
    output: Output
    until: float = 0.0

    @property
    def effects(self) -> list[Decision]:
        """Every effect that there is, on or off, and why."""
        own = [getattr(self, name) for name, part in vars(Choices).items() if isinstance(part, decided)]
        return own + [effect.decide(self.job) for effect in extension.find_effects().values()]

    @cached_property
    def followers(self) -> dict[str, type[Effect]]:
        """The effects that the job's further sections ask for, by their names in checkpoints."""
        found = extension.effects_of(type(self.job).model_fields).values()
        return {effect.decide(self.job).name: effect for effect in found if effect.decide(self.job).on}

    # -- the body -----------------------------------------------------------------------------------------------------

    @cached_property
    def prony(self) -> Prony:
        """The relaxation function of the material [Pa, s]."""
        return relaxation_of(self.job.material)

    @cached_property
    def time_factor(self) -> float:
        """By what factor relaxation times are longer than at the reference temperature, a_T [-]."""
        return time_factor_of(self.job.material)

    @cached_property
    def interface(self) -> InterfaceFriction | None:
        """The friction of the contact area itself; None if the job has no `interface`."""
        return interface_of(self.job.section("interface"), self.time_factor)

    @cached_property
    def folded(self) -> FoldedBranches:
        """Which branches of the material need a map (`physics.folding`)."""
        if self.prony.moduli.size == 0:
            return keep_all(self.prony, "the body has no branch")
        reason, allowed, initial = "", self.numerics.branch_error, self.job.initial
        if self.energies.on:
            reason = "output.energy counts the energy of every branch"
        elif not allowed:
            reason = "numerics.branch_error is 0"
        passing = list(phases(Timeline.of(self.job, self.until))), list(bands(self.grid, self.job.surface))
        start = initial.velocity if initial.state == "steady" else None
        found = fold_branches(self.prony, *passing, self.numerics.integrator, 0.0 if reason else allowed, start)
        return replace(found, reason=reason)

    @decided
    def viscoelasticity(self) -> Decision:
        """One map per branch that relaxes, and the last displacement."""
        count = self.prony.moduli.size
        what = "a branch relaxes" if count == 1 else f"{count} branches relax"
        return Decision("viscoelasticity", count > 0, what if count else "the body has one modulus and no memory")

    @decided
    def folded_branches(self) -> Decision:
        """Branches far faster or slower than all that happens have no map."""
        name, found = "folded branches", self.folded
        if not found.folded:
            return Decision(name, False, found.reason or "no branch is far faster or slower than all that happens")
        kinds = ((found.memoryless, "memoryless"), (found.frozen, "frozen"))
        folded = " and ".join(f"{len(numbers)} {kind}" for numbers, kind in kinds if numbers)
        count = len(found.kept) + found.folded
        return Decision(name, True, f"{folded} of {count}; error of friction {found.bound:.2g} at most")

    @decided
    def isolated(self) -> Decision:
        """Padded transforms, four times as large."""
        free = self.grid.boundary == "free"
        return Decision("isolated contact", free, f"the boundary is {self.grid.boundary}" + ": padded" * free)

    # -- the history --------------------------------------------------------------------------------------------------

    @cached_property
    def timeline(self) -> Timeline:
        """All steps of the job's history; those that stages choose are guessed."""
        return Timeline.of(self.job)

    @cached_property
    def slides_along_x(self) -> bool:
        """Whether the surface slides along x on a periodic box, where whole cells are an index offset."""
        spans = [span for span in self.timeline.spans if span.moves]
        along = not any(span.stage.velocity[1] for span in spans)
        return bool(spans) and self.grid.boundary == "periodic" and along

    @decided
    def sliding(self) -> Decision:
        """A surface that moves."""
        moves = self.timeline.moves
        return Decision("sliding", moves, "the surface moves" if moves else "the surface stands in all stages")

    @decided
    def part_cells(self) -> Decision:
        """Heights made anew when the surface has moved, but for whole cells along x on a periodic box."""
        name = "sub-cell or oblique sliding"
        if not self.sliding.on:
            return Decision(name, False, "the surface stands")
        if self.isolated.on:
            return Decision(name, True, "a free box is not cyclic: the heights are made anew")
        if self.slides_along_x and self.further_starts.on:
            return Decision(name, True, "stages that choose their own steps begin with parts of a cell where they must")
        step = self.timeline.first_between_cells()
        if step is None:
            return Decision(name, False, "every step is of whole cells along x")
        why = "the surface moves along y too" if step.position[1] else f"step {step.number} ends between cells"
        return Decision(name, True, why)

    @decided
    def extrapolated_starts(self) -> Decision:
        """The last pressure but one, from which the next one is extrapolated."""
        lasts = self.timeline.lasts
        return Decision("extrapolated starts", lasts, "stages last" if lasts else "every stage is a single solve")

    @decided
    def further_starts(self) -> Decision:
        """The two pressures before that: with thirds and quarters of a cell the next one starts from a whole cell
        ago."""
        on = self.timeline.chooses and any(span.moves and span.stage.chooses for span in self.timeline.spans)
        why = "the surface slides in steps that are chosen" if on else "the surface slides in no steps that are chosen"
        return Decision("starts from whole cells ago", on, why)

    @decided
    def chosen_steps(self) -> Decision:
        """Time steps that follow the error of the last one (`march.choosing`)."""
        why = describe_steps(self.job)
        on = bool(why) and self.job.remembers
        return Decision("chosen time steps", on, why or "every stage says in which steps")

    @decided
    def short_rest(self) -> Decision:
        """Once nothing changes any more at rest, one step ends the stage (`march.rest`)."""
        stage = next((span.stage.name for span in self.timeline.spans if span.rests), None)
        if stage is None:
            return Decision("rest cut short", False, "no stage stands under a constant load with growing time steps")
        return Decision("rest cut short", True, f"stage {stage!r} stands under a constant load")

    @decided
    def steady_start(self) -> Decision:
        """A steady solve before the first step."""
        state = self.job.initial.state
        return Decision("steady start", state == "steady", f"the initial state is {state}")

    @decided
    def approach(self) -> Decision:
        """Displacement control: the approach is given and the load follows."""
        stage = next((stage.name for stage in self.job.history if stage.control == "approach"), None)
        if stage is None:
            return Decision("displacement control", False, "every stage prescribes its load")
        return Decision("displacement control", True, f"stage {stage!r} prescribes the approach")

    # -- the solver ---------------------------------------------------------------------------------------------------

    @decided
    def mixed_precision(self) -> Decision:
        """A preconditioner in single precision, with transforms of its own, which costs no iteration."""
        name, numerics = "mixed precision", self.numerics
        if numerics.precision != "double":
            return Decision(name, True, f"numerics.precision is {numerics.precision}")
        if numerics.tolerance < LOOSE:
            return Decision(name, False, f"numerics.tolerance is below {LOOSE:g}")
        if self._relaxing_energies and self._inverse_is_known:
            return Decision(name, False, "energies take the preconditioner for the inverse of the operator")
        return Decision(name, True, f"a solve to a tolerance of {LOOSE:g} or more takes as many iterations with it")

    @decided
    def single_operator(self) -> Decision:
        """The operator in single precision, too, on the transforms of the preconditioner."""
        name, numerics = "operator in single precision", self.numerics
        if numerics.precision != "mixed":
            return Decision(name, False, f"numerics.precision is {numerics.precision}")
        if numerics.tolerance < VERY_LOOSE:
            return Decision(name, False, f"numerics.tolerance is below {VERY_LOOSE:g}")
        if self.energies.on:
            return Decision(name, False, "energies are balanced to more digits")
        return Decision(name, True, f"a solve to a tolerance of {VERY_LOOSE:g} or more does not need more digits")

    @property
    def operator_type(self) -> type[np.floating]:
        """The precision of the operator and of the displacements that it makes."""
        return np.float32 if self.single_operator.on else np.float64

    @decided
    def spectrum(self) -> Decision:
        """The waves of the surface: their transform is kept, their moments are taken once, and forces are spectral
        sums."""
        if any(isinstance(shape, Spectral) for shape in self.job.surface):
            return Decision("surface spectrum", True, "the surface has waves or heights from a file")
        return Decision("surface spectrum", False, "all shapes of the surface are in closed form")

    @property
    def transforms(self) -> list[Any]:
        """On what it depends, beside the number of ranks, which transforms a run has."""
        single = [self.mixed_precision.on, self.single_operator.on]
        kinds = self.grid.points, self.grid.boundary, self.numerics.kernel, self.numerics.precision
        return [*kinds, single, [self.job.initial.state, self.job.steady is not None]]

    # -- the output ---------------------------------------------------------------------------------------------------

    @decided
    def energies(self) -> Decision:
        """Work, stored and dissipated energy: one reduction per step, in a viscoelastic body one operator
        application."""
        asked = self.output.energy
        return Decision("energies", asked, "output.energy asks for them" if asked else "output.energy is not set")

    @decided
    def energy_memory(self) -> Decision:
        """Branch maps of `A^-1 u`, where the operator's inverse is not at hand."""
        name = "energy memory"
        if not self._relaxing_energies:
            return Decision(name, False, "no energies of a viscoelastic body are asked for")
        if self._inverse_is_known and self.numerics.precision == "double":
            return Decision(name, False, "the preconditioner is the inverse")
        return Decision(name, True, "the preconditioner is not the inverse")

    @property
    def _relaxing_energies(self) -> bool:
        return self.energies.on and self.viscoelasticity.on

    @property
    def _inverse_is_known(self) -> bool:
        """Whether the preconditioner is the inverse of the operator, but for its precision."""
        return self.grid.boundary == "periodic" and self.numerics.kernel == "spectral"

    @decided
    def branch_dissipation(self) -> Decision:
        """A column of measures.csv per branch."""
        name, asked = "dissipation per branch", self.output.branch_dissipation
        if asked and not self.viscoelasticity.on:
            return Decision(name, False, "the body has no branch")
        return Decision(name, asked, f"output.branch_dissipation is {'' if asked else 'not '}set")

    @decided
    def mesh_check(self) -> Decision:
        """The same run on half the mesh first, from which what the mesh makes wrong is seen."""
        name = "run on half the mesh"
        if not self.output.mesh_check:
            return Decision(name, False, "output.mesh_check is not set")
        return Decision(name, True, "output.mesh_check asks for it, an eighth to a third of the work more")

    @decided
    def fields(self) -> Decision:
        """Maps in fields.h5."""
        names, every = self.output.fields, self.output.every
        when = "after every step" if every == 1 else f"every {every} steps"
        return Decision("fields", bool(names), f"{', '.join(names)} {when}" if names else "output.fields names none")

    @decided
    def checkpoints(self) -> Decision:
        """Files to go on from; one at the end is always written."""
        rules = self.job.checkpoint
        when = f"every {rules.every} steps" if rules.every is not None else f"every {rules.minutes:g} minutes"
        return Decision("checkpoints", True, f"{when} and at the end; {rules.keep} are kept")
