"""Decisions on the effects that are a part of every scene or take the place of one, each with its reason.

From the job alone: `scene.py` makes what is decided here, and `parcontact plan` prints it; there is no second copy of a
decision. An effect that is off allocates nothing, calls nothing and writes nothing.
"""

from collections.abc import Callable

from ..history.cells import first_between_cells
from ..history.chosen import describe_steps
from ..history.timeline import Timeline
from ..job import Job, Spectral
from ..solve.precision import LOOSE, VERY_LOOSE
from . import folded_branches, relaxation
from .effect import Decision


def isolated(job: Job) -> Decision:
    """Padded transforms, four times as large."""
    free = job.grid.boundary == "free"
    return Decision("isolated contact", free, f"the boundary is {job.grid.boundary}" + ": padded" * free)


def sliding(job: Job) -> Decision:
    """A surface that moves."""
    moves = Timeline.of(job).moves
    return Decision("sliding", moves, "the surface moves" if moves else "the surface stands in all stages")


def part_cells(job: Job) -> Decision:
    """Heights made anew when the surface has moved, but for whole cells along x on a periodic box."""
    return Decision("sub-cell or oblique sliding", *_part_cells(job))


def _part_cells(job: Job) -> tuple[bool, str]:
    if not sliding(job).on:
        return False, "the surface stands"
    if job.grid.boundary == "free":
        return True, "a free box is not cyclic: the heights are made anew"
    if along_x(job) and further_starts(job).on:
        return True, "stages that choose their own steps begin with parts of a cell where they must"
    step = first_between_cells(Timeline.of(job), job.grid)
    if step is None:
        return False, "every step is of whole cells along x"
    return True, "the surface moves along y too" if step.position[1] else f"step {step.number} ends between cells"


def along_x(job: Job) -> bool:
    """Whether the surface slides along x on a periodic box, where whole cells are an index offset."""
    spans = [span for span in Timeline.of(job).spans if span.moves]
    return bool(spans) and job.grid.boundary == "periodic" and not any(span.stage.velocity[1] for span in spans)


def lasting(job: Job) -> Decision:
    """The last pressure but one, from which the next one is extrapolated."""
    lasts = Timeline.of(job).lasts
    return Decision("extrapolated starts", lasts, "stages last" if lasts else "every stage is a single solve")


def further_starts(job: Job) -> Decision:
    """The two pressures before that: with thirds and quarters of a cell the next one starts from a whole cell ago."""
    timeline = Timeline.of(job)
    on = timeline.chooses and any(span.moves and span.stage.chooses for span in timeline.spans)
    why = "the surface slides in steps that are chosen" if on else "the surface slides in no steps that are chosen"
    return Decision("starts from whole cells ago", on, why)


def chosen_steps(job: Job) -> Decision:
    """Time steps that follow the error of the last one (`march.choosing`)."""
    why = describe_steps(job)
    return Decision("chosen time steps", bool(why) and job.remembers, why or "every stage says in which steps")


def short_rest(job: Job) -> Decision:
    """Once nothing changes any more at rest, one step ends the stage (`stationary.py`)."""
    stage = next((span.stage.name for span in Timeline.of(job).spans if span.rests), None)
    why = "no stage stands under a constant load with growing time steps"
    return Decision(
        "rest cut short", stage is not None, f"stage {stage!r} stands under a constant load" if stage else why
    )


def steady_start(job: Job) -> Decision:
    """A steady solve before the first step."""
    steady = job.initial.state == "steady"
    return Decision("steady start", steady, f"the initial state is {job.initial.state}")


def approach(job: Job) -> Decision:
    """Displacement control: the approach is given and the load follows."""
    stage = next((stage.name for stage in job.history if stage.control == "approach"), None)
    return Decision(
        "displacement control",
        stage is not None,
        "every stage prescribes its load" if stage is None else f"stage {stage!r} prescribes the approach",
    )


def energies(job: Job) -> Decision:
    """Work, stored and dissipated energy: one reduction per step, in a viscoelastic body one operator application."""
    asked = job.output.energy
    return Decision("energies", asked, "output.energy asks for them" if asked else "output.energy is not set")


