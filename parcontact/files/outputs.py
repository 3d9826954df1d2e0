"""Files that each verb writes into an output directory, and the marker by which they are recognised.

The marker of a directory has a claim for each verb that wrote it, with its job and the id of its run. Only files that
the marker or a sealed checkpoint identifies are replaced; others are refused or renamed.
"""

import json
import secrets
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ..capabilities import folders
from ..errors import InputError
from . import files

# sections in which all jobs of a directory must agree
SCENE = ("grid", "bands", "surface", "material", *(one.SECTION for one in folders() if hasattr(one, "IN_SCENE")))
_ADDED = {one.SECTION: one for one in folders() if hasattr(one, "SECTION")}
# sections and keys of effects that change completed steps
EFFECTS = tuple(key for one in _ADDED if one not in SCENE for key in getattr(_ADDED[one], "CHANGES_STEPS", (one,)))
SECTIONS = (*SCENE, *_ADDED, "initial", "numerics", "steady")  # sections of a job that a marker keeps


@dataclass(frozen=True)
class Outputs:
    """Names of the files that one verb writes; '' or () if it writes no such files.

    Messages call the results by `words`. If `table` exists, there are results. Further files are `tables`, `maps`
    (HDF5), a `log` and `others`. `copies` are the job as given, and the job with every default. A verb with a directory
    of `checkpoints` continues from the newest one, other verbs from their table; the sections and keys `same` of both
    jobs must agree. `complete` is a sentence on a finished table; its {} stands for the last step or the number of
    points.
    """

    words: str
    table: str
    tables: tuple[str, ...] = ()
    maps: str = ""
    log: str = ""
    others: tuple[str, ...] = ()
    copies: tuple[str, ...] = ()
    checkpoints: str = ""
    same: tuple[str, ...] = ()
    complete: str = ""

    @property
    def written(self) -> tuple[str, ...]:
        """Names of all results, which a new start removes."""
        return tuple(filter(None, (self.table, *self.tables, self.maps, self.log, *self.others)))

    def changes(self, then: Mapping[str, Any], now: Mapping[str, Any]) -> str:
        """Return why a job (plain data) cannot continue another: their differences; '' if it can."""
        return differences(then, now, self.same)

    @property
    def resolved(self) -> str:
        """Name of the job with every default."""
        return self.copies[-1]


STOP = "stop"  # name of the stop file of a run or a sweep
MARCHES = "checkpoint/marches.json"  # finished marches of bands
BANDS, WAVES, CYCLES = "bands.csv", "steady_waves.csv", "cycles.csv"
LOST = "steady.lost.json"  # points of a friction curve without a solution
SWEPT_CURVES = "sweep_curves.csv"  # the points of all friction curves of a sweep
STUDY_TEXT, STUDY_PICTURE = "study.txt", "convergence.png"
STEADY_THEORY, BANDS_THEORY = "steady_theory.csv", "bands_theory.csv"

RUN = Outputs(
    "a run",
    "measures.csv",
    tables=(CYCLES, BANDS),
    maps="fields.h5",
    log="run.log",
    others=("fields.xdmf", MARCHES),
    copies=("job.yaml", "job.resolved.yaml"),
    checkpoints="checkpoint",
    same=(*SCENE, *EFFECTS, "initial", *(f"numerics.{key}" for key in ("integrator", "kernel", "precision", "slope"))),
    complete="its run has finished with step {}",
)
STEADY = Outputs(
    "a friction curve",
    "steady.csv",
    tables=(WAVES, BANDS, STEADY_THEORY, BANDS_THEORY),
    maps="steady.h5",
    log="steady.log",
    others=(LOST,),
    copies=("steady.job.yaml", "steady.resolved.yaml"),
    same=(*SCENE, *EFFECTS, *(f"numerics.{key}" for key in ("kernel", "precision", "slope", "tolerance")), "steady"),
    complete="its curve has {} points",
)
SWEEP = Outputs("a sweep", "sweep.csv", tables=(SWEPT_CURVES, "sweep_mean.csv", "sweep_curves_mean.csv"))
STUDY = Outputs(
    "a study", "study.csv", others=(STUDY_TEXT, STUDY_PICTURE), copies=("study.job.yaml", "study.resolved.yaml")
)
THEORY = Outputs("a theory", "theory.csv", tables=(STEADY_THEORY, BANDS_THEORY), others=("theory.yaml",))
BY_VERB = {"run": RUN, "steady": STEADY, "sweep": SWEEP, "study": STUDY, "theory": THEORY}
LOGS, MAPS = (RUN.log, STEADY.log), (RUN.maps, STEADY.maps)


