"""The marker of an output directory: which verbs of this program write there, for which job, under which run id.

Only what the marker (or a sealed checkpoint) proves to be ours is ever replaced; all else is refused or put aside.
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
SCENE = ("grid", "bands", "surface", "material", "body")  # sections in which all that shares a directory must agree
SHOWN = 4  # differences of two jobs in a message
EFFECTS = ("thermal", "interface", "adhesion.work", "adhesion.range", "adhesion.law")  # keys of steps that were made
SECTIONS = (*SCENE, "thermal", "interface", "adhesion", "initial", "numerics", "steady")  # what a marker keeps of a job


@dataclass(frozen=True)
class Claim:
    """The part of a verb in a directory: the `id` of its run, its job, whether it has `saved` a checkpoint, and the
    step and time after which it has `finished`, of a curve the number of its points; of surfaces that came off, how it
    has `detached`."""

    job: dict[str, Any]
    id: str = field(default_factory=lambda: secrets.token_hex(16))
    saved: bool = False
    finished: tuple[int, float] | None = None
    detached: str = ""


def kept(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a marker keeps of a job as plain data."""
    return {name: data[name] for name in SECTIONS if name in data}


def read_claims(directory: Path) -> dict[str, Claim]:
    """Read the claims of a directory by verb, none where there is no marker; raises OSError, or ValueError."""
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
    """Return the claims of a directory; raises InputError for a marker that cannot be read."""
    try:
        return read_claims(directory)
    except (OSError, ValueError) as error:
        raise InputError(str(error)) from error


def claim_of_run(directory: Path) -> Claim | None:
    """Return the claim of the run in a directory; raises InputError for a marker that cannot be read."""
    return sound_claims(directory).get("run")


def detached(directory: Path) -> str:
    """Return how the surfaces of the run in a directory came off for good, empty where they did not; raises
    InputError."""
    claim = claim_of_run(directory)
    return "" if claim is None else claim.detached


def _pair(value: Sequence[float] | None) -> tuple[int, float] | None:
    return None if value is None else (int(value[0]), float(value[1]))


def write_claims(directory: Path, claims: Mapping[str, Claim]) -> None:
    data = {"format": FORMAT, **{verb: asdict(claim) for verb, claim in claims.items()}}
    files.replace_file(directory / MARKER, json.dumps(data, indent=1) + "\n")


def differences(then: Mapping[str, Any], now: Mapping[str, Any], names: Sequence[str]) -> Iterator[str]:
    """Yield in which of the sections (`grid`) or keys (`numerics.kernel`) two jobs as plain data differ, with both
    values."""
    old, new = dict(_leaves("", then)), dict(_leaves("", now))
    for name in names:
        for key in (key for key in {**old, **new} if f"{key}.".startswith(f"{name}.")):
            if old.get(key) != new.get(key):
                yield f"{key} was {old.get(key)}, is {new.get(key)}"


def list_differences(differences: Iterator[str]) -> str:
    """Return differences in one line: the first of them, and how many more there are."""
    first = list(islice(differences, SHOWN))
    more = sum(1 for _ in differences)
    return "; ".join(first) + (f"; and {more} more" if more else "")


def keep_mesh(job: Mapping[str, Any], different: str) -> str:
    """Return how to keep the mesh of a job, as plain data, where that is among what is `different`; '' elsewhere."""
    if "grid.points" not in different:
        return ""
    points = str(job["grid"]["points"]).replace(" ", "")
    return f"give --set grid.points={points} to keep its mesh, or "


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the values of nested mappings, and of lists of these, by their keys: `surface.0.seed`."""
    if isinstance(value, list) and value and all(isinstance(part, dict) for part in value):
        value = dict(enumerate(value))
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _leaves(f"{name}.{key}" if name else str(key), inner)
    else:
        yield name, value
