"""The job that a run has left in its directory with every default: as far as pictures and texts show it."""

from pathlib import Path

from pydantic import ValidationError

from ..errors import InputError
from .model import NO_GRID, Job
from .text import yamltext

RESOLVED = "job.resolved.yaml"
STEADY_RESOLVED = "steady.resolved.yaml"
SHOWN = (
    "title",
    "grid",
    "surface",
    "material",
    "initial",
    "history",
    "steady",
    "adhesion",
    "interface",
    "bands",
)  # others differ by version
LAST = "checkpoint"  # section of a job with every default
FILES = ("file", "topography")  # shapes that come from files


def shown_job(path: Path) -> Job:
    """Return what pictures show of the resolved job; its files of heights need not be there any more."""
    try:
        text = path.read_bytes()
        data = yamltext.parse(text, str(path)).data
        if not text.endswith(b"\n") or not isinstance(data, dict) or LAST not in data:
            raise InputError(f"{path} is cut off: it lacks its section {LAST}; put the whole file in its place")
        data = {name: data[name] for name in SHOWN if name in data}
        data["surface"] = [
            {"shape": "flat"} if shape["shape"] in FILES or "spectrum" in shape else shape for shape in data["surface"]
        ]
        if data.pop("bands", None) is not None:  # pictures of it are of its tables
            data["grid"], data["surface"] = NO_GRID, [{"shape": "flat"}]
        return Job.model_validate(data)
    except (OSError, KeyError, TypeError, ValidationError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error).partition("\n")[0]
        raise InputError(f"{path} cannot be read: {reason}") from error
