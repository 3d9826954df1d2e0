"""Jobs that the program makes from a measured map: one with which it describes the map, and one that a user can
change and run."""

import math
import os
from collections.abc import Iterator, Sequence
from operator import le
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import files
from ..job import Job, yaml_text
from ..job.listing import plain_data
from ..march import mesh

JOBS = (".yaml", ".yml", ".json", "")  # suffixes of jobs; files with other suffixes are measured maps
MANY_POINTS = 2**20  # tuning: largest number of points in a job to start from
UNSAID = ("give unit", "give size")  # parts of messages about maps without unit or size
OF_POSITIONS = "units: {xy: UNIT"  # part of messages about maps that give their size without its unit
HOW = "on the command line: --set surface.unit=um"
HOW_SIZE = f"{HOW} --set surface.size=[1e-3,1e-3]"
ACCURACIES = (0.01, 0.02, 0.05, 0.1, 0.2)  # tuning: a job to start from gets the first one possible
LOAD = {"pressure": 1.0e5}


def is_map(path: Path) -> bool:
    """Return True if the path names a measured map, not a job."""
    return path.suffix.lower() not in JOBS


def load_map(path: Path, overrides: Sequence[str]) -> Job:
    """Return a job whose surface is a whole measured map, on the points of the map, with the overrides applied. Raises
    InputError."""
    try:
        return mesh.load(_job_of(str(path)), overrides)
    except InputError as error:
        if not any(text in str(error) for text in UNSAID):
            raise
        raise InputError(f"{error}; {HOW if OF_POSITIONS in str(error) else HOW_SIZE}") from None


def start_job(job: Job, path: Path, target: Path | None) -> Iterator[str]:
    """Make a job from a measured map that a user can change and run; yield lines of text about it.

    The job has at most MANY_POINTS points. It is written to the file `target`; without `target` its text is yielded.
    Raises InputError if the file cannot be written.
    """
    directory, grid = (target or Path("job.yaml")).absolute().parent, job.grid
    found = _job_of(os.path.relpath(path, directory))
    found["surface"] |= {key: value for key, value in plain_data(job.surface[0]).items() if key != "path"}
    found["surface"].setdefault("periodic", "smooth")
    coarser = math.ceil(math.sqrt(grid.nx * grid.ny / MANY_POINTS))
    found["grid"] = {"points": [grid.nx // coarser, grid.ny // coarser], "size": list(grid.size)}
    found["history"].append({"name": "slide", **LOAD, "velocity": 0.1, "distance": float(f"{grid.lx / 4:.3g}")})
    accuracy, why = _accuracy(job, found | {"surface": found["surface"] | {"path": str(path)}})
    text = yaml_text.dump(found | {"numerics": {"accuracy": accuracy}}).rstrip() + f"{why}\n"
    if target is None:
        yield f"\na job to start from (--job FILE writes it to a file):\n\n{text.rstrip()}"
        return
    with files.writing(target):
        files.replace_file(target, text)
    yield f"job: {target}"


def _accuracy(job: Job, data: dict[str, Any]) -> tuple[Any, str]:
    """Return the accuracy of `job` if given, else the accuracy that the points of the job `data` can keep, and a
    comment."""
    accuracy = job.numerics.accuracy
    if "accuracy" in job.numerics.model_fields_set:
        return accuracy, ""
    try:
        whole = mesh.load(data)
        kept = [a for a in ACCURACIES if all(map(le, mesh.points_for(whole, a), whole.grid.points))]
    except InputError:  # heights without a shortest wave
        return accuracy, ""
    return (kept[0], "  # estimate for these points") if kept else (accuracy, "  # needs more points")


def _job_of(path: str) -> dict[str, Any]:
    return {
        "title": Path(path).name,
        "grid": {"points": "from surface", "size": "from surface"},
        "surface": {"shape": "topography", "path": path},
        "material": {"include": "synthetic_tyre"},
        "history": [{"name": "press", **LOAD, "duration": 1.0e-3}],
        "output": {"fields": ["pressure", "gap"], "every": 64},
    }
