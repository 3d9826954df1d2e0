"""Points and size of a measured map, for jobs that take their grid from it."""

from functools import lru_cache
from pathlib import Path
from typing import Any

from ..job import Topography
from . import map_files

Points = tuple[int, int]
Size = tuple[float, float]


def of(part: Topography, box: Any = None) -> tuple[Points, Size]:
    """Points along x and y and size (lx, ly) [m] of a map, or of the part of it that is as large as a `box` [m]; a
    mirrored map is twice as long. Raises InputError."""
    points, size = _read(part.path, part.path.stat().st_mtime_ns, part.unit, part.size, part.channel)
    copies = 2 if part.periodic == "mirror" else 1
    size = copies * size[0], copies * size[1]
    lengths = box if isinstance(box, list | tuple) and len(box) == 2 else (box, box)
    x, y = (
        max(1, round(copies * n * (length / whole if isinstance(length, int | float) and length > 0 else 1.0)))
        for n, length, whole in zip(points, lengths, size, strict=True)
    )
    return (x, y), size


@lru_cache(maxsize=4)  # the cases of a sweep have the same map
def _read(path: Path, _: int, unit: str | None, size: Size | None, channel: str | None) -> tuple[Points, Size]:
    found = map_files.read(path, unit, size, channel)
    ny, nx = found.heights.shape
    return (nx, ny), found.size
