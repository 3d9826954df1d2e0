"""The command line: argv -> verb; start and end of MPI; exit codes."""

import argparse
import os
import sys
import time
import traceback
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

from mpi4py import MPI

from . import __version__, job
from .errors import InputError, RunError
from .parallel.slab import Slab
from .run import runner, watch
from .steady_sliding import curve

DONE, FAILED, BAD_INPUT = 0, 1, 2  # and runner.AGAIN
VERBS = ("run", "steady", "check", "plan", "theory", "info", "plot", "doctor")
LAUNCHERS = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS", "SLURM_STEP_NUM_TASKS")  # say how many were started
STAGGER = 0.5  # seconds for which other ranks let root report an error that all of them have
PATIENCE = 5.0  # seconds for which a rank that ends with an error waits for the others to do so too
CODES = """\
exit codes: 0 as asked; 1 the run failed; 2 bad job or bad input, nothing was written; 3 stopped early with a good
checkpoint, run again"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line `argv`; returns the exit code."""
    words = list(sys.argv[1:] if argv is None else argv)
    if words and words[0] not in VERBS and not words[0].startswith("-"):
        words.insert(0, "run")
    world = MPI.COMM_WORLD
    try:
        _refuse_alone(world)
        options = _parser().parse_args(words)
        return _leave_code(int(options.act(options, world)), world)
    except (InputError, job.JobError, RunError) as error:
        code = FAILED if isinstance(error, RunError) else BAD_INPUT
        text = str(error) if isinstance(error, job.JobError) else f"parcontact: {error}"
        return _end_together(world, text, code)
    except (Exception, KeyboardInterrupt) as error:
        _end_all(world, error)


def _leave_code(code: int, world: MPI.Intracomm) -> int:
    """Root leaves the exit code in the file that PARCONTACT_EXIT_FILE names, for launchers that end with their own."""
    if world.rank == 0 and (path := os.environ.get("PARCONTACT_EXIT_FILE")):
        with suppress(OSError):
            Path(path).write_text(f"{code}\n")
    return code


def _end_together(world: MPI.Intracomm, text: str, code: int) -> int:
    """Every rank has this error, and root says it. If one turns out to be alone with it, it says so and ends all."""
    if world.rank == 0:
        print(text, file=sys.stderr, flush=True)
    arrival, deadline = world.Ibarrier(), time.monotonic() + PATIENCE
    while not arrival.Test():
        if time.monotonic() > deadline:
            print(f"{text} (on rank {world.rank} of {world.size} alone)", file=sys.stderr, flush=True)
            world.Abort(code)
        time.sleep(1e-3)
    return _leave_code(code, world)


def _end_all(world: MPI.Intracomm, error: BaseException) -> NoReturn:
    """One rank cannot go on: it says why and ends all of them."""
    if world.rank > 0:
        time.sleep(STAGGER)
    where = f" on rank {world.rank} of {world.size}" if world.size > 1 else ""
    if not isinstance(error, KeyboardInterrupt | BrokenPipeError):
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


