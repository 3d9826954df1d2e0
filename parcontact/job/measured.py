"""`grid: {points: from surface, size: from surface}`: those of the measured map that is the surface."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from typing import Any

from pydantic import ValidationError

from ..errors import InputError
from .sections.geometry import Topography
from .sections.part import Origin
from .sections.quantities import FROM_SURFACE
from .text.places import UNREADABLE, Source
from .text.python_data import is_array

KEYS = ("points", "size")
READER = EntryPoint("extent", "parcontact.road.extent:of", "")  # what reads maps; jobs that name none do without
Extent = tuple[tuple[int, int], tuple[float, float] | None]


def take_grid(source: Source, origin: Origin) -> None:
    """Put numbers for `from surface` into the source of a job; what stands in the way is a mistake at the key."""
    grid = source.data.get("grid") if isinstance(source.data, dict) else None
    wanted = [key for key in KEYS if isinstance(grid, dict) and grid.get(key) == FROM_SURFACE]
    if not isinstance(grid, dict) or not wanted:
        return
    try:
        points, size = extent_of(source.data.get("surface"), None if "size" in wanted else grid.get("size"), origin)
        if size is None and "size" in wanted:
            raise InputError("a measured map is needed; an array has points, but no size")
        found = {"points": points, "size": size}
        grid.update({key: list(found[key] or ()) for key in wanted})
    except ValidationError:  # mistakes of the surface, which are told where it is read
        grid.update(dict.fromkeys(wanted, UNREADABLE))
    except InputError as error:
        names = " and ".join(f"grid.{key}" for key in wanted)
        source.note(source.locate(("grid", wanted[0])).place, f"{names}: {FROM_SURFACE}: {error}")
        grid.update(dict.fromkeys(wanted, UNREADABLE))


def extent_of(surface: Any, box: Any, origin: Origin) -> Extent:
    """Return points of the box along x and y, and its size [m]; the box is the whole map unless it is given. Raises
    InputError."""
    shapes = surface if isinstance(surface, list) else [surface]
    heights: list[Any] = [shape.get("heights") if isinstance(shape, dict) else shape for shape in shapes]
    arrays = [given for given in heights if is_array(given)]
    maps = [shape for shape in shapes if isinstance(shape, dict) and shape.get("shape") == "topography"]
    if len(maps) + len(arrays) != 1:
        raise InputError(f"one measured map, shape: topography, is needed, and the surface has {len(maps) or 'none'}")
    if arrays:
        if arrays[0].ndim != 2:
            raise InputError(f"an array of two dimensions is needed, got {arrays[0].ndim}")
        return tuple(arrays[0].shape[::-1]), None
    found: Extent = READER.load()(Topography.model_validate(maps[0], context=origin), box)
    return found
