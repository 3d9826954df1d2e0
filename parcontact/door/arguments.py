"""Arguments of the command line: one table of verbs with their options.

The text of an option is converted to its value here; an error says what was expected.
"""

from __future__ import annotations

import argparse
import difflib
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from .. import __version__, capabilities
from ..errors import InputError
from . import verbs

T = TypeVar("T")
INFINITE = float("inf")


def checked(convert: Callable[[str], T], accepts: Callable[[T], bool], expected: str) -> Callable[[str], T]:
    """Return a function that converts a text to a value.

    It raises ArgumentTypeError if `convert` fails with ValueError, or if `accepts` returns False for the value; the
    message has the words `expected`.
    """

    def value_of(text: str) -> T:
        try:
            value = convert(text)
        except ValueError:
            value = None
        if value is None or not accepts(value):
            raise argparse.ArgumentTypeError(f"must be {expected}, got {text!r}")
        return value

    return value_of


def _floats(text: str) -> tuple[float, ...]:
    return tuple(map(float, text.split(",")))


def wall_seconds(text: str) -> float:
    """Return the seconds in a text [[HH:]MM:]SS or D-HH:MM:SS; 0 for other texts."""
    days, dash, rest = text.rpartition("-")
    fields = rest.split(":")
    try:
        if len(fields) > 3:
            return 0.0
        seconds = sum(float(field) * 60.0**power for power, field in enumerate(reversed(fields)))
        return seconds + (86400.0 * int(days) if dash else 0.0)
    except ValueError:
        return 0.0


seconds = checked(float, lambda value: 0.0 <= value < INFINITE, "a time [s] of zero or more")
wall = checked(wall_seconds, lambda value: 0.0 < value < INFINITE, "a wall time HH:MM:SS")
natural = checked(int, lambda value: value >= 0, "a whole number of zero or more")
counts = checked(
    lambda text: tuple(map(int, text.split(","))), lambda values: min(values) > 0, "positive whole numbers"
)
pressure = checked(float, lambda value: 0.0 <= value < INFINITE, "a pressure [Pa] of zero or more")
positive = checked(float, lambda value: 0.0 < value < INFINITE, "a positive number")
share = checked(float, lambda value: 0.0 <= value <= 1.0, "a number from 0 to 1")
poisson = checked(float, lambda value: -1.0 < value <= 0.5, "a Poisson ratio above -1 and up to 0.5")
degrees = checked(_floats, bool, "a list of temperatures [deg C]")


def instant(text: str) -> str:
    """Return a text that gives a step (digits) or a time [s], without spaces around it. Raises ArgumentTypeError for
    another text."""
    checked(float, lambda value: 0.0 <= value < INFINITE, "a step, as a whole number, or a time [s]")(text)
    return text.strip()


def output_directory(text: str) -> str:
    if not text:
        raise argparse.ArgumentTypeError("must name a directory, got ''")
    return str(Path.cwd() / text) if text.startswith("~") else text  # the shell has expanded home directories


def results_path(text: str) -> Path:
    """Return the path of an existing output directory or file of results. Raises InputError for pipes and devices."""
    from ..files import files

    files.refuse_pipes(Path(text))
    return Path(text)


def comma_names(text: str) -> tuple[str, ...]:
    return tuple(filter(None, (part.strip() for part in text.split(","))))


