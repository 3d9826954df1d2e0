"""Identity of a job: how it is known in a directory that it shares with others, and in its checkpoints."""

import zlib
from pathlib import Path
from typing import Any

from .model import Job
from .sections.height_arrays import HeightArray
from .sections.listing import plain


def plain_job(job: Job) -> dict[str, Any]:
    """Return a job as plain data; files that are read are known by what they hold, not by their path."""
    data: dict[str, Any] = plain(job)
    for part, given in zip([*data["surface"], data["material"]], [*job.surface, job.material], strict=True):
        for key in ("path", "spectrum"):
            if isinstance(path := getattr(given, key, None), Path):
                del part[key]
                part["content"] = f"{zlib.crc32(path.read_bytes()):08x}"
        if isinstance(given, HeightArray):
            del part["path"]
            part["content"] = given.heights.checksum
    return data