def energy_memory(job: Job) -> Decision:
    """Branch maps of `A^-1 u`, where the operator's inverse is not at hand."""
    name = "energy memory"
    if not _relaxing_energies(job):
        return Decision(name, False, "no energies of a viscoelastic body are asked for")
    invertible = _is_invertible(job) and job.numerics.precision == "double"
    why = "the preconditioner is the inverse" if invertible else "the preconditioner is not the inverse"
    return Decision(name, not invertible, why)


def _relaxing_energies(job: Job) -> bool:
    return energies(job).on and relaxation.decide(job).on


def _is_invertible(job: Job) -> bool:
    """Whether the preconditioner is the inverse of the operator, but for its precision."""
    return job.grid.boundary == "periodic" and job.numerics.kernel == "spectral"


def branch_dissipation(job: Job) -> Decision:
    """A column of measures.csv per branch."""
    asked = job.output.branch_dissipation
    on = asked and relaxation.decide(job).on
    why = "the body has no branch" if asked and not on else "is set" if asked else "is not set"
    return Decision("dissipation per branch", on, why if asked and not on else f"output.branch_dissipation {why}")


def spectrum(job: Job) -> Decision:
    """The waves of the surface: their transform is kept, their moments are taken once, and forces are spectral sums."""
    waves = any(isinstance(shape, Spectral) for shape in job.surface)
    why = "the surface has waves or heights from a file" if waves else "all shapes of the surface are in closed form"
    return Decision("surface spectrum", waves, why)


def fields(job: Job) -> Decision:
    """Maps in fields.h5."""
    names, every = job.output.fields, job.output.every
    when = "after every step" if every == 1 else f"every {every} steps"
    return Decision("fields", bool(names), f"{', '.join(names)} {when}" if names else "output.fields names none")


def checkpoints(job: Job) -> Decision:
    """Files to go on from; one at the end is always written."""
    rules = job.checkpoint
    when = f"every {rules.every} steps" if rules.every is not None else f"every {rules.minutes:g} minutes"
    return Decision("checkpoints", True, f"{when} and at the end; {rules.keep} are kept")


def mesh_check(job: Job) -> Decision:
    """The same run on half the mesh first, from which what the mesh makes wrong is seen."""
    asked = job.output.mesh_check
    why = (
        "output.mesh_check asks for it, an eighth to a third of the work more"
        if asked
        else "output.mesh_check is not set"
    )
    return Decision("run on half the mesh", asked, why)


def mixed_precision(job: Job) -> Decision:
    """A preconditioner in single precision, with transforms of its own, which costs no iteration."""
    name, numerics = "mixed precision", job.numerics
    if numerics.precision != "double":
        return Decision(name, numerics.precision == "mixed", f"numerics.precision is {numerics.precision}")
    if numerics.tolerance < LOOSE:
        return Decision(name, False, f"numerics.tolerance is below {LOOSE:g}")
    if _relaxing_energies(job) and _is_invertible(job):
        return Decision(name, False, "energies take the preconditioner for the inverse of the operator")
    return Decision(name, True, f"a solve to a tolerance of {LOOSE:g} or more takes as many iterations with it")


def single_operator(job: Job) -> Decision:
    """The operator in single precision, too, on the transforms of the preconditioner."""
    name, numerics = "operator in single precision", job.numerics
    if numerics.precision != "mixed":
        return Decision(name, False, f"numerics.precision is {numerics.precision}")
    if numerics.tolerance < VERY_LOOSE:
        return Decision(name, False, f"numerics.tolerance is below {VERY_LOOSE:g}")
    if energies(job).on:
        return Decision(name, False, "energies are balanced to more digits")
    return Decision(name, True, f"a solve to a tolerance of {VERY_LOOSE:g} or more does not need more digits")


TABLE: tuple[Callable[[Job], Decision], ...] = (
    *(
        relaxation.decide,
        folded_branches.decide,
        isolated,
        sliding,
        part_cells,
        lasting,
        further_starts,
        chosen_steps,
        short_rest,
        steady_start,
    ),
    *(
        approach,
        mixed_precision,
        single_operator,
        spectrum,
        energies,
        energy_memory,
        branch_dissipation,
        mesh_check,
        fields,
        checkpoints,
    ),
)