def find_checkpoints(directory: Path) -> list[tuple[int, Path]]:
    """Return steps and paths of the checkpoints in a directory of results, the newest first."""
    found = directory.glob(f"{RUN.checkpoints}/step-*.h5")
    return sorted(((int(path.stem[5:]), path) for path in found if path.stem[5:].isdecimal()), reverse=True)


MARKER, FORMAT = ".parcontact", 1
SHOWN = 4  # most differences of two jobs in a message


@dataclass(frozen=True)
class Claim:
    """Record of a command in an output directory.

    `job` has the sections of its job, and `id` is the id of its run. `saved` is True after the first checkpoint.
    `finished` is the last step and its time [s] (for a curve: the number of points and 0), None before the end.
    `detached` is a sentence on how the surfaces detached, or ''.
    """

    job: dict[str, Any]
    id: str = field(default_factory=lambda: secrets.token_hex(16))
    saved: bool = False
    finished: tuple[int, float] | None = None
    detached: str = ""


def kept(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sections of a job (plain data) that are stored in the marker file."""
    return {name: data[name] for name in SECTIONS if name in data}


def read_claims(directory: Path) -> dict[str, Claim]:
    """Return the records of commands in a directory, by verb; empty without a marker. Raises OSError or ValueError."""
    path = directory / MARKER
    try:
        text = path.read_bytes()
    except FileNotFoundError:
        return {}
    try:
        data = json.loads(text)
        newer = data.pop("format") > FORMAT
        if not newer:
            return {verb: Claim(**{**claim, "finished": _pair(claim["finished"])}) for verb, claim in data.items()}
    except (ValueError, TypeError, KeyError, AttributeError):
        raise ValueError(f"{path} is damaged") from None
    raise ValueError(f"{path} was written by a newer parcontact")


def sound_claims(directory: Path) -> dict[str, Claim]:
    """Return what `read_claims` returns; raises InputError for an unreadable marker."""
    try:
        return read_claims(directory)
    except (OSError, ValueError) as error:
        raise InputError(str(error)) from error


def detached(directory: Path) -> str:
    """Return how the surfaces of a run detached for good, '' if they did not; raises InputError."""
    claim = sound_claims(directory).get("run")
    return "" if claim is None else claim.detached


def _pair(value: Sequence[float] | None) -> tuple[int, float] | None:
    return None if value is None else (int(value[0]), float(value[1]))


def write_claims(directory: Path, claims: Mapping[str, Claim]) -> None:
    data = {"format": FORMAT, **{verb: asdict(claim) for verb, claim in claims.items()}}
    files.replace_file(directory / MARKER, json.dumps(data, indent=1) + "\n")


def differences(then: Mapping[str, Any], now: Mapping[str, Any], names: Sequence[str]) -> str:
    """Return the first differences of two jobs (plain data) in the named sections (`grid`) or keys (`numerics.kernel`),
    with both values, and the number of further ones; '' if there is none."""
    old, new = dict(_leaves("", then)), dict(_leaves("", now))
    keys = (key for name in names for key in {**old, **new} if f"{key}.".startswith(f"{name}."))
    found = [f"{key} was {old.get(key)}, is {new.get(key)}" for key in keys if old.get(key) != new.get(key)]
    return "; ".join([*found[:SHOWN], *[f"and {len(found) - SHOWN} more"] * (len(found) > SHOWN)])


def keep_mesh(job: Mapping[str, Any], different: str) -> str:
    """Return advice to keep the mesh of a job (plain data) if the text `different` names it, else ''."""
    if "grid.points" not in different:
        return ""
    points = str(job["grid"]["points"]).replace(" ", "")
    return f"give --set grid.points={points} to keep its mesh, or "


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the values in nested mappings and lists by key, such as `surface.0.seed`."""
    if isinstance(value, list) and value and all(isinstance(part, dict) for part in value):
        value = dict(enumerate(value))
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _leaves(f"{name}.{key}" if name else str(key), inner)
    else:
        yield name, value
