"""Verbs of the command line, from options to exit code. A verb imports the modules that it needs when it runs, so that
every verb starts quickly.

A verb works on the job, or on the selected cases of its sweep. The launcher's environment variables state which rank is
root, so that verbs without MPI start at once; other ranks then print nothing and exit with code 0.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import time
from functools import partial, wraps
from typing import TYPE_CHECKING

from ..errors import BAD_INPUT, DONE, FAILED, InputError
from ..parallel.root import on_root

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from ..errors import Doubt
    from ..files.stopping import Options
    from ..job import Case, Job
    from ..parallel.slab import MPI, Slab

    Verb = Callable[[argparse.Namespace], int]
    Shows = Callable[[Doubt], bool]  # whether a warning is shown
    Act = Callable[[argparse.Namespace, Job, Slab, Shows], int]

BLANK = " \0"  # characters that may follow the name of an MPI library
LEAST_FILES, LEAST_MEMORY = 32, 520e6  # tuning: open files, and memory [bytes], that MPI needs to start
RANKS = ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID")  # variables that hold the rank
LAUNCHERS = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS", "SLURM_STEP_NUM_TASKS")  # number of ranks


def is_root() -> bool:
    """Return True on the rank that prints."""
    return rank() == 0


def rank() -> int:
    """Return the rank of this process, by MPI if it has started, else by the launcher."""
    if (world := started()) is not None:
        return world.rank
    return next((int(text) for name in RANKS if (text := os.environ.get(name, "")).isdecimal()), 0)


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0))


def launched() -> int:
    """Return the number of ranks that a launcher has started."""
    return max((int(os.environ.get(name) or 1) for name in LAUNCHERS), default=1)


def started() -> MPI.Intracomm | None:
    """Return the communicator of all ranks if MPI has started, else None."""
    module = sys.modules.get("mpi4py.MPI")
    return None if module is None else module.COMM_WORLD


def start_ranks() -> MPI.Intracomm:
    """Start MPI, and return the communicator of all ranks. Raises InputError if the launcher belongs to another MPI."""
    _refuse_surroundings()
    from ..parallel.slab import MPI

    world, count = MPI.COMM_WORLD, launched()
    if world.size == 1 and count > 1:
        raise InputError(
            f"{count} ranks were started but each is alone: the launcher belongs to another MPI than mpi4py "
            f"({MPI.Get_library_version().splitlines()[0].strip(BLANK)}). Use the mpirun in the directory of this "
            "parcontact (see parcontact manual install)."
        )
    return world


def _refuse_surroundings() -> None:
    """Raise InputError for limits and settings of the shell that would make MPI abort without a message."""
    files, memory = (resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_NOFILE, resource.RLIMIT_AS))
    if 0 <= files < LEAST_FILES:
        raise InputError(f"only {files} files may be open: set a limit of {LEAST_FILES} or more, by ulimit -n")
    if scratch := os.environ.get("TMPDIR"):
        try:
            os.makedirs(scratch, exist_ok=True)  # as MPI does
        except OSError as error:
            text = (
                f"TMPDIR is {scratch}, which cannot be created ({error.strerror}): give a directory that you may write"
            )
            raise InputError(text) from None
    if 0 <= memory < LEAST_MEMORY:
        raise InputError(f"only {memory >> 20} MB of memory may be used: set a limit of 1 GB or more, by ulimit -v")


def root_alone(verb: Verb) -> Verb:
    """Return a verb that only root executes. With several ranks MPI is first started on all ranks, as an import on root
    might start MPI on root alone."""

    @wraps(verb)
    def act(options: argparse.Namespace) -> int:
        if launched() > 1:
            return on_root(start_ranks(), lambda: verb(options))
        return verb(options) if is_root() else 0

    return act


OF_A_CURVE = ("velocities", "pressures", "temperatures")


def each_case(options: argparse.Namespace, world: MPI.Intracomm, act: Act, runs: bool = True) -> int:
    """Apply `act` to a job, to all cases of its sweep, or to the selected case; collective.

    With `runs` False `act` makes no run: cases get no warnings, and finished cases are done again. Cases that run at
    the same time print only their beginning and end.
    """
    from ..files.stopping import always
    from ..parallel.slab import Slab

    cases, chosen = on_root(world, lambda: cases_of(options))
    if not cases[0].settings:
        return act(options, cases[0].job, Slab(world, *cases[0].job.grid.points), always)
    from ..files import stopping, sweep
    from ..parallel.slab import Groups
    from .memory import count_side_by_side

    on_root(world, lambda: sweep.refuse_foreign_sweep(cases))
    shown = on_root(world, lambda: sweep.warn_once(chosen)) if runs and len(chosen) > 1 else ()
    afresh = getattr(options, "restart", "") == "never" or not runs
    groups = Groups(world, on_root(world, lambda: count_side_by_side(sweep.to_do(chosen, afresh), world.size)))
    limit = stopping.limit_time(getattr(options, "wall", None))
    own = argparse.Namespace(**vars(options))
    stop = on_root(world, lambda: sweep.stop_file(cases))
    own.quiet, own.sweep_stop_file = options.quiet or groups.count > 1, stop
    whole = sweep.SweepRun(cases, groups, partial(act, own), stop, options.quiet, limit, shown, runs)
    return whole.run(chosen)


def cases_of(options: argparse.Namespace) -> tuple[Sequence[Case], Sequence[Case]]:
    """Return all cases of a job, and the cases that the command line selects."""
    from .. import job as parcontact_job
    from ..march import mesh

    cases = mesh.load_cases(options.job, job_overrides(options))
    if getattr(options, "until", None) is not None and not cases[0].job.history:
        raise InputError("--until: a friction curve has no time; leave it out")
    return cases, parcontact_job.select_cases(cases, options.case)


def job_overrides(options: argparse.Namespace) -> list[str]:
    """Return the texts KEY=VALUE by which the command line changes the job.

    The name of a directory is escaped, so that YAML reads it as text. Velocities, pressures and temperatures of a
    friction curve become keys of the job.
    """
    name = "".join(f"\\U{ord(letter):08x}" for letter in options.out or "")
    asked = {key: getattr(options, key, ()) for key in OF_A_CURVE}
    curve = [f"steady.{key}={list(values)!r}" for key, values in asked.items() if values]
    return [*options.set, *curve, *([f'output.directory="{name}"'] if options.out is not None else [])]


def run(options: argparse.Namespace) -> int:
    """Run a job, or continue it (the default verb)."""
    return each_case(options, start_ranks(), _run)


def _run(options: argparse.Namespace, job: Job, slab: Slab, shows: Shows) -> int:
    if not job.history:
        return _curve(options, job, slab, shows)
    if job.bands is not None:
        from ..files.road_run import run_history

        return run_history(job, slab, _of_a_run(options, shows))
    from ..files import run as files_run

    return files_run.run_job(job, slab, _of_a_run(options, shows))


def _of_a_run(options: argparse.Namespace, shows: Shows) -> Options:
    """Return the options of a run or a friction curve."""
    from ..files.stopping import Options

    names = ("quiet", "restart", "until", "wall", "sweep_stop_file")
    return Options(**{name: getattr(options, name) for name in names if hasattr(options, name)}, shows=shows)


def steady(options: argparse.Namespace) -> int:
    """Calculate a friction curve: steady sliding, solved directly."""
    return each_case(options, start_ranks(), _curve)


def _curve(options: argparse.Namespace, job: Job, slab: Slab, shows: Shows) -> int:
    from ..bands.road_sliding import make_states
    from ..march import curve
    from ..results import prediction

    asked = [getattr(options, name, ()) for name in OF_A_CURVE]
    wanted = curve.request(job, *asked)
    if options.restart not in ("auto", "never"):
        raise InputError(f"--restart: auto or never was expected for a friction curve, got {options.restart}")
    draw = partial(prediction.draw_curve, job, wanted)
    return curve.run_curve(job, slab, wanted, _of_a_run(options, shows), make_states, draw)


@root_alone
def check(options: argparse.Namespace) -> int:
    """List all mistakes of a job, or all its keys with every default."""
    from .. import job as parcontact_job
    from ..job.history import describe_steps
    from ..job.reading import sentences_of

    cases, chosen = cases_of(options)
    job = chosen[0].job
    _check_study(options, chosen)
    print(parcontact_job.describe_job(job))
    steps = "" if job.bands is not None else describe_steps(job)
    steps = steps and f"chosen time steps: {steps}"
    notes: list[list[str]] = []
    doubts = sentences_of(chosen, lambda one: _doubts(one, notes))
    notes[0] += _describe_waves(job)
    for text in filter(None, (job.included, job.origin.mesh, steps, *job.facts, "\n".join(notes[0]))):
        print(f"\n{text}")
    for warning in doubts:
        print(f"warning: {warning}")
    if cases[0].settings:
        print("\nsweep; its first case is shown above" if len(chosen) > 1 else "\nsweep")
        print("\n".join(map(str, chosen)))
    return DONE


def _check_study(options: argparse.Namespace, cases: Sequence[Case]) -> None:
    """Read all jobs of a study, also of each case of a sweep; raises InputError with their mistakes."""
    if cases[0].job.study is None:
        return
    from ..march import mesh
    from .study import ladders, make_cases

    for case in cases:
        number = case.number if case.settings else None

        def make(changes: Sequence[str], number: int | None = number) -> Job:
            return mesh.load(options.job, [*job_overrides(options), *changes], number)

        make_cases(case.job, ladders(case.job), make)


def _doubts(job: Job, notes: list[list[str]]) -> list[Doubt]:
    """Return the warnings about a job, its heights and its measured moduli; append a list of remarks on measured maps
    and spectra to `notes`."""
    notes.append([])
    degrees = (job.steady.temperatures if job.steady else None) or ()
    if job.bands is not None:
        from ..bands.choice import cut_bands, describe_cut, doubts_of_bands

        cut = cut_bands(job)
        notes[-1] += describe_cut(cut, job)
        return doubts_of_bands(job, cut, degrees)
    if not job.depends_on_heights and not job.measured:
        return list(job.doubts)
    from ..march import sanity
    from ..march.scene import describe_roughness, set_up
    from ..parallel.slab import Slab

    if not sanity.is_quickly_made(job):
        return [*job.doubts, *sanity.doubt_band(job, degrees)]
    setup = set_up(job, Slab.alone(*job.grid.points))
    notes[-1] += [*setup.remarks.notes, *describe_roughness(setup)]
    sanity.refuse_approaches(setup)
    return sanity.find_doubts(setup, degrees)


def _describe_waves(job: Job) -> list[str]:
    """Return sentences of effects on the waves of a surface on one grid."""
    if job.bands is not None or not job.asked("describe_waves"):
        return []
    from ..march import sanity

    return sanity.describe_waves(job)


def plan(options: argparse.Namespace) -> int:
    """Estimate the steps, time, memory and disk of a job; writes nothing."""
    world = start_ranks()
    from itertools import chain

    from ..job.reading import sentences_of
    from ..parallel.slab import Groups, Slab
    from .memory import count_side_by_side
    from .plan import Planner

    started = time.process_time()
    chosen = on_root(world, lambda: cases_of(options)[1])
    doubts = on_root(world, lambda: sentences_of(chosen, lambda job: _doubts(job, [])))
    planner = Planner(options.ranks or sorted({1, world.size, cores()}), options.seconds, started)
    if chosen[0].job.bands is not None:
        from ..bands.road_history import plan_bands

        head = [f"first of {len(chosen)} cases:"] * (len(chosen) > 1)
        lines: Iterator[str] = chain(head, plan_bands(chosen[0].job, Slab(world, 1, 1)))
    elif len(chosen) > 1:
        at_once = on_root(world, lambda: count_side_by_side([case.job for case in chosen], world.size))
        lines = planner.plan_sweep(chosen, Groups(world, at_once))
    else:
        lines = planner.plan(chosen[0].job, Slab(world, *chosen[0].job.grid.points))
    said = on_root(world, lambda: _describe_waves(chosen[0].job))
    for line in (*(f"warning: {text}" for text in doubts), *said, *lines):
        if world.rank == 0:
            print(line, flush=True)
    return DONE


def theory(options: argparse.Namespace) -> int:
    """Predict friction and contact area by Persson's theory, into theory.csv."""
    return each_case(options, start_ranks(), _predict, runs=False)


