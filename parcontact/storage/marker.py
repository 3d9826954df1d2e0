"""The marker of an output directory: the verbs that wrote it, their jobs and run ids.

Only files that the marker or a sealed checkpoint identifies are replaced; others are refused or renamed.
"""

import json
import secrets
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

from ..errors import InputError
from . import files

MARKER = ".parcontact"
FORMAT = 1
VERBS = {"run": "a run", "steady": "a friction curve", "study": "a study"}
# sections in which all jobs of a directory must agree
SCENE = ("grid", "bands", "surface", "material", "body", "counterbody")
SHOWN = 4  # most differences of two jobs in a message
EFFECTS = (
    "thermal",
    "interface",
    "adhesion.work",
    "adhesion.range",
    "adhesion.law",
    *(f"leakage.{key}" for key in ("load", "pressures", "ambient", "fluid")),
)  # keys that change completed steps
SECTIONS = (
    *SCENE,
    "thermal",
    "interface",
    "adhesion",
    "leakage",
    "initial",
    "numerics",
    "steady",
)  # sections of a job that a marker keeps


@dataclass(frozen=True)
class Claim:
    """The claim of a verb: the `id` of its run, its job, and whether it `saved` a checkpoint; the step and time (of a
    curve: the number of points) after which it `finished`; how surfaces `detached`."""

    job: dict[str, Any]
    id: str = field(default_factory=lambda: secrets.token_hex(16))
    saved: bool = False
    finished: tuple[int, float] | None = None
    detached: str = ""


def kept(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sections of a job (plain data) that a marker keeps."""
    return {name: data[name] for name in SECTIONS if name in data}


def read_claims(directory: Path) -> dict[str, Claim]:
    """Read the claims of a directory by verb, none without a marker; raises OSError or ValueError."""
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
    """Return the claims of a directory; raises InputError for an unreadable marker."""
    try:
        return read_claims(directory)
    except (OSError, ValueError) as error:
        raise InputError(str(error)) from error


def claim_of_run(directory: Path) -> Claim | None:
    """Return the claim of the run in a directory, or None; raises InputError for an unreadable marker."""
    return sound_claims(directory).get("run")


def detached(directory: Path) -> str:
    """Return how the surfaces of a run detached for good, '' if they did not; raises InputError."""
    claim = claim_of_run(directory)
    return "" if claim is None else claim.detached


def _pair(value: Sequence[float] | None) -> tuple[int, float] | None:
    return None if value is None else (int(value[0]), float(value[1]))


def write_claims(directory: Path, claims: Mapping[str, Claim]) -> None:
    data = {"format": FORMAT, **{verb: asdict(claim) for verb, claim in claims.items()}}
    files.replace_file(directory / MARKER, json.dumps(data, indent=1) + "\n")


def differences(then: Mapping[str, Any], now: Mapping[str, Any], names: Sequence[str]) -> Iterator[str]:
    """Yield the differences of two jobs (plain data) in the named sections (`grid`) or keys (`numerics.kernel`), with
    both values."""
    old, new = dict(_leaves("", then)), dict(_leaves("", now))
    for name in names:
        for key in (key for key in {**old, **new} if f"{key}.".startswith(f"{name}.")):
            if old.get(key) != new.get(key):
                yield f"{key} was {old.get(key)}, is {new.get(key)}"


def list_differences(differences: Iterator[str]) -> str:
    """Return the first differences and the number of further ones, in one line."""
    first = list(islice(differences, SHOWN))
    more = sum(1 for _ in differences)
    return "; ".join(first) + (f"; and {more} more" if more else "")


def keep_mesh(job: Mapping[str, Any], different: str) -> str:
    """Return advice to keep the mesh of a job (plain data) if it is among the differences, else ''."""
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
