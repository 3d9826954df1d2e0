"""Heights that a job has from Python, as files beside the jobs and checkpoints that name them."""

import zlib
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..job import HeightArray, Job
from ..parallel.slab import Slab
from . import files, hdf5


def store(job: Job, directory: Path, slab: Slab) -> None:
    """Write the height files that the stored job names, unless they are there; collective. Raises InputError."""

    def write() -> None:
        for shape in job.surface:
            if isinstance(shape, HeightArray) and not _holds(directory / shape.heights.name, shape.heights.checksum):
                files.put_aside(directory / shape.heights.name)
                with files.replaced(directory / shape.heights.name) as file:
                    np.save(file, np.asarray(shape.heights.values))

    hdf5.on_root(slab, write, f"cannot write the heights of the surface into {directory}", InputError)


def _holds(path: Path, checksum: str) -> bool:
    return path.is_file() and f"{zlib.crc32(path.read_bytes()):08x}" == checksum


def located(job: dict[str, Any], checkpoint: Path) -> dict[str, Any]:
    """A stored job as plain data, with the paths of its height files: beside a checkpoint, or one directory up, in that
    of its run."""
    for shape in job["surface"]:
        if not Path(shape.get("path", "/")).is_absolute():
            beside, above = checkpoint.parent / shape["path"], checkpoint.parent.parent / shape["path"]
            shape["path"] = str((above if above.is_file() and not beside.is_file() else beside).absolute())
    return job