def _predict(options: argparse.Namespace, job: Job, slab: Slab, shows: Shows) -> int:
    from ..results import prediction

    lines = on_root(slab.comm, lambda: prediction.foretell(job, options.gamma, options.waves))
    if slab.root and not options.quiet:
        print(*lines, sep="\n", flush=True)
    return DONE


def _on_one_grid(job: Job) -> Job:
    """Return a job in bands as a job with one grid for all its waves."""
    if job.bands is None:
        return job
    from ..bands.choice import on_one_grid_of_all

    return on_one_grid_of_all(job)


@root_alone
def fit(options: argparse.Namespace) -> int:
    """Fit a material to measured moduli; write a material file and a picture."""
    from ..job.meaning import excited_band
    from ..march import mesh
    from ..results import inputs
    from ..rubber import compound
    from ..rubber.shift import read_shift

    target = options.out or options.table.with_suffix(".yaml")
    inputs.refuse_foreign(target)
    band = excited_band(_on_one_grid(mesh.load(options.job))) if options.job else None
    law = read_shift(options.shift, options.reference)
    of_fit = (options.error, options.weight, options.vertical)
    made = compound.fitted(options.table, options.poisson, options.reference, law, *of_fit)
    for line in inputs.write_compound(made, target, band):
        print(line)
    return DONE