class _Parser(argparse.ArgumentParser):
    """Speaks on root only."""

    def _print_message(self, message: str, file: Any = None) -> None:
        if MPI.COMM_WORLD.rank == 0:
            super()._print_message(message, file)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="parcontact",
        description="Transient contact of a rough rigid surface on a viscoelastic half space.",
        epilog=f"A first argument that is no verb is a job: mpirun -n 2 parcontact job.yaml\n\n{CODES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"parcontact {__version__}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="verb")

    run = verbs.add_parser("run", help="run a job, or go on with it (the default verb)")
    _job_arguments(run)
    run.add_argument(
        "--restart",
        metavar="auto|never|PATH",
        default="auto",
        help="go on from the newest good checkpoint if there is one (auto, the default), start afresh and replace what "
        "is there (never), or go on from the checkpoint PATH",
    )
    run.add_argument(
        "--until",
        metavar="T",
        type=_seconds,
        help="stop after the first step that reaches the time T [s] of the history; one that ends before goes on with "
        "its last stage",
    )
    run.add_argument(
        "--wall", metavar="HH:MM:SS", type=_wall, help="stop early, with a checkpoint, to end within this wall time"
    )
    run.add_argument("--quiet", action="store_true", help="print only warnings and errors")
    run.set_defaults(act=_run)

    steady = verbs.add_parser("steady", help="solve steady sliding directly: a friction curve")
    _job_arguments(steady)
    for name, unit in (("velocities", "m/s"), ("pressures", "Pa")):
        text = f"{name} [{unit}]: N from A to B, equally spaced in the logarithm, or a list A,B,..."
        steady.add_argument(f"--{name}", metavar="A:B:N", type=_values, default=(), help=text)
    steady.add_argument("--quiet", action="store_true", help="print only warnings and errors")
    steady.set_defaults(act=_steady)

    check = verbs.add_parser("check", help="list all mistakes of a job, or what it says with every default")
    _job_arguments(check)
    check.set_defaults(act=_check)

    plan = verbs.add_parser("plan", help="say what a job will do, and what it costs on so many ranks; writes nothing")
    _job_arguments(plan)
    text = "numbers of ranks, N,N,... (default: 1 and as many as there are cores here, or as many as plan)"
    plan.add_argument("--ranks", metavar="N,...", type=_counts, default=(), help=text)
    plan.add_argument("--seconds", metavar="T", type=_seconds, default=10.0, help="for how long the job is tried [s]")
    plan.add_argument("--cores", metavar="N", type=_count, help="cores of a node of the machine that it is for")
    text = "of that machine's network: seconds of a message, bytes per second of a node (default: 2e-6,12.5e9)"
    plan.add_argument("--network", metavar="ALPHA,BETA", type=_network, help=text)
    plan.add_argument("--sample", type=Path, help=argparse.SUPPRESS)  # by which a plan starts others
    plan.set_defaults(act=_plan)

    theory = verbs.add_parser("theory", help="say what Persson's theory predicts for a job, into theory.csv")
    _job_arguments(theory)
    text = "factor that corrects friction in partial contact, 0 to 1 (1: not at all; default: 0.45)"
    theory.add_argument("--gamma", metavar="G", type=_share, default=0.45, help=text)
    text = "waves of the job's spectrum (continuum, the default), or those of the surface in its box (lattice)"
    theory.add_argument("--waves", choices=("continuum", "lattice"), default="continuum", help=text)
    theory.add_argument("--quiet", action="store_true", help="print only warnings and errors")
    theory.set_defaults(act=_theory)

    info = verbs.add_parser("info", help="say what a checkpoint or a file of fields holds, and whether it is sound")
    info.add_argument("file", type=Path)
    info.set_defaults(act=_info)

    plot = verbs.add_parser("plot", help="draw a picture of a run")
    plot.add_argument("directory", type=Path, help="output directory of a run")
    plot.set_defaults(act=_plot)

    doctor = verbs.add_parser("doctor", help="run small hard cases on this machine, and say what came out of each")
    doctor.add_argument("--precision", choices=("double", "single", "mixed"), default="double")
    doctor.set_defaults(act=_doctor)
    return parser


def _job_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("job", help="job file (YAML)")
    parser.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], help="override a key of the job")
    parser.add_argument("--out", metavar="DIR", help="output directory")


def _seconds(text: str) -> float:
    value = float(text)
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"must be a time [s] of zero or more, got {text!r}")
    return value


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"must be positive whole numbers, got {text!r}")
    return int(text)


def _counts(text: str) -> tuple[int, ...]:
    return tuple(_count(part) for part in text.split(","))


def _network(text: str) -> tuple[float, float]:
    values = _values(text)
    if len(values) != 2 or min(values) <= 0.0:
        raise argparse.ArgumentTypeError(f"must be seconds of a message and bytes per second, got {text!r}")
    return values[0], values[1]


def _share(text: str) -> float:
    with suppress(ValueError):
        if 0.0 <= float(text) <= 1.0:
            return float(text)
    raise argparse.ArgumentTypeError(f"must be a number from 0 to 1, got {text!r}")


def _wall(text: str) -> float:
    """Seconds of [[HH:]MM:]SS, or with days in front as in Slurm, D-HH:MM:SS."""
    days, dash, rest = text.rpartition("-")
    fields = rest.split(":")
    try:
        if len(fields) > 3:
            raise ValueError
        seconds = sum(float(field) * 60.0**power for power, field in enumerate(reversed(fields)))
        seconds += 86400.0 * int(days) if dash else 0.0
    except ValueError:
        seconds = 0.0
    if not 0.0 < seconds < float("inf"):
        raise argparse.ArgumentTypeError(f"must be a wall time HH:MM:SS, got {text!r}")
    return seconds