def spaced_numbers(text: str) -> tuple[float, ...]:
    """Return numbers equally spaced in the logarithm, from `first:last:count`, or from a list `a,b,c`."""
    try:
        return _spaced(text) if ":" in text else _floats(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be first:last:count or a list of numbers, got {text!r}") from None


def _spaced(text: str) -> tuple[float, ...]:
    from ..job import log_range

    first, last, number = text.split(":")
    if min(float(first), float(last)) <= 0.0:
        reason = "is equally spaced in the logarithm; first and last must be above 0"
        raise argparse.ArgumentTypeError(f"a range first:last:count {reason}, got {text!r}")
    if int(number) < 2 and first != last:
        raise argparse.ArgumentTypeError(f"a range first:last:count must have a count of 2 or more, got {text!r}")
    return log_range(text)


def fluid(text: str) -> Any:
    """Return the fluid with a name, or with a viscosity [Pa s]."""
    from ..effects.leakage.flow import FLUIDS, Fluid

    if text in FLUIDS:
        return FLUIDS[text]
    known = f"a fluid ({', '.join(FLUIDS)}) or a positive viscosity [Pa s]"
    return Fluid("the fluid", checked(float, lambda value: 0.0 < value < INFINITE, known)(text))


def pressure_drop(text: str) -> tuple[float, float]:
    """Return the two pressures [Pa] in a text HIGH:LOW."""
    try:
        high, low = map(float, text.split(":"))
    except ValueError:
        high, low = 0.0, 0.0
    if not 0.0 <= low < high < INFINITE:
        raise argparse.ArgumentTypeError(f"must be HIGH:LOW [Pa], such as 2e5:1e5, got {text!r}")
    return high, low


FIRST = """\
a job is needed: a YAML file that describes surface, material and loads. A clone has examples, such as jobs/slide.yaml:

  parcontact check jobs/slide.yaml          list its mistakes, or all its keys with every default
  mpirun -n 2 parcontact jobs/slide.yaml    run it on two cores, or continue it
  parcontact plot out/slide                 draw the results, into out/slide/picture.png
  parcontact report out/slide               write the results as one HTML page
  parcontact manual start                   read how to write a job of your own in five minutes

parcontact --help lists all verbs, parcontact VERB --help the options of one, parcontact manual all pages"""
CODES = """\
exit codes: 0 success; 1 the run failed; 2 bad job or bad input, nothing was written; 3 stopped early with a good
checkpoint, run again"""


Add = Callable[..., Any]  # the method add_argument of a verb's parser


def _job(add: Add, text: str = "job file (YAML)", out: tuple[str, str] = ("DIR", "output directory")) -> None:
    add("job", help=text)
    add("--set", metavar="KEY=VALUE", action="append", default=[], help="override a key of the job")
    add("--out", metavar=out[0], type=output_directory, help=out[1])
    text = "one case of the job's sweep, from 0 (default: all)"
    add("--case", metavar="I", type=natural, help=text)


def _quiet(add: Add) -> None:
    add("--quiet", action="store_true", help="print only warnings and errors")


def _run(add: Add) -> None:
    text = (
        "continue from the newest good checkpoint if there is one (auto, the default), start from the beginning and "
        "replace the results (never), or continue from the checkpoint PATH"
    )
    add("--restart", metavar="auto|never|PATH", default="auto", help=text)
    text = (
        "stop after the first step that reaches the time T [s]; a history that ends earlier is continued with its last "
        "stage"
    )
    add("--until", metavar="T", type=seconds, help=text)
    text = (
        "stop early with a checkpoint, so that the run ends within this wall time, of which 5 s and twice the longest "
        "step are kept in reserve"
    )
    add("--wall", metavar="HH:MM:SS", type=wall, help=text)


def _steady(add: Add) -> None:
    for name, unit in (("velocities", "m/s"), ("pressures", "Pa")):
        text = f"{name} [{unit}]: N values from A to B, equally spaced in the logarithm, or a list A,B,..."
        add(f"--{name}", metavar="A:B:N", type=spaced_numbers, default=(), help=text)
    text = "temperatures [deg C], T,T,... (if the first is negative: --temperatures=-20,0); the material needs a shift"
    add("--temperatures", metavar="T,...", type=degrees, default=(), help=text)
    text = "add missing points (auto, the default), or start from the beginning and replace the results (never)"
    add("--restart", metavar="auto|never", choices=("auto", "never"), default="auto", help=text)


def _plan(add: Add) -> None:
    text = "numbers of ranks of the estimates, N,N,... (default: 1, the ranks started, and all cores)"
    add("--ranks", metavar="N,...", type=counts, default=(), help=text)
    add("--seconds", metavar="T", type=seconds, default=10.0, help="CPU time of the whole plan [s] (default: 10)")


def _theory(add: Add) -> None:
    text = "factor that corrects friction in partial contact, 0 to 1 (1: no correction; default: 0.45)"
    add("--gamma", metavar="G", type=share, default=0.45, help=text)
    text = "waves of the job's spectrum (continuum, the default), or waves of the surface in its box (lattice)"
    add("--waves", choices=("continuum", "lattice"), default="continuum", help=text)


def _fit(add: Add) -> None:
    add("table", type=Path, help="table of measured moduli, with names and units of its columns")
    add("--out", metavar="FILE", type=Path, help="material file (default: the table's name with .yaml)")
    text = "temperature [deg C] of the relaxation times (default: the median of the measured temperatures)"
    add("--reference", metavar="T", type=float, help=text)
    text = (
        "how relaxation times depend on temperature: wlf (default) or arrhenius with fitted constants; free (a factor "
        "per temperature); or given: wlf:C1,C2, arrhenius:J/mol, or a file with columns T[C], log_aT and optionally "
        "log_bT"
    )
    add("--shift", metavar="LAW", default="wlf", help=text)
    text = (
        "how moduli depend on temperature: density (density times temperature), free factors, none, or auto (default): "
        "density, unless the sweeps fit better with none"
    )
    add("--vertical", choices=("auto", "density", "free", "none"), default="auto", help=text)
    text = "limit on the relative error of both moduli by the number of branches (default: 0.02)"
    add("--error", metavar="E", type=positive, default=0.02, help=text)
    text = "moduli that the fit follows where storage and loss moduli contradict each other (default: both)"
    add("--weight", choices=("both", "storage", "loss"), default="both", help=text)
    add("--poisson", metavar="NU", type=poisson, default=0.5, help="Poisson's ratio (default: 0.5)")
    add("--job", metavar="JOB", help="job whose frequencies are shaded in the picture")


def _surface(add: Add) -> None:
    text = "job file (YAML), or a measured map; a map without unit needs --set surface.unit=um ..."
    _job(add, text, ("FILE", "picture: .png, .pdf or .svg"))
    add("--job", dest="start", metavar="FILE", type=Path, help="write a job for the measured map to this file")


def _plot(add: Add) -> None:
    add("directories", metavar="OUT", nargs="+", type=results_path, help="output directory of a run or curve")
    add("--format", choices=("png", "pdf", "svg"), default="", help="format (default: by the name of --out, else png)")
    names = "friction,area,approach,gap,pressure,load,energy,leakage,steady,maps"
    text = f"panels, in this order: {names} (default: all)"
    add("--panels", metavar="NAME,...", type=comma_names, default=(), help=text)
    text = "quantity on the x axis (default: chosen by the job)"
    add("--over", choices=("time", "distance", "velocity", "load", "approach"), default="", help=text)
    add("--log", metavar="x,y", type=comma_names, default=(), help="logarithmic axes: x, y, x,y or none")
    add("--compare", action="store_true", help="draw several directories in one picture, comparison.png")
    text = (
        "draw a movie of this map instead: pressure, displacement, gap or height; a GIF, and an MP4 if ffmpeg is "
        "installed"
    )
    add("--movie", metavar="FIELD", default="", help=text)
    text = "draw the maps saved after this step (a whole number) or nearest to this time [s] (default: the last ones)"
    add("--at", metavar="TIME|STEP", type=instant, help=text)
    add("--out", metavar="FILE", type=Path, help="picture (default: picture.png in the directory)")


def _info(add: Add) -> None:
    add("file", type=results_path, nargs="+", help="file or output directory of a run")


def _leak(add: Add) -> None:
    text = "output directory of a run with saved gaps"
    add("directories", metavar="OUT", nargs="+", type=results_path, help=text)
    text = "only the gap after this step (a whole number) or nearest to this time [s], such as 2.5 (default: all)"
    add("--at", metavar="TIME|STEP", type=instant, help=text)
    text = "quantity on the x axis (default: pressure, or time if the pressure is constant)"
    add("--over", choices=("pressure", "time"), default="", help=text)
    text = "fluid whose flow is added to the table: water, air, nitrogen, helium, or a viscosity [Pa s]"
    add("--fluid", metavar="FLUID", type=fluid, help=text)
    text = "pressures of the fluid at both ends [Pa]; absolute pressures for a gas"
    add("--pressures", metavar="HIGH:LOW", type=pressure_drop, help=text)
    text = (
        "load of the job: net of the pressure of the fluid (default), or the total, of which the fluid carries a part"
    )
    add("--load", choices=("net", "total"), default="net", help=text)
    text = "pressure [Pa] over which the total load is measured (default: the low one)"
    add("--ambient", metavar="P", type=pressure, help=text)


def _report(add: Add) -> None:
    add("directories", metavar="OUT", nargs="+", type=results_path, help="output directory")
    add("--out", metavar="FILE", type=Path, help="report (default: report.html in the first directory)")


def _export(add: Add) -> None:
    add("directory", metavar="OUT", type=results_path, help="output directory of a friction curve or a run")
    text = "friction.csv with units (csv, the default), or friction.inp with a table *FRICTION (abaqus)"
    add("--format", choices=("abaqus", "csv"), default="csv", help=text)
    add("--out", metavar="FILE", type=Path, help="table (default: in the directory)")


def _doctor(add: Add) -> None:
    add("--precision", choices=("double", "mixed"), default="double")


def _manual(add: Add) -> None:
    add("page", nargs="?", default="", help="name of a page (default: list all pages)")


def _cite(add: Add) -> None:
    add("directory", metavar="OUT", type=results_path, help="output directory of a run or curve")


VERBS: dict[Callable[[argparse.Namespace], int], tuple[Callable[[Add], None], ...]] = {  # verb: groups of arguments
    verbs.run: (_job, _run, _quiet),
    verbs.steady: (_job, _steady, _quiet),
    verbs.check: (_job,),
    verbs.plan: (_job, _plan),
    verbs.theory: (_job, _theory, _quiet),
    verbs.fit: (_fit,),
    verbs.study: (_job, _quiet),
    verbs.surface: (_surface,),
    verbs.info: (_info,),
    verbs.plot: (_plot,),
    **({verbs.leak: (_leak,)} if capabilities.has("leakage") else {}),
    verbs.report: (_report,),
    verbs.export: (_export,),
    verbs.doctor: (_doctor,),
    verbs.manual: (_manual,),
    verbs.schema: (),
    verbs.cite: (_cite,),
}
COMPLETION = "--print-completion"
NAMES = tuple(verb.__name__ for verb in VERBS)


def parse_arguments(words: Sequence[str]) -> argparse.Namespace:
    """Return the options of a command line; `options.act` is the function of its verb. Raises InputError or SystemExit
    for mistakes."""
    if not words:
        raise InputError(FIRST)
    first, *rest = words
    if first == "help":
        words = [*(word for word in rest if word in NAMES), "--help"]
    elif first not in (*NAMES, "-h", "--help", "--version", COMPLETION):
        _refuse_misspelt(first)
        words = ["run", *words]
    requeued = os.environ.get("SLURM_RESTART_COUNT", "") not in ("", "0")  # a requeued job continues its run
    return make_parser().parse_args(without_restart(words) if requeued else words)


def without_restart(words: Sequence[str]) -> list[str]:
    """Return the words of the command line that continues the run which the command line `words` started."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--restart")
    return parser.parse_known_args(words)[1]


def _refuse_misspelt(word: str) -> None:
    """Raise InputError for a word that resembles a verb and neither is nor looks like a file."""
    path = Path(word)
    close = difflib.get_close_matches(word.lower(), (*NAMES, "help"), n=1)
    if close and not path.suffix and path.name == word and not path.exists():
        raise InputError(f"{word!r} is neither a verb nor a job file; did you mean {close[0]}?")


class _PrintCompletion(argparse.Action):
    """Prints a shell's completion script, and ends the program."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: Any, shell: Any, option: str | None = None) -> None:
        import shtab  # used here only

        print(shtab.complete(parser, shell=shell))
        parser.exit()


class _Parser(argparse.ArgumentParser):
    """Prints on root only; other ranks exit with code 0 unless MPI has started."""

    def _print_message(self, message: str, file: Any = None) -> None:
        if verbs.is_root():
            super()._print_message(message, file)

    def exit(self, status: int = 0, message: str | None = None) -> NoReturn:
        super().exit(status if verbs.is_root() or verbs.started() else 0, message)


def make_parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line."""
    parser = _Parser(
        prog="parcontact",
        description="Transient contact of a rough rigid surface on a viscoelastic half space.",
        epilog=f"Without a verb, a job is run: mpirun -n 2 parcontact job.yaml\n\n{CODES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"parcontact {__version__}")
    text = "print a script that completes verbs and options in the shell (see parcontact manual install)"
    parser.add_argument(COMPLETION, choices=("bash", "zsh", "tcsh"), action=_PrintCompletion, help=text)
    found = parser.add_subparsers(dest="verb", required=True, metavar="verb")
    for verb in VERBS:
        said = str(verb.__doc__)
        _add_arguments(found.add_parser(verb.__name__, help=said[0].lower() + said[1:-1]), verb)
    return parser


def _add_arguments(parser: argparse.ArgumentParser, verb: Callable[[argparse.Namespace], int]) -> None:
    for add_arguments in VERBS[verb]:
        add_arguments(parser.add_argument)
    parser.set_defaults(act=verb, describe_verbs=describe_verbs)


def describe_verbs() -> str:
    """Return the help of each verb, for the manual."""
    sections = []
    for verb in VERBS:
        own = _Parser(prog=f"parcontact {verb.__name__}")
        _add_arguments(own, verb)
        sections.append(f"\n## `{verb.__name__}`\n\n```text\n{own.format_help().rstrip()}\n```")
    return "\n".join(sections)
