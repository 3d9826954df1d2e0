"""What the words of a command line mean: verbs and their options."""

from __future__ import annotations

import argparse
import difflib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from .. import __version__
from ..errors import InputError
from . import guides, ranks, values, verbs

VERBS = (
    *("run", "steady", "check", "plan", "theory", "fit", "surface", "study", "info", "plot", "report", "doctor"),
    *("manual", "schema", "cite", "completion"),
)
FIRST = """\
a job is needed: a YAML file that says what is pressed on what. jobs/hertz.yaml is one to begin with.

  parcontact check job.yaml             list its mistakes, or all that it says with every default
  parcontact plan job.yaml              say what it will do and cost
  parcontact job.yaml                   run it, or go on with it (on two cores: mpirun -n 2 parcontact job.yaml)
  parcontact plot out/job               draw what came out

parcontact --help lists all verbs, parcontact VERB --help the options of one, parcontact manual the manual"""
CODES = """\
exit codes: 0 as asked; 1 the run failed; 2 bad job or bad input, nothing was written; 3 stopped early with a good
checkpoint, run again"""


def understand(words: Sequence[str]) -> argparse.Namespace:
    """The options of a command line; `act` is its verb. Raises InputError or SystemExit for what cannot be meant."""
    if not words:
        raise InputError(FIRST)
    first, *rest = words
    if first == "help":
        words = [*(word for word in rest if word in VERBS), "--help"]
    elif first not in (*VERBS, "-h", "--help", "--version"):
        _refuse_misspelt(first)
        words = ["run", *words]
    return _parser().parse_args(words)


def _refuse_misspelt(word: str) -> None:
    """A word that is no file, does not look like a job and is close to a verb."""
    path = Path(word)
    close = difflib.get_close_matches(word.lower(), (*VERBS, "help"), n=1)
    if close and not path.suffix and path.name == word and not path.exists():
        raise InputError(f"{word!r} is neither a verb nor a job file; did you mean {close[0]}?")


