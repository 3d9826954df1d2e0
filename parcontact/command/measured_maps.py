"""A measured map without a job: as a job to look at, and one to start from."""

import math
import os
from collections.abc import Iterator, Sequence
from operator import le
from pathlib import Path
from typing import Any

from .. import mesh
from ..errors import InputError
from ..job import Job
from ..job.sections.listing import plain_data
from ..job.text import yamltext
from ..storage import files, hdf5

JOBS = (".yaml", ".yml", ".json", "")  # how names of jobs end: others are those of measured maps
MANY_POINTS = 2**20  # tuning: of a job to start from, at most
UNSAID = ("give unit", "give size")  # in messages about maps that do not say all
OF_POSITIONS = "units: {xy: UNIT"  # in those about maps that say their size, but not in which unit
HOW = "on the command line: --set surface.unit=um"
HOW_SIZE = f"{HOW} --set surface.size=[1e-3,1e-3]"
ACCURACIES = (0.01, 0.02, 0.05, 0.1, 0.2)  # tuning: of a job to start from, the first that its points keep
LOAD = {"pressure": 1.0e5}


def is_map(path: Path) -> bool:
    """Tell whether a name is that of a measured map, not of a job."""
    return path.suffix.lower() not in JOBS


def load_map(path: Path, overrides: Sequence[str]) -> Job:
    """The job of a whole map on its own points, with some keys changed. Raises InputError."""
    try:
        return mesh.load(_job_of(str(path)), overrides)
    except InputError as error:
        if not any(text in str(error) for text in UNSAID):
            raise
        raise InputError(f"{error}; {HOW if OF_POSITIONS in str(error) else HOW_SIZE}") from None


def refuse_taken(target: Path | None) -> None:
    """Raise InputError where there is a file of the name of a job to start from already."""
    if target is not None and os.path.lexists(target):
        raise InputError(f"--job: {target} is there already; give another name")


def start_job(job: Job, path: Path, target: Path | None) -> Iterator[str]:
    """Write a job to start from to a file, or say it; maps of very many points are thinned out. Raises InputError."""
    directory, grid = (target or Path("job.yaml")).absolute().parent, job.grid
    found = _job_of(os.path.relpath(path, directory))
    found["surface"] |= {key: value for key, value in plain_data(job.surface[0]).items() if key != "path"}
    found["surface"].setdefault("periodic", "smooth")
    coarser = math.ceil(math.sqrt(grid.nx * grid.ny / MANY_POINTS))
    found["grid"] = {"points": [grid.nx // coarser, grid.ny // coarser], "size": list(grid.size)}
    found["history"].append({"name": "slide", **LOAD, "velocity": 0.1, "distance": float(f"{grid.lx / 4:.3g}")})
    accuracy, why = _accuracy(job, found | {"surface": found["surface"] | {"path": str(path)}})
    text = yamltext.dump(found | {"numerics": {"accuracy": accuracy}}).rstrip() + f"{why}\n"
    if target is None:
        yield f"\na job to start from, which --job FILE writes:\n\n{text.rstrip()}"
        return
    try:
        directory.mkdir(parents=True, exist_ok=True)
        files.replace_file(target, text)
    except OSError as error:
        raise InputError(f"{target} cannot be written: {hdf5.reason(error)}") from error
    yield f"job: {target}"


def _accuracy(job: Job, data: dict[str, Any]) -> tuple[Any, str]:
    """Return the accuracy of the command line, or one that the points of the job to start from, `data`, keep with a
    comment that says so."""
    accuracy = job.numerics.accuracy
    if "accuracy" in job.numerics.model_fields_set:
        return accuracy, ""
    try:
        whole = mesh.load(data)
        kept = [a for a in ACCURACIES if all(map(le, mesh.points_for(whole, a), whole.grid.points))]
    except InputError:  # nothing is known before of heights without a shortest wave
        return accuracy, ""
    return (kept[0], "  # what these points keep, by a guess") if kept else (accuracy, "  # needs more points")


def _job_of(path: str) -> dict[str, Any]:
    return {
        "title": Path(path).name,
        "grid": {"points": "from surface", "size": "from surface"},
        "surface": {"shape": "topography", "path": path},
        "material": {"include": "synthetic_tyre"},
        "history": [{"name": "press", **LOAD, "duration": 1.0e-3}],
        "output": {"fields": ["pressure", "gap"], "every": 64},
    }