def _load(options: argparse.Namespace, world: MPI.Intracomm) -> job.Job:
    """Root reads the job; the others get what it found."""
    found: job.Job | list[str] = []
    if world.rank == 0:
        overrides = [*options.set, *([f"output.directory={options.out}"] if options.out else [])]
        try:
            found = job.load(options.job, overrides)
        except job.JobError as error:
            found = error.mistakes
    found = world.bcast(found)
    if isinstance(found, list):
        raise job.JobError(found)
    return found


def _values(text: str) -> tuple[float, ...]:
    """Numbers equally spaced in their logarithm, `first:last:count`, or a list `a,b,c`."""
    try:
        return job.log_range(text) if ":" in text else tuple(float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be first:last:count or a list of numbers, got {text!r}") from None


def _run(options: argparse.Namespace, world: MPI.Intracomm) -> int:
    loaded = _load(options, world)
    if not loaded.history:
        return curve.run(loaded, Slab(world, *loaded.grid.points), curve.request(loaded), options.quiet)
    chosen = runner.Options(options.quiet, options.restart, options.until, options.wall)
    return runner.run(loaded, Slab(world, *loaded.grid.points), chosen)


def _steady(options: argparse.Namespace, world: MPI.Intracomm) -> int:
    loaded = _load(options, world)
    wanted = curve.request(loaded, options.velocities, options.pressures)
    return curve.run(loaded, Slab(world, *loaded.grid.points), wanted, options.quiet)


def _check(options: argparse.Namespace, world: MPI.Intracomm) -> int:
    loaded = _load(options, world)
    if world.rank == 0:
        print(job.describe(loaded))
        if loaded.included:
            print(f"\n{loaded.included}")
        for warning in loaded.warnings:
            print(f"warning: {warning}")
    return DONE


def _plan(options: argparse.Namespace, world: MPI.Intracomm) -> int:
    started = time.time() - watch.began()
    from .plan import machine, making

    loaded = _load(options, world)
    ranks = options.ranks or tuple(sorted({1, world.size, *({machine.cores()} if world.size == 1 else ())}))
    words = [options.job, *(word for change in options.set for word in ("--set", change))]
    wanted = making.Wanted(ranks, words, options.seconds, options.cores, options.network)
    slab = Slab(world, *loaded.grid.points)
    if options.sample:
        making.leave_sample(loaded, slab, wanted, options.sample)
        return DONE
    for line in making.plan(loaded, slab, Slab(MPI.COMM_SELF, 1, 1), wanted, started):
        if world.rank == 0:
            print(line, flush=True)
    return DONE


def _theory(options: argparse.Namespace, world: MPI.Intracomm) -> int:
    from . import prediction

    loaded = _load(options, world)
    everyone, alone = (Slab(comm, *loaded.grid.points) for comm in (world, MPI.COMM_SELF))
    prediction.run(loaded, everyone, alone, options.gamma, options.waves, options.quiet)
    return DONE


def _info(options: argparse.Namespace, world: MPI.Intracomm) -> int:
    from .record import info

    text, sound = info.describe(options.file) if world.rank == 0 else ("", True)
    if world.rank == 0:
        print(text)
    return DONE if world.bcast(sound) else BAD_INPUT


def _plot(options: argparse.Namespace, world: MPI.Intracomm) -> int:
    from .record import plots  # matplotlib is for pictures only

    if world.rank == 0:
        print(f"picture: {plots.plot(options.directory)}")
    return DONE


def _doctor(options: argparse.Namespace, world: MPI.Intracomm) -> int:
    from .doctor import cases

    outcomes = [cases.examine(case, world, options.precision) for case in cases.CASES]
    wrong = [f"{outcome.case.name}: {text}" for outcome in outcomes for text in outcome.wrong]
    if world.rank == 0:
        print(cases.table(outcomes))
        print("\n".join(wrong) or "all is well")
    return FAILED if wrong else DONE


if __name__ == "__main__":
    sys.exit(main())