def study(options: argparse.Namespace) -> int:
    """Run a job on finer and finer meshes and steps, and draw errors over computing time; continues after a stop."""
    world = start_ranks()
    from ..parallel.slab import Slab
    from . import study as door_study

    def make(changes: Sequence[str]) -> Job:
        return on_root(world, lambda: _load(options, changes))

    job = make(())
    return door_study.run_study(job, make, Slab(world, *job.grid.points), options.quiet)


@root_alone
def surface(options: argparse.Namespace) -> int:
    """Describe and draw the surface of a job, or a measured map."""
    from pathlib import Path

    from ..march import sanity
    from ..march.scene import set_up
    from ..parallel.slab import Slab
    from ..results import inputs

    given = Path(options.job)
    picture, options.out = Path(options.out or f"{given.stem}-surface.png"), None
    alone = inputs.is_map(given)
    if options.start and not alone:
        raise InputError(f"--job writes a job for a measured map; {given} is a job")
    if options.start and os.path.lexists(options.start):
        raise InputError(f"--job: {options.start} already exists; give another name")
    job = inputs.load_map(given, options.set) if alone else _load(options)
    if job.bands is not None:
        raise InputError(f"{given} has bands, each with heights on a grid of its own: give it a grid instead (grid)")
    sanity.refuse_memory(job)
    base = set_up(job, Slab.alone(*job.grid.points))
    doubts = [doubt for doubt in job.doubts if doubt.place.startswith("surface")] + sanity.check_heights(base)
    base.surface.rescale(1.0)
    heights = base.surface.heights((0.0, 0.0), base.slab.empty())
    lines = inputs.describe_surface(job, heights, base.remarks.notes, base.shortest, picture)
    started = inputs.start_job(job, given, options.start) if alone else ()
    print("\n".join([*lines, *(f"warning: {doubt}" for doubt in doubts), *started]))
    return DONE


