"""What each verb does: options -> exit code. A verb imports what it needs when it runs, so that each begins at once."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from . import ranks

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

    from ..job import Job
    from ..parallel.mpi import MPI

DONE, FAILED, BAD_INPUT = 0, 1, 2  # exit codes; the runner has another one: stopped early, run again


def run(options: argparse.Namespace) -> int:
    world = ranks.start()
    job = _load(options, world)
    if not job.history:
        return _curve(options, job, world)
    from ..parallel.slab import Slab
    from ..run import runner

    chosen = runner.Options(options.quiet, options.restart, options.until, options.wall)
    return runner.run(job, Slab(world, *job.grid.points), chosen)


def steady(options: argparse.Namespace) -> int:
    world = ranks.start()
    return _curve(options, _load(options, world), world)


def _curve(options: argparse.Namespace, job: Job, world: MPI.Intracomm) -> int:
    from ..parallel.slab import Slab
    from ..steady_sliding import curve

    wanted = curve.request(job, getattr(options, "velocities", ()), getattr(options, "pressures", ()))
    return curve.run(job, Slab(world, *job.grid.points), wanted, options.quiet)


def check(options: argparse.Namespace) -> int:
    """Root alone, without MPI."""
    if ranks.is_root():
        from .. import job as jobs

        job = jobs.load(options.job, _overrides(options))
        print(jobs.describe(job))
        if job.included:
            print(f"\n{job.included}")
        for warning in job.warnings:
            print(f"warning: {warning}")
    return DONE


def plan(options: argparse.Namespace) -> int:
    from ..run import watch

    started = time.time() - watch.began()
    world = ranks.start()
    from ..parallel.mpi import MPI
    from ..parallel.slab import Slab
    from ..plan import machine, making

    job = _load(options, world)
    counts = options.ranks or tuple(sorted({1, world.size, *({machine.cores()} if world.size == 1 else ())}))
    words = [options.job, *(word for change in options.set for word in ("--set", change))]
    wanted = making.Wanted(counts, words, options.seconds, options.cores, options.network)
    slab = Slab(world, *job.grid.points)
    if options.sample:
        making.leave_sample(job, slab, wanted, options.sample)
        return DONE
    for line in making.plan(job, slab, Slab(MPI.COMM_SELF, 1, 1), wanted, started):
        if world.rank == 0:
            print(line, flush=True)
    return DONE


def theory(options: argparse.Namespace) -> int:
    world = ranks.start()
    from .. import prediction
    from ..parallel.mpi import MPI
    from ..parallel.slab import Slab

    job = _load(options, world)
    everyone, alone = (Slab(comm, *job.grid.points) for comm in (world, MPI.COMM_SELF))
    prediction.run(job, everyone, alone, options.gamma, options.waves, options.quiet)
    return DONE


def fit(options: argparse.Namespace) -> int:
    """Root alone, without MPI."""
    if not ranks.is_root():
        return DONE
    from .. import job as jobs
    from ..effects.folded_branches import excited_band
    from ..record import compounds
    from ..rubber import compound
    from ..rubber.shift import given

    target = options.out or options.table.with_suffix(".yaml")
    compounds.refuse_foreign(target)
    band = excited_band(jobs.load(options.job)) if options.job else None
    law = given(options.shift, options.reference)
    made = compound.fitted(options.table, options.poisson, options.reference, law, options.error)
    for line in compounds.write(made, target, band):
        print(line)
    return DONE


def study(options: argparse.Namespace) -> int:
    world = ranks.start()
    from .. import job as jobs
    from ..parallel.slab import Slab
    from ..study import runner

    job, words = _load(options, world), _overrides(options)

    def make(changes: Sequence[str]) -> Job:
        return ranks.on_root(world, lambda: jobs.load(options.job, [*words, *changes]))

    return runner.run(job, make, Slab(world, *job.grid.points), options.quiet)


def info(options: argparse.Namespace) -> int:
    world = ranks.start()
    from ..record import info as about

    text, sound = ranks.on_root(world, lambda: about.describe(options.file))
    if world.rank == 0:
        print(text)
    return DONE if sound else BAD_INPUT


def plot(options: argparse.Namespace) -> int:
    world = ranks.start()
    from ..record import plots

    names = ("format", "panels", "over", "log", "compare", "movie", "out")
    wanted = plots.Options(**{name: getattr(options, name) for name in names})
    pictures = ranks.on_root(world, lambda: plots.plot(options.directories, wanted))
    if world.rank == 0:
        for picture in pictures:
            print(f"picture: {picture}")
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

    return ranks.on_root(world, lambda: jobs.load(options.job, _overrides(options)))


def _overrides(options: argparse.Namespace) -> list[str]:
    """What the command line changes in a job; the name of a directory is taken as it is, whatever YAML would read."""
    name = "".join(f"\\U{ord(letter):08x}" for letter in options.out or "")
    return [*options.set, *([f'output.directory="{name}"'] if options.out is not None else [])]
