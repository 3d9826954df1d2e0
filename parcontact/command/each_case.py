"""Apply a verb to the job, or to the chosen cases of its sweep."""

from __future__ import annotations

import argparse
from functools import partial
from typing import TYPE_CHECKING

from ..errors import InputError
from ..parallel.root import on_root

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ..doubts import Doubt
    from ..job import Case, Job
    from ..parallel.mpi import MPI
    from ..parallel.slab import Slab

    Shows = Callable[[Doubt], bool]  # whether a warning is shown
    Act = Callable[[argparse.Namespace, Job, Slab, Shows], int]

OF_A_CURVE = ("velocities", "pressures", "temperatures")


def each_case(options: argparse.Namespace, world: MPI.Intracomm, act: Act, runs: bool = True) -> int:
    """Apply `act` to a job, to all cases of its sweep, or to the selected case; collective.

    Cases that run at the same time print only their beginning and end.
    """
    from ..parallel.slab import Slab
    from ..storage.console import always

    cases, chosen = on_root(world, lambda: cases_of(options))
    if not cases[0].settings:
        return act(options, cases[0].job, Slab(world, *cases[0].job.grid.points), always)
    from ..parallel.groups import Groups
    from ..plan.memory import count_side_by_side
    from ..run import sweep, sweep_warnings, watch

    on_root(world, lambda: sweep.refuse_foreign_sweep(cases))
    shown = on_root(world, lambda: sweep_warnings.warn_once(chosen)) if runs and len(chosen) > 1 else ()
    afresh = getattr(options, "restart", "") == "never" or not runs
    groups = Groups(world, on_root(world, lambda: count_side_by_side(sweep.to_do(chosen, afresh), world.size)))
    limit = watch.limit(getattr(options, "wall", None))
    own = argparse.Namespace(**vars(options))
    stop = on_root(world, lambda: sweep.stop_file(cases))
    own.quiet, own.sweep_stop_file = options.quiet or groups.count > 1, stop
    whole = sweep.SweepRun(cases, groups, partial(act, own), stop, options.quiet, limit, shown, runs)
    return whole.run(chosen)


def cases_of(options: argparse.Namespace) -> tuple[Sequence[Case], Sequence[Case]]:
    """Return all cases of a job, and the cases that the command line selects."""
    from .. import job as jobs
    from .. import mesh

    cases = mesh.load_cases(options.job, job_overrides(options))
    if getattr(options, "until", None) is not None and not cases[0].job.history:
        raise InputError("--until: a friction curve has no time; leave it out")
    return cases, jobs.select_cases(cases, options.case)


def job_overrides(options: argparse.Namespace) -> list[str]:
    """Return the changes of the job by the command line, as texts KEY=VALUE.

    The name of a directory is escaped, so that YAML reads it as text. Velocities, pressures and temperatures of a
    friction curve become keys of the job.
    """
    name = "".join(f"\\U{ord(letter):08x}" for letter in options.out or "")
    asked = {key: getattr(options, key, ()) for key in OF_A_CURVE}
    curve = [f"steady.{key}={list(values)!r}" for key, values in asked.items() if values]
    return [*options.set, *curve, *([f'output.directory="{name}"'] if options.out is not None else [])]