@root_alone
def info(options: argparse.Namespace) -> int:
    """Describe checkpoints, field files and output directories, and check them for damage."""
    from ..results import info as results_info

    text, sound = results_info.describe_all(options.file)
    print(text)
    return DONE if sound else BAD_INPUT


@root_alone
def plot(options: argparse.Namespace) -> int:
    """Draw runs and friction curves, compare several, or make a movie."""
    from ..results import plots

    names = ("format", "panels", "over", "log", "compare", "movie", "at", "out")
    wanted = plots.PlotOptions(**{name: getattr(options, name) for name in names})
    for picture in plots.plot(options.directories, wanted):
        print(f"picture: {picture}")
    return DONE


def leak(options: argparse.Namespace) -> int:
    """Calculate the leakage through the gaps of a run, into leak.csv; draw it."""
    world = start_ranks()
    from ..effects.leakage.flow import PressureDrop
    from ..effects.leakage.over_time import write_leakage

    if (options.fluid is None) != (options.pressures is None):
        raise InputError("--fluid and --pressures HIGH:LOW [Pa] go together: give both, or none")
    total = options.load == "total"
    if total and options.fluid is None:
        raise InputError("--load total needs a fluid: give --fluid and --pressures HIGH:LOW [Pa]")
    if options.ambient is not None and not total:
        raise InputError("--ambient goes with --load total only")
    high, low = options.pressures or (0.0, 0.0)
    drop = PressureDrop(options.fluid, high, low, total, options.ambient) if options.fluid else None
    for directory in options.directories:
        lines = write_leakage(directory, options.at or "", options.over, world, drop)
        print(*lines, sep="\n", end="\n" if world.rank == 0 else "")
    return DONE


