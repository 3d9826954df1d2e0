"""What each verb does: options -> exit code. A verb imports what it needs when it runs, so that each begins at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import InputError
from ..parallel.root import on_root
from . import ranks
from .cases import OF_A_CURVE, cases_of, each_case, overrides

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence
    from pathlib import Path

    from ..job import Job
    from ..parallel.mpi import MPI
    from ..parallel.slab import Slab
    from .cases import Shows

DONE, FAILED, BAD_INPUT = 0, 1, 2  # exit codes; the runner has another one: stopped early, run again


def run(options: argparse.Namespace) -> int:
    return each_case(options, ranks.start(), _run)


def _run(options: argparse.Namespace, job: Job, slab: Slab, shows: Shows) -> int:
    from ..run import runner

    if not job.history:
        return _curve(options, job, slab, shows)
    others_file = getattr(options, "others_file", None)  # of a sweep
    chosen = (options.quiet, options.restart, options.until, options.wall)
    return runner.run(job, slab, runner.Options(*chosen, others_file=others_file, shows=shows))


def steady(options: argparse.Namespace) -> int:
    return each_case(options, ranks.start(), _curve)


def _curve(options: argparse.Namespace, job: Job, slab: Slab, shows: Shows) -> int:
    from ..report import prediction
    from ..steady_sliding import curve

    asked = [getattr(options, name, ()) for name in OF_A_CURVE]
    wanted = curve.request(job, *asked)
    if options.restart not in ("auto", "never"):
        raise InputError(f"--restart: a friction curve goes on (auto) or starts afresh (never), got {options.restart}")
    others_file = getattr(options, "others_file", None)  # of a sweep
    code = curve.run(job, slab, wanted, options.quiet, options.restart, shows, others_file)
    if code == DONE and prediction.has_spectrum(job):
        on_root(slab.comm, lambda: prediction.write_steady(job, wanted))
    return code


@ranks.root_alone
def check(options: argparse.Namespace) -> int:
    from .. import job as jobs
    from ..history.chosen import describe_steps

    cases, chosen = cases_of(options)
    job = chosen[0].job
    print(jobs.describe(job))
    if job.included:
        print(f"\n{job.included}")
    if steps := describe_steps(job):
        print(f"\ntime steps that are chosen: {steps}")
    each = [case.job for case in chosen]
    doubts = [text for job in each for text in (*job.warnings, *_doubts(job))]
    for warning in dict.fromkeys(doubts):
        print(f"warning: {warning}")
    if cases[0].settings:
        print("\nsweep; the above is its first case" if len(chosen) > 1 else "\nsweep")
        print("\n".join(map(str, chosen)))
    return DONE


def _doubts(job: Job) -> list[str]:
    """What only a look at heights and measured moduli tells."""
    from ..job.checks import meaning

    if meaning.says_all(job.surface) and not job.measured:
        return []
    from .. import scene
    from ..parallel.mpi import MPI
    from ..parallel.slab import Slab
    from ..scene import sanity
    from ..scene.measured_range import describe_beyond

    found = list(describe_beyond(job))
    if sanity.is_quickly_made(job):
        found += sanity.of_surface(scene.set_up(job, Slab(MPI.COMM_SELF, *job.grid.points)))
    return found


def plan(options: argparse.Namespace) -> int:
    from ..run import watch

    started = watch.age()
    world = ranks.start()
    from .. import scene
    from ..parallel.mpi import MPI
    from ..parallel.slab import Slab
    from ..plan import machine, planning, whole_sweep
    from ..run import sweep_warnings
    from ..scene import sanity
    from ..scene.measured_range import describe_beyond

    chosen = on_root(world, lambda: cases_of(options)[1])
    job = chosen[0].job
    counts = options.ranks or tuple(sorted({1, world.size, *({machine.cores()} if world.size == 1 else ())}))
    words = [options.job, *(word for change in options.set for word in ("--set", change))]
    words += [] if options.case is None else ["--case", str(options.case)]
    wanted = planning.Wanted(counts, words, options.seconds, options.cores, options.network)
    slab, alone = Slab(world, *job.grid.points), Slab(MPI.COMM_SELF, 1, 1)
    if options.sample:
        planning.leave_sample(job, slab, wanted, options.sample, options.sample_points)
        return DONE
    whole = len(chosen) > 1
    doubts = [] if whole else [*job.warnings, *describe_beyond(job)]
    if whole:
        on_root(world, lambda: sweep_warnings.warn_once(chosen))
    for warning in (*doubts, *(sanity.of_surface(scene.set_up(job, slab)) if sanity.is_quickly_made(job) else ())):
        if world.rank == 0:
            print(f"warning: {warning}", flush=True)
    given = slab, alone, wanted, started
    for line in whole_sweep.plan(chosen, *given) if whole else planning.plan(job, *given):
        if world.rank == 0:
            print(line, flush=True)
    return DONE


def theory(options: argparse.Namespace) -> int:
    return each_case(options, ranks.start(), _predict, runs=False)


def _predict(options: argparse.Namespace, job: Job, slab: Slab, shows: Shows) -> int:
    from ..parallel.mpi import MPI
    from ..parallel.slab import Slab
    from ..report import prediction
    from ..summary.theory_settings import TheorySettings

    def write() -> Path:
        rows = prediction.predict(job, Slab(MPI.COMM_SELF, *job.grid.points), options.gamma, options.waves)
        return prediction.write(job, rows, TheorySettings(options.gamma, options.waves))

    path = on_root(slab.comm, write)
    if slab.root and not options.quiet:
        print(f"Persson's theory, gamma {options.gamma:g}, {options.waves} of waves: {path}", flush=True)
    return DONE


@ranks.root_alone
def fit(options: argparse.Namespace) -> int:
    from .. import job as jobs
    from ..effects.folded_branches import excited_band
    from ..plotting import compounds
    from ..rubber import compound
    from ..rubber.shift import given

    target = options.out or options.table.with_suffix(".yaml")
    compounds.refuse_foreign(target)
    band = excited_band(jobs.load(options.job)) if options.job else None
    law = given(options.shift, options.reference)
    made = compound.fitted(options.table, options.poisson, options.reference, law, options.error, options.weight)
    for line in compounds.write(made, target, band):
        print(line)
    return DONE


def study(options: argparse.Namespace) -> int:
    world = ranks.start()
    from .. import job as jobs
    from ..parallel.slab import Slab
    from ..study import runner

    job, words = _load(options, world), overrides(options)

    def make(changes: Sequence[str]) -> Job:
        return on_root(world, lambda: jobs.load(options.job, [*words, *changes], options.case))

    return runner.run(job, make, Slab(world, *job.grid.points), options.quiet)


def surface(options: argparse.Namespace) -> int:
    """Root's work alone: maps are whole."""
    world = ranks.start()
    from pathlib import Path

    from .. import scene
    from ..parallel.mpi import MPI
    from ..parallel.slab import Slab
    from ..plotting import surfaces
    from ..scene import sanity
    from ..summary import measured_maps

    given = Path(options.job)
    picture, options.out = Path(options.out or f"{given.stem}-surface.png"), None
    alone = measured_maps.is_map(given)
    if options.start and not alone:
        raise InputError(f"--job writes a job for a measured map; {given} is a job")

    def act() -> list[str]:
        measured_maps.refuse_taken(options.start)
        job = measured_maps.load(given, options.set) if alone else _load(options, MPI.COMM_SELF)
        base = scene.set_up(job, Slab(MPI.COMM_SELF, *job.grid.points))
        doubts = [text for text in job.warnings if text.startswith("surface")] + sanity.of_surface(base)
        base.surface.rescale(1.0)
        heights = base.surface.heights((0.0, 0.0), base.slab.empty())
        lines = list(surfaces.describe(job, heights, base.told, base.shortest, picture))
        lines += [f"warning: {text}" for text in doubts]
        return [*lines, *measured_maps.start(job, given, options.start)] if alone else lines

    lines = on_root(world, act)
    if world.rank == 0:
        print("\n".join(lines))
    return DONE


