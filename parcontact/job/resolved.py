"""Reading of the resolved job in an output directory, as far as pictures and texts need it."""

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
    "counterbody",
    "leakage",
    "bands",
)  # sections that pictures and texts need; others may differ between versions
LAST = "checkpoint"  # last section of a job with every default
FILES = ("file", "topography")  # shapes that come from files


def shown_job(path: Path) -> Job:
    """Return the resolved job with flat shapes in place of files, which may no longer exist."""
    try:
        text = path.read_bytes()
        data = yamltext.parse(text, str(path)).data
        if not text.endswith(b"\n") or not isinstance(data, dict) or LAST not in data:
            raise InputError(f"{path} is incomplete: it lacks the section {LAST}; restore the whole file")
        data = {name: data[name] for name in SHOWN if name in data}
        data["surface"] = [
            {"shape": "flat"} if shape["shape"] in FILES or "spectrum" in shape else shape for shape in data["surface"]
        ]
        if data.pop("bands", None) is not None:  # pictures show tables only
            data["grid"], data["surface"] = NO_GRID, [{"shape": "flat"}]
        return Job.model_validate(data)
    except (OSError, KeyError, TypeError, ValidationError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error).partition("\n")[0]
        raise InputError(f"{path} cannot be read: {reason}") from error
