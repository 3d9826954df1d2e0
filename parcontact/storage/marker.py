"""The marker of an output directory: which verbs of this program write there, for which job, under which run id.

Only what the marker (or a sealed checkpoint) proves to be ours is ever replaced; all else is refused or put aside.
"""

import json
import secrets
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from . import files

MARKER = ".parcontact"
FORMAT = 1
MAX_BYTES = 1 << 24
VERBS = {"run": "a run", "steady": "a friction curve", "study": "a study"}
SCENE = ("grid", "surface", "material")  # sections in which all that shares a directory must agree
SECTIONS = (*SCENE, "initial", "numerics", "steady")  # what a marker keeps of a job


@dataclass(frozen=True)
class Claim:
    """What a verb has in a directory: the `id` of its run, its job, whether it has `saved` a checkpoint, and the step
    and time after which it has `finished`."""

    job: dict[str, Any]
    id: str = field(default_factory=lambda: secrets.token_hex(16))
    saved: bool = False
    finished: tuple[int, float] | None = None


def kept(data: Mapping[str, Any]) -> dict[str, Any]:
    """What a marker keeps of a job as plain data."""
    return {name: data[name] for name in SECTIONS if name in data}


def read(directory: Path) -> dict[str, Claim]:
    """The claims of a directory by verb, none where there is no marker; raises OSError, ValueError for a bad one."""
    path = directory / MARKER
    try:
        with path.open("rb") as file:
            text = file.read(MAX_BYTES)
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


def _pair(value: Sequence[float] | None) -> tuple[int, float] | None:
    return None if value is None else (int(value[0]), float(value[1]))


def write(directory: Path, claims: Mapping[str, Claim]) -> None:
    """Replace the marker."""
    data = {"format": FORMAT, **{verb: asdict(claim) for verb, claim in claims.items()}}
    files.write(directory / MARKER, json.dumps(data, indent=1) + "\n")


def differences(then: Mapping[str, Any], now: Mapping[str, Any], names: Sequence[str]) -> Iterator[str]:
    """In which of the sections (`grid`) or keys (`numerics.kernel`) two jobs as plain data differ, with both values."""
    for name in names:
        section, _, key = name.partition(".")
        old, new = then.get(section), now.get(section)
        yield from (
            _differences(name, (old or {}).get(key), (new or {}).get(key)) if key else _differences(name, old, new)
        )


def _differences(name: str, then: Any, now: Any) -> Iterator[str]:
    if isinstance(then, dict) and isinstance(now, dict):
        for key in [*then, *(key for key in now if key not in then)]:
            yield from _differences(f"{name}.{key}", then.get(key), now.get(key))
    elif _parts(then) and _parts(now) and len(then) == len(now):
        for index, (old, new) in enumerate(zip(then, now, strict=True)):
            yield from _differences(f"{name}.{index}", old, new)
    elif then != now:
        yield f"{name} was {then}, is {now}"


def _parts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(part, dict) for part in value)
