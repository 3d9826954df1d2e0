"""The command line: argv -> verb; start and end of MPI; exit codes."""

import argparse
import os
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from mpi4py import MPI

from . import __version__, job, runner
from .errors import InputError, RunError
from .parallel.slab import Slab

DONE, FAILED, BAD_INPUT = 0, 1, 2
VERBS = ("run", "check", "plot")
LAUNCHERS = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS", "SLURM_STEP_NUM_TASKS")  # say how many were started
STAGGER = 0.5  # seconds for which other ranks let root report an error that all of them have


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line `argv`; returns the exit code."""
    words = list(sys.argv[1:] if argv is None else argv)
    if words and words[0] not in VERBS and not words[0].startswith("-"):
        words.insert(0, "run")
    world = MPI.COMM_WORLD
    try:
        _refuse_alone(world)
        options = _parser().parse_args(words)
        return int(options.act(options, world))
    except (InputError, job.JobError, RunError) as error:
        if world.rank == 0:
            print(f"parcontact: {error}" if isinstance(error, RunError) else error, file=sys.stderr, flush=True)
        return FAILED if isinstance(error, RunError) else BAD_INPUT
    except Exception as error:
        _end_all(world, error)


def _end_all(world: MPI.Intracomm, error: Exception) -> NoReturn:
    """One rank cannot go on: it says why and ends all of them."""
    if world.rank > 0:
        time.sleep(STAGGER)
    where = f" on rank {world.rank} of {world.size}" if world.size > 1 else ""
    traceback.print_exception(error)
    print(f"parcontact: ended by {type(error).__name__}{where}: {error}", file=sys.stderr, flush=True)
    if world.size > 1:
        world.Abort(FAILED)
    sys.exit(FAILED)


def _refuse_alone(world: MPI.Intracomm) -> None:
    started = max((int(os.environ.get(name) or 1) for name in LAUNCHERS), default=1)
    if world.size == 1 and started > 1:
        raise InputError(
            f"{started} ranks were started but each finds itself alone: the launcher belongs to another MPI than "
            f"mpi4py ({MPI.Get_library_version().splitlines()[0].strip()}). Use the mpirun beside this parcontact."
        )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="parcontact",
        description="Transient contact of a rough rigid surface on a viscoelastic half space.",
        epilog="A first argument that is no verb is a job: mpirun -n 2 parcontact job.yaml",
    )
    parser.add_argument("--version", action="version", version=f"parcontact {__version__}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="verb")

    run = verbs.add_parser("run", help="run a job (the default verb)")
    _job_arguments(run)
    run.add_argument("--quiet", action="store_true", help="print only warnings and errors")
    run.set_defaults(act=_run)

    check = verbs.add_parser("check", help="list all mistakes of a job, or what it says with every default")
    _job_arguments(check)
    check.set_defaults(act=_check)

    plot = verbs.add_parser("plot", help="draw a picture of a run")
    plot.add_argument("directory", type=Path, help="output directory of a run")
    plot.set_defaults(act=_plot)
    return parser


def _job_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("job", help="job file (YAML)")
    parser.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], help="override a key of the job")
    parser.add_argument("--out", metavar="DIR", help="output directory")


def _load(options: argparse.Namespace, world: MPI.Intracomm) -> job.Job:
    """Root reads the job; the others get what it found."""
    found: job.Job | job.JobError | None = None
    if world.rank == 0:
        overrides = [*options.set, *([f"output.directory={options.out}"] if options.out else [])]
        try:
            found = job.load(options.job, overrides)
        except job.JobError as error:
            found = error
    found = world.bcast(found)
    if isinstance(found, job.Job):
        return found
    raise found or InputError("no job")


def _run(options: argparse.Namespace, world: MPI.Intracomm) -> int:
    loaded = _load(options, world)
    return runner.run(loaded, Slab(world, *loaded.grid.points), runner.Options(options.quiet))


def _check(options: argparse.Namespace, world: MPI.Intracomm) -> int:
    loaded = _load(options, world)
    if world.rank == 0:
        print(job.describe(loaded))
        for warning in loaded.warnings:
            print(f"warning: {warning}")
    return DONE


def _plot(options: argparse.Namespace, world: MPI.Intracomm) -> int:
    from .record import plots  # matplotlib is for pictures only

    if world.rank == 0:
        print(f"picture: {plots.plot(options.directory)}")
    return DONE


if __name__ == "__main__":
    sys.exit(main())