class _Parser(argparse.ArgumentParser):
    """Speaks on root only, and ends the other ranks well unless MPI ends them together."""

    def _print_message(self, message: str, file: Any = None) -> None:
        if ranks.is_root():
            super()._print_message(message, file)

    def exit(self, status: int = 0, message: str | None = None) -> NoReturn:
        super().exit(status if ranks.is_root() or ranks.started() else 0, message)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="parcontact",
        description="Transient contact of a rough rigid surface on a viscoelastic half space.",
        epilog=f"A first argument that is no verb is a job: mpirun -n 2 parcontact job.yaml\n\n{CODES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"parcontact {__version__}")
    found = parser.add_subparsers(dest="verb", required=True, metavar="verb")

    run = found.add_parser("run", help="run a job, or go on with it (the default verb)")
    _job_arguments(run)
    text = (
        "go on from the newest good checkpoint if there is one (auto, the default), start afresh and replace what is "
        "there (never), or go on from the checkpoint PATH"
    )
    run.add_argument("--restart", metavar="auto|never|PATH", default="auto", help=text)
    text = (
        "stop after the first step that reaches the time T [s] of the history; one that ends before goes on with its "
        "last stage"
    )
    run.add_argument("--until", metavar="T", type=values.seconds, help=text)
    text = "stop early, with a checkpoint, to end within this wall time"
    run.add_argument("--wall", metavar="HH:MM:SS", type=values.wall, help=text)
    run.add_argument("--quiet", action="store_true", help="print only warnings and errors")
    run.set_defaults(act=verbs.run)

    steady = found.add_parser("steady", help="solve steady sliding directly: a friction curve")
    _job_arguments(steady)
    for name, unit in (("velocities", "m/s"), ("pressures", "Pa")):
        text = f"{name} [{unit}]: N from A to B, equally spaced in the logarithm, or a list A,B,..."
        steady.add_argument(f"--{name}", metavar="A:B:N", type=values.numbers, default=(), help=text)
    text = "temperatures [deg C], T,T,... (negative ones first: --temperatures=-20,0); the material needs a shift"
    steady.add_argument("--temperatures", metavar="T,...", type=values.degrees, default=(), help=text)
    text = "go on with the points that lack (auto, the default), or start afresh and replace what is there (never)"
    steady.add_argument("--restart", metavar="auto|never", choices=("auto", "never"), default="auto", help=text)
    steady.add_argument("--quiet", action="store_true", help="print only warnings and errors")
    steady.set_defaults(act=verbs.steady)

    check = found.add_parser("check", help="list all mistakes of a job, or what it says with every default")
    _job_arguments(check)
    check.set_defaults(act=verbs.check)

    plan = found.add_parser("plan", help="say what a job will do, and what it costs on so many ranks; writes nothing")
    _job_arguments(plan)
    text = "numbers of ranks, N,N,... (default: 1 and as many as there are cores here, or as many as plan)"
    plan.add_argument("--ranks", metavar="N,...", type=values.counts, default=(), help=text)
    text = "for how long the job is tried [s]"
    plan.add_argument("--seconds", metavar="T", type=values.seconds, default=10.0, help=text)
    plan.add_argument("--cores", metavar="N", type=values.count, help="cores of a node of the machine that it is for")
    text = "of that machine's network: seconds of a message, bytes per second of a node (default: 2e-6,12.5e9)"
    plan.add_argument("--network", metavar="ALPHA,BETA", type=values.network, help=text)
    plan.add_argument("--sample", type=Path, help=argparse.SUPPRESS)  # by which a plan starts others,
    plan.add_argument("--sample-points", type=values.counts, default=(), help=argparse.SUPPRESS)  # on the same grid
    plan.set_defaults(act=verbs.plan)

    theory = found.add_parser("theory", help="say what Persson's theory predicts for a job, into theory.csv")
    _job_arguments(theory)
    text = "factor that corrects friction in partial contact, 0 to 1 (1: not at all; default: 0.45)"
    theory.add_argument("--gamma", metavar="G", type=values.share, default=0.45, help=text)
    text = "waves of the job's spectrum (continuum, the default), or those of the surface in its box (lattice)"
    theory.add_argument("--waves", choices=("continuum", "lattice"), default="continuum", help=text)
    theory.add_argument("--quiet", action="store_true", help="print only warnings and errors")
    theory.set_defaults(act=verbs.theory)

    fit = found.add_parser("fit", help="fit a compound to measured moduli: a material file and a picture")
    fit.add_argument("table", type=Path, help="measured moduli: a table with the names and units of its columns")
    fit.add_argument("--out", metavar="FILE", type=Path, help="material file (default: the table's name with .yaml)")
    text = "temperature [deg C] at which relaxation times are given (default: the middle one of those measured)"
    fit.add_argument("--reference", metavar="T", type=float, help=text)
    text = (
        "how times depend on temperature: wlf (default) or arrhenius with fitted constants, free factors, or given "
        "ones: wlf:C1,C2 or arrhenius:J/mol or a file with the columns T[C] and log_aT"
    )
    fit.add_argument("--shift", metavar="LAW", default="wlf", help=text)
    text = "rms error of the logarithms of the moduli that is allowed beside the scatter of the data (default: 0.02)"
    fit.add_argument("--error", metavar="E", type=values.positive, default=0.02, help=text)
    text = "which moduli the fit meets, where storage and loss contradict each other (default: both)"
    fit.add_argument("--weight", choices=("both", "storage", "loss"), default="both", help=text)
    fit.add_argument("--poisson", metavar="NU", type=values.poisson, default=0.5, help="Poisson's ratio (default: 0.5)")
    fit.add_argument("--job", metavar="JOB", help="a job whose frequencies are shaded in the picture")
    fit.set_defaults(act=verbs.fit)

    study = found.add_parser("study", help="compare settings of a job: what accuracy costs; goes on after a stop")
    _job_arguments(study)
    study.add_argument("--quiet", action="store_true", help="print only warnings and errors")
    study.set_defaults(act=verbs.study)

    text = "say what the surface of a job, or a measured map, is like, and draw it"
    surface = found.add_parser("surface", help=text)
    _job_arguments(surface, "job file (YAML), or a measured map; of one without unit: --set surface.unit=um ...")
    surface.add_argument("--job", dest="start", metavar="FILE", type=Path, help="write a job to start from (of a map)")
    surface.set_defaults(act=verbs.surface)

    info = found.add_parser("info", help="say what checkpoints, files of fields and directories hold, and if sound")
    info.add_argument("file", type=Path, nargs="+", help="a file, or the output directory of a run")
    info.set_defaults(act=verbs.info)

    plot = found.add_parser("plot", help="draw pictures of runs and friction curves, compare them, make a movie")
    _plot_arguments(plot)
    plot.set_defaults(act=verbs.plot)

    report = found.add_parser("report", help="write one HTML file to send: what was asked, results, data, origin")
    report.add_argument("directories", metavar="OUT", nargs="+", type=Path, help="an output directory")
    report.add_argument("--out", metavar="FILE", type=Path, help="default: report.html in the first directory")
    report.set_defaults(act=verbs.report)

    doctor = found.add_parser("doctor", help="run small hard cases on this machine, and say what came out of each")
    doctor.add_argument("--precision", choices=("double", "mixed"), default="double")
    doctor.set_defaults(act=verbs.doctor)

    guides.add_verbs(found, parser)
    return parser


def _job_arguments(parser: argparse.ArgumentParser, text: str = "job file (YAML)") -> None:
    parser.add_argument("job", help=text)
    parser.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], help="override a key of the job")
    parser.add_argument("--out", metavar="DIR", type=values.directory, help="output directory")
    text = "one case of the job's sweep, from 0 (default: all)"
    parser.add_argument("--case", metavar="I", type=values.natural, help=text)


def _plot_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("directories", metavar="OUT", nargs="+", type=Path, help="output directory of a run or curve")
    parser.add_argument("--format", choices=("png", "pdf", "svg"), default="", help="default: that of --out, else png")
    text = "which panels, in this order: friction,area,approach,gap,pressure,load,energy,steady,maps (default: all)"
    parser.add_argument("--panels", metavar="NAME,...", type=values.names, default=(), help=text)
    text = "what is along the x axis (default: as the job suggests)"
    parser.add_argument("--over", choices=("time", "distance", "velocity", "load"), default="", help=text)
    parser.add_argument(
        "--log", metavar="x,y", type=values.names, default=(), help="logarithmic axes: x, y, x,y or none"
    )
    parser.add_argument("--compare", action="store_true", help="several directories in one picture, comparison.png")
    text = "a movie of this map over its saved instants instead (GIF): pressure, displacement, gap or height"
    parser.add_argument("--movie", metavar="FIELD", default="", help=text)
    text = "draw the maps saved after this step (a whole number), or nearest to this time [s]; default: the last ones"
    parser.add_argument("--at", metavar="TIME|STEP", type=values.instant, help=text)
    parser.add_argument("--out", metavar="FILE", type=Path, help="the picture (default: picture.png in the directory)")