def info(options: argparse.Namespace) -> int:
    world = ranks.start()
    from ..summary import info as about

    text, sound = on_root(world, lambda: about.describe_all(options.file))
    if world.rank == 0:
        print(text)
    return DONE if sound else BAD_INPUT


def plot(options: argparse.Namespace) -> int:
    world = ranks.start()
    from ..plotting import plots

    names = ("format", "panels", "over", "log", "compare", "movie", "at", "out")
    wanted = plots.Options(**{name: getattr(options, name) for name in names})
    pictures = on_root(world, lambda: plots.plot(options.directories, wanted))
    if world.rank == 0:
        for picture in pictures:
            print(f"picture: {picture}")
    return DONE


def report(options: argparse.Namespace) -> int:
    """Root's work alone."""
    world = ranks.start()
    from ..report import page

    target = on_root(world, lambda: page.write(options.directories, options.out))
    if world.rank == 0:
        print(f"report: {target}")
    return DONE


def doctor(options: argparse.Namespace) -> int:
    world = ranks.start()
    from ..doctor import cases

    outcomes = [cases.examine(case, world, options.precision) for case in cases.CASES]
    wrong = [f"{outcome.case.name}: {text}" for outcome in outcomes for text in outcome.wrong]
    if world.rank == 0:
        print(cases.table(outcomes))
        print("\n".join(wrong) or "all is well")
    return FAILED if wrong else DONE


def _load(options: argparse.Namespace, world: MPI.Intracomm) -> Job:
    """Root reads the job; the others get what it found; collective."""
    from .. import job as jobs

    return on_root(world, lambda: jobs.load(options.job, overrides(options), options.case))
