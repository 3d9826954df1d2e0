"""A resolved job as plain data: for YAML, for comparison with other jobs, and as a table with units."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from .calculation import Numerics
from .height_arrays import HeightArray
from .oscillation import Oscillation, Swing
from .part import Part
from .stages import Ramp

MOST_BRANCHES = 6  # largest number of branches that a table shows; of more it shows the first and the last


def plain_data(value: Any) -> Any:
    """Return a value of a job as plain data; keys without a value and keys chosen by the accuracy are left out."""
    if isinstance(value, HeightArray):
        return value.stored()
    if isinstance(value, Part):
        chosen = value.chosen if isinstance(value, Numerics) else ()
        return {key: plain_data(inner) for key, inner in items(value) if key not in chosen}
    if isinstance(value, Ramp):
        velocity = {"velocity": value.velocity} if value.velocity else {}
        start, end = plain_data(value.start), plain_data(value.end)
        return start if value.constant else {"from": start, "to": end, **velocity}
    if isinstance(value, Oscillation):
        return asdict(value)
    if isinstance(value, Swing):
        return {"amplitude": list(value), "frequency": value.frequency}
    if isinstance(value, tuple):
        return [plain_data(inner) for inner in value]
    return str(value) if isinstance(value, Path) else value


def items(part: Part) -> Iterator[tuple[str, Any]]:
    """Return the keys of a part that have a value, with their values; parts as the job gives them."""
    names = (name for name in type(part).model_fields if name not in part.left_out())
    found = ((name, value) for name in names if (value := getattr(part, name)) is not None)
    return ((name, value.given if isinstance(value, Part) else value) for name, value in found)


def plain_job(job: Any) -> dict[str, Any]:
    """Return a job as plain data for its fingerprint, with checksums of input files in place of their paths."""
    data: dict[str, Any] = plain_data(job)
    data["numerics"] |= job.numerics.chosen
    sections = [(data[name], value) for name, value in items(job) if isinstance(value, Part)]
    for part, given in (*zip(data["surface"], job.surface, strict=True), *sections):
        for key in ("path", "spectrum"):
            if isinstance(path := getattr(given, key, None), Path):
                del part[key]
                part["content"] = f"{zlib.crc32(path.read_bytes()):08x}"
        if isinstance(given, HeightArray):
            del part["path"]
            part["content"] = given.heights.checksum
    return data


def unit(part: Part, key: str) -> str:
    """Return the unit of a key, from the brackets in its description; '' if it has none."""
    found = re.search(r"\[([^\],]+)\]", type(part).model_fields[key].description or "")
    return found.group(1) if found and found.group(1) != "-" else ""


def rows(part: Part, path: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield key, value and unit of all keys in a part; each item of a list of parts is one row."""
    for key, value in items(part):
        name = f"{path}{key}"
        if isinstance(value, Part):
            yield from rows(value, f"{name}.")
        elif isinstance(value, tuple) and value and isinstance(value[0], Part):
            shown = list(enumerate(value))
            if key == "branches" and len(value) > MOST_BRANCHES:
                shown = [shown[0], shown[-1]]
            for index, item in shown:
                yield f"{name}.{index}", listed_line(item), ""
                if index == 0 and len(shown) < len(value):
                    yield f"{name}.1 to {len(value) - 2}", "are in job.resolved.yaml", ""
        else:
            yield name, text(value), _unit_of(value, part, key)


def _unit_of(value: Any, part: Part, key: str) -> str:
    """Return the unit of a number, with the velocity of a ramp or the frequency of an oscillation; '' for words such as
    auto, and for mappings."""
    if isinstance(value, Ramp) and value.velocity:
        return f"{unit(part, key)} at {text(value.velocity)} m/s"
    if isinstance(value, Oscillation | Swing):
        return f"{unit(part, key)} at {text(value.frequency)} Hz"
    return "" if isinstance(value, str | Part) else unit(part, key)


def listed_line(part: Part) -> str:
    """Return a part in one line."""
    pairs = [(key, value, _unit_of(value, part, key)) for key, value in items(part)]
    return ", ".join(f"{key} {text(value)} {unit}".rstrip() for key, value, unit in pairs)


def text(value: Any) -> str:
    """Return a value as text, numbers in six digits."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Ramp):
        return text(value.start) if value.constant else f"{text(value.start)} to {text(value.end)}"
    if isinstance(value, Oscillation):
        return f"{text(value.mean)} ± {text(value.amplitude)}"
    if isinstance(value, Part):
        return f"({listed_line(value)})"
    if isinstance(value, tuple):
        more = "±" * isinstance(value, Swing)
        return f"{more}[{', '.join(text(inner) for inner in value)}]"
    return str(value)


def layout(lines: list[tuple[str, str, str]]) -> str:
    """Return rows of key, value and unit as an aligned table, with an empty line between sections."""
    key_width = max(len(key) for key, _, _ in lines)
    value_width = max([len(value) for _, value, unit in lines if unit], default=0)
    out: list[str] = []
    section = lines[0][0].split(".")[0]
    for key, value, unit_text in lines:
        if section != key.split(".")[0]:
            section = key.split(".")[0]
            out.append("")
        out.append(f"{key:<{key_width}}  {value:<{value_width}}  {unit_text}".rstrip())
    return "\n".join(out)
