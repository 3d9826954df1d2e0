"""Every job of the project and of its manual, made as small as it allows, for tests of what a user does with it."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from marched_jobs import ROOT

from parcontact.door import manual_texts
from parcontact.errors import InputError
from parcontact.job import yaml_text
from parcontact.march import mesh

POINTS = (12, 16, 24, 32, 48, 64, 96, 128, 160, 256)  # tried one after the other
MOST_STEPS = 20  # of equal steps of a stage
PARTS = {"surface", "material"}  # a block of YAML with these and one of LOADS is a whole job
LOADS = {"history", "steady"}
PLAIN = {"title", "grid", "surface", "material", "history", "numerics", "output", "checkpoint"}
Json = dict[str, Any]


class Found(NamedTuple):
    """A job as text, its name, and the directory of files that it names."""

    name: str
    text: str
    directory: Path


def every_job() -> Iterator[Found]:
    """Yield all jobs of `jobs/`, and all whole jobs of the manual and the README."""
    for path in sorted((ROOT / "jobs").rglob("*.yaml")):
        if "materials" not in path.parts:
            yield Found(path.relative_to(ROOT / "jobs").with_suffix("").as_posix(), path.read_text(), path.parent)
    pages = {name: manual_texts.page(name, {"verbs": lambda: ""}) for name in manual_texts.page_names()}
    for name, page in {**pages, "README": (ROOT / "README.md").read_text()}.items():
        for index, text in enumerate(re.findall(r"^```yaml\n(.*?)^```", page, re.MULTILINE | re.DOTALL)):
            yield Found(f"{name} {index}", text, ROOT / "jobs" / "road")


def is_whole(found: Found) -> bool:
    """Return True if a text is a job, not a material or a part of a job."""
    data = yaml.safe_load(found.text)
    return (
        isinstance(data, dict)
        and data.keys() >= PARTS
        and bool(data.keys() & LOADS)
        and bool(data.keys() & {"grid", "bands"})
    )


JOBS = {found.name: found for found in every_job() if is_whole(found)}


def smallest(found: Found, directory: Path) -> Path:
    """Write the smallest version of a job that is accepted into `directory`, next to its files; return its path."""
    for part in ("measured", "materials"):
        if (found.directory / part).exists() and not (directory / part).exists():
            (directory / part).symlink_to(found.directory / part)
    for path in found.directory.glob("*.yaml"):
        if not (directory / path.name).exists():
            (directory / path.name).symlink_to(path)
    data, path = reduced(yaml_text.parse(found.text, found.name).data), directory / "small.yaml"
    for points in POINTS if "bands" not in data else (0,):
        if points:
            data["grid"] = {**data["grid"], "points": [points if n > 1 else 1 for n in _pair(data["grid"]["points"])]}
            if "sweep" in data:
                data["sweep"] = [_of_points(one, points) for one in _list(data["sweep"])]
        path.write_text(yaml.safe_dump(data, allow_unicode=True))
        try:
            mesh.load_cases(path)
        except InputError as error:
            problem = error
            continue
        return path
    raise problem


def _of_points(values: Json, points: int) -> Json:
    """Return values of a sweep with the least number of points of its grids in the place of the first."""
    grids = values.get("grid.points")
    return {**values, "grid.points": [points * n // grids[0] for n in grids]} if grids else values


def _pair(points: Any) -> list[int]:
    return [int(n) if isinstance(n, int) else 64 for n in (points if isinstance(points, list) else [points, points])]


def reduced(data: Json) -> Json:
    """Return a job with short slides, few points, bands and cases, and loose accuracy but for a plain history."""
    found = dict(data)
    plain = found.keys() <= PLAIN  # makes more steps than are estimated beforehand if it is exact
    found["numerics"] = {**(data.get("numerics") or {}), "accuracy": 0.02 if plain else 0.3}
    found["numerics"].pop("tolerance", None)
    found["output"] = {**(data.get("output") or {}), "every": 4}
    found["output"].pop("directory", None)
    if found.get("history"):
        found["history"] = [_short(stage) for stage in found["history"]]
    if found.get("steady"):
        count = 1 if found.get("bands") else 2
        found["steady"] = {name: _few(value, count) for name, value in found["steady"].items()}
    if found.get("sweep"):
        found["sweep"] = [{key: _few(value, 2) for key, value in one.items()} for one in _list(found["sweep"])]
    if found.get("bands"):
        found["bands"] = {"samples": 1}
        parts = [part for part in _list(found["surface"]) if part["shape"] != "topography"]  # 128 x 128
        decay = 4 if found.get("history") else 16
        found["surface"] = [
            {**part, "short_wavelength": part["long_wavelength"] / decay} if "long_wavelength" in part else part
            for part in parts
        ]
        if all("long_wavelength" in part for part in parts):
            found["bands"] |= {"points": 32, "waves": 2}
        found["bands"]["count"] = 1 if found.get("sweep") and found.get("history") else 2
        if found.get("history"):
            found["numerics"]["tolerance"] = 0.02
        if "thermal" in found:
            found["thermal"] = {**found["thermal"], "feedback": "none"}
    return found


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _short(stage: Json) -> Json:
    """Return a stage with few steps."""
    found = dict(stage)
    if isinstance(found.get("distance"), float):
        found["distance"] = found["distance"] / 4
    if isinstance(found.get("cells_per_step"), int | float):
        found["cells_per_step"] = 2
    if isinstance(found.get("duration"), float) and isinstance(found.get("time_step"), float):
        found["time_step"] = max(found["time_step"], found["duration"] / MOST_STEPS)
    return found


def _few(value: Any, count: int) -> Any:
    """Return at most some of the values of a list or a range A:B:N."""
    if isinstance(value, str) and value.count(":") == 2:
        return value.rpartition(":")[0] + f":{count}" if count > 1 else [float(value.partition(":")[0])]
    return value[:count] if isinstance(value, list) else value
