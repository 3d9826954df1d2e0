"""What a job calls for: every decision on an effect, from the job alone, each with its reason.

`scene.py` makes what is decided here, and `parcontact plan` prints it: there is no second copy of a decision. An effect
that is off allocates nothing, calls nothing and writes nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass

from ..job import Job, Spectral
from .folded_branches import fold_branches_of
from .relaxation import relaxation_of


@dataclass(frozen=True)
class Effect:
    """A decision on one effect, and why in a few words."""

    name: str
    on: bool
    why: str


Decision = Callable[[Job], Effect]


def viscoelasticity(job: Job) -> Effect:
    """One map per branch that relaxes, and the last displacement."""
    count = relaxation_of(job).moduli.size
    what = "a branch relaxes" if count == 1 else f"{count} branches relax"
    return Effect("viscoelasticity", count > 0, what if count else "the body has one modulus and no memory")


def folded_branches(job: Job) -> Effect:
    """Branches far faster or slower than all that happens have no map (`physics/folding.py`)."""
    name, found = "folded branches", fold_branches_of(job)
    if not found.folded:
        return Effect(name, False, found.reason or "no branch is far faster or slower than all that happens")
    kinds = ((found.memoryless, "memoryless"), (found.frozen, "frozen"))
    folded = " and ".join(f"{len(numbers)} {kind}" for numbers, kind in kinds if numbers)
    return Effect(
        name, True, f"{folded} of {len(found.kept) + found.folded}; error of friction {found.bound:.2g} at most"
    )


def isolated(job: Job) -> Effect:
    """Padded transforms, four times as large."""
    free = job.grid.boundary == "free"
    return Effect("isolated contact", free, f"the boundary is {job.grid.boundary}" + ": padded" * free)


def sliding(job: Job) -> Effect:
    """A surface that moves."""
    moves = job.timeline().moves
    return Effect("sliding", moves, "the surface moves" if moves else "the surface stands in all stages")


def part_cells(job: Job) -> Effect:
    """Heights made anew when the surface has moved, instead of an index offset along x on a periodic box."""
    return Effect("sub-cell or oblique sliding", *_part_cells(job))


def _part_cells(job: Job) -> tuple[bool, str]:
    if not sliding(job).on:
        return False, "the surface stands"
    if job.grid.boundary == "free":
        return True, "a free box is not cyclic: the heights are made anew"
    step = job.timeline().first_between_cells(job.grid)
    if step is None:
        return False, "every step is of whole cells along x"
    return True, "the surface moves along y too" if step.position[1] else f"step {step.number} ends between cells"


def lasting(job: Job) -> Effect:
    """The last pressure but one, from which the next one is extrapolated."""
    lasts = job.timeline().lasts
    return Effect("extrapolated starts", lasts, "stages last" if lasts else "every stage is a single solve")


def short_rest(job: Job) -> Effect:
    """Once nothing changes any more at rest, one step ends the stage (`stationary.py`)."""
    stage = next((span.stage.name for span in job.timeline().spans if span.rests), None)
    why = "no stage stands under a constant load with growing time steps"
    return Effect(
        "rest cut short", stage is not None, f"stage {stage!r} stands under a constant load" if stage else why
    )


def steady_start(job: Job) -> Effect:
    """A steady solve before the first step."""
    steady = job.initial.state == "steady"
    return Effect("steady start", steady, f"the initial state is {job.initial.state}")


def approach(job: Job) -> Effect:
    """Displacement control: the approach is given and the load follows."""
    stage = next((stage.name for stage in job.history if stage.control == "approach"), None)
    return Effect(
        "displacement control",
        stage is not None,
        "every stage prescribes its load" if stage is None else f"stage {stage!r} prescribes the approach",
    )


def energies(job: Job) -> Effect:
    """Work, stored and dissipated energy: one reduction per step, in a viscoelastic body one operator application."""
    asked = job.output.energy
    return Effect("energies", asked, "output.energy asks for them" if asked else "output.energy is not set")


def energy_memory(job: Job) -> Effect:
    """Branch maps of `A^-1 u`, where the operator's inverse is not at hand."""
    name = "energy memory"
    if not (energies(job).on and viscoelasticity(job).on):
        return Effect(name, False, "no energies of a viscoelastic body are asked for")
    grid, numerics = job.grid, job.numerics
    invertible = grid.boundary == "periodic" and numerics.kernel == "spectral" and numerics.precision == "double"
    why = "the preconditioner is the inverse" if invertible else "the preconditioner is not the inverse"
    return Effect(name, not invertible, why)


def branch_dissipation(job: Job) -> Effect:
    """A column of measures.csv per branch."""
    asked = job.output.branch_dissipation
    on = asked and viscoelasticity(job).on
    why = "the body has no branch" if asked and not on else "is set" if asked else "is not set"
    return Effect("dissipation per branch", on, why if asked and not on else f"output.branch_dissipation {why}")


def spectrum(job: Job) -> Effect:
    """The waves of the surface: their transform is kept, their moments are taken once, and forces are spectral sums."""
    waves = any(isinstance(shape, Spectral) for shape in job.surface)
    why = "the surface has waves or heights from a file" if waves else "all shapes of the surface are in closed form"
    return Effect("surface spectrum", waves, why)


def fields(job: Job) -> Effect:
    """Maps in fields.h5."""
    names, every = job.output.fields, job.output.every
    when = "after every step" if every == 1 else f"every {every} steps"
    return Effect("fields", bool(names), f"{', '.join(names)} {when}" if names else "output.fields names none")


def checkpoints(job: Job) -> Effect:
    """Files to go on from; one at the end is always written."""
    rules = job.checkpoint
    when = f"every {rules.every} steps" if rules.every is not None else f"every {rules.minutes:g} minutes"
    return Effect("checkpoints", True, f"{when} and at the end; {rules.keep} are kept")


def mixed_precision(job: Job) -> Effect:
    """A preconditioner in single precision, with transforms of its own."""
    precision = job.numerics.precision
    return Effect("mixed precision", precision == "mixed", f"numerics.precision is {precision}")


TABLE: tuple[Decision, ...] = (
    *(viscoelasticity, folded_branches, isolated, sliding, part_cells, lasting, short_rest, steady_start, approach),
    *(mixed_precision, spectrum, energies, energy_memory, branch_dissipation, fields, checkpoints),
)
