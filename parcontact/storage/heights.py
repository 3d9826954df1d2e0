"""Heights given in Python, stored as files in the directories of jobs and checkpoints."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..job import HeightArray
from ..parallel.slab import Slab
from . import files, hdf5


def store(surface: Iterable[Any], directory: Path, slab: Slab) -> None:
    """Write the height files of a surface, unless they exist; collective. Raises InputError."""

    def write() -> None:
        for heights in (shape.heights for shape in surface if isinstance(shape, HeightArray)):
            path = directory / heights.name
            if not path.is_file():
                with files.replaced(path) as file:
                    np.save(file, np.asarray(heights.values))

    hdf5.write_on_root(slab, write, f"cannot write the heights of the surface into {directory}", InputError)


def located(job: dict[str, Any], checkpoint: Path, elsewhere: bool) -> dict[str, Any]:
    """Return a stored job with the paths of its height files, in the directory of the checkpoint or its parent; root
    only.

    Raises InputError for a missing file, unless the caller states that it is `elsewhere`.
    """
    for index, shape in enumerate(job["surface"]):
        name = Path(shape.get("path", "/"))
        if not name.is_absolute():
            here, above = checkpoint.parent / name, checkpoint.parent.parent / name
            shape["path"] = str((above if above.is_file() and not here.is_file() else here).absolute())
            if not (elsewhere or Path(shape["path"]).is_file()):
                raise InputError(
                    f"{checkpoint} needs {name}, the heights of its surface, which were written with it: move both "
                    f"files, or say where it is with set={{'surface.{index}.path': ...}}"
                )
    return job