@root_alone
def report(options: argparse.Namespace) -> int:
    """Write one HTML file with job, results, data and versions."""
    from ..results import page

    print(f"report: {page.write_report(options.directories, options.out)}")
    return DONE


@root_alone
def export(options: argparse.Namespace) -> int:
    """Write friction, or leakage over the load, as a table for programs of finite elements."""
    from ..results import export as results_export

    for line in results_export.export_results(options.directory, options.format, options.out):
        print(line)
    return DONE


def doctor(options: argparse.Namespace) -> int:
    """Check this installation: exact solutions, ranks, files and times."""
    world = start_ranks()
    from pathlib import Path

    from . import doctor as door_doctor
    from .doctor import CHECKS, Bench, markdown, run_check

    def show(text: str) -> None:
        if world.rank == 0:
            print(text, flush=True)

    for line in door_doctor.describe_machine(world):
        show(line)
    results = [(check, run_check(check, Bench(world, options.precision))) for check in CHECKS]
    show("\n" + markdown(results))
    show("\n" + door_doctor.prepare_loops(world))
    wrong = [f"{check.name}: {text}" for check, bench in results for text in bench.wrong]
    wrong += filter(None, [door_doctor.find_broken_files(world, Path.cwd())])
    show("\n".join(wrong) or "all is well")
    return FAILED if wrong else DONE


@root_alone
def manual(options: argparse.Namespace) -> int:
    """Print a page of the manual, or list all pages."""
    import shutil

    from . import manual_texts

    width = min(shutil.get_terminal_size().columns, 100)
    print(
        manual_texts.plain_page(options.page, {"verbs": options.describe_verbs}, width)
        if options.page
        else manual_texts.contents()
    )
    return DONE


@root_alone
def schema(options: argparse.Namespace) -> int:
    """Print a JSON Schema of job files, for editors."""
    import json
    import sys

    from ..job import listing, model

    unknown = (f"{listing.describe_effect(name)} {reason}" for name, reason in model.without_schema().items())
    for text in (*listing.unusable(), *unknown):
        print(f"warning: {text}; the schema does not include it", file=sys.stderr)
    print(json.dumps(model.json_schema(), indent=1))
    return DONE


@root_alone
def cite(options: argparse.Namespace) -> int:
    """List the publications to cite for a run."""
    from ..results import info as results_info

    print(results_info.describe_citations(options.directory))
    return DONE


def _load(options: argparse.Namespace, changes: Sequence[str] = ()) -> Job:
    """Return the job of the command line, with further changes."""
    from ..march import mesh

    return mesh.load(options.job, [*job_overrides(options), *changes], options.case)
