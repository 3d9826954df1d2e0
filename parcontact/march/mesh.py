"""The grid of a job that states it by words: `points: auto`, or `from surface` for points and size of a measured map.

`load` and `load_cases` read a job like the functions of the same names in `job`, and replace these words by numbers.

`auto` is the mesh with the fewest points for which the mesh error is within its share of `numerics.accuracy`
(`job.calculation`). It follows from the shortest wave of the surface, the directions of sliding (`job.advice`) and a
guess of the contact area before any solve.

The guess is Persson's theory for frictionless contact of an elastic body (B. N. J. Persson, J. Chem. Phys. 115 (2001)
3840): under a mean pressure p on a surface of rms slope h' the share in contact is

    A = erf(sqrt(2) p/(E h')),      E = 2 |G|/(1 - nu),

here with the modulus G at FEW times the frequency f with which the shortest wave passes. Sliding surfaces have the
larger area 1 - (1 - A)^MORE. The phase of the modulus is taken at EDGES times f. If the loss angle is still
proportional to the frequency at FINEST times f, sliding is slow, and edges lose power in waves shorter than the cells
(`march.budget`). Names in capitals are constants of this module.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from functools import lru_cache, partial
from types import SimpleNamespace
from typing import Any, Protocol

from pydantic import Field, TypeAdapter, ValidationError

from .. import job
from ..errors import InputError
from ..job import Job, advice, listing
from ..job.advice import Guess
from ..job.calculation import Accuracy, Grid, Numerics
from ..job.listing import plain_data
from ..job.materials import AnyMaterial, Material
from ..job.model import prepared
from ..job.parts import AUTO, FROM_SURFACE, Origin, Part
from ..job.stages import Initial, Stage, Steady
from ..job.surfaces import OnOneMesh, Rough, RoughSpectrum, Shape, Spectral, Topography, Wave
from ..job.yaml_text import UNREADABLE, Source, is_array

OF_MESH, OF_MESH_ALONE = 0.6, 0.9  # tuning: error by the mesh over the accuracy, with time steps and without
UNKNOWN, USUAL_PHASE = 0.1, 0.25  # accuracy: share in contact and phase if slopes or loads are unknown
LEAST, MOST = 0.005, 0.99  # accuracy: limits on the share for which the laws of the mesh hold
MORE = 1.42  # fitted: power of the open share in sliding (`scripts/chosen_mesh.py`)
FEW, EDGES, FINEST = 0.5, 4.0, 16.0  # accuracy: frequencies of spots, edges and finest waves over the shortest wave's
SLOWNESS = 1.5  # fitted: power of the slowness (`scripts/chosen_mesh.py`)
NODES = 400  # accuracy: nodes of integrals over the spectrum; their error is 1e-4


class Loaded(Protocol):
    """The sections of a job that determine the contact area."""

    surface: tuple[Any, ...]
    material: AnyMaterial
    history: tuple[Stage, ...]
    initial: Initial
    steady: Steady | None


def guesses(job: Loaded, wave: float, area: float) -> list[Guess]:
    """Return a guess of the contact for each load and speed of a job. `wave` is the shortest wave of the surface [m],
    and `area` is the area of the box [m^2]. A guess for a friction curve also states how slow the sliding is; in other
    guesses this number is 0."""
    from ..effects.branches import relaxation_of

    slope, series = _slope(job.surface), relaxation_of(job.material)
    waves, curve = math.sqrt(area) / wave, job.steady and not job.history
    found = []
    for pressure, speed in {load: None for load in _loads(job, area) if load[0] > 0.0}:
        omega = 2.0 * math.pi * speed / wave
        few, edges = (_modulus(series, times * omega) for times in (FEW, EDGES))
        share = _share(pressure, abs(few), job.material.poisson, slope) if slope else UNKNOWN
        slow = _slowness(series, omega) if curve else 0.0
        found.append(Guess(share, 2.0 / math.pi * cmath.phase(edges), waves, slow))
    return found or [Guess(UNKNOWN, USUAL_PHASE, waves)]


def _slowness(series: Any, omega: float) -> float:
    """Return how nearly the loss is proportional to the frequency, from FEW to FINEST times this one: 1 far below the
    frequencies of the body, 0 above."""
    few, many = (math.sin(cmath.phase(_modulus(series, times * omega))) for times in (FEW, FINEST))
    return (FEW / FINEST * many / few) ** SLOWNESS if few > 0.0 else 0.0


def _share(pressure: float, modulus: float, poisson: float, slope: float) -> float:
    stiffness = 2.0 * modulus / (1.0 - poisson) * slope
    theory = math.erf(math.sqrt(2.0) * pressure / stiffness) if stiffness else 1.0
    return min(max(1.0 - (1.0 - theory) ** MORE, LEAST), MOST)


def _modulus(series: Any, omega: float) -> complex:
    """Return G [Pa] at a frequency [rad/s]; the instantaneous modulus if a body at rest has no other."""
    turns = [1j * omega * float(tau) for tau in series.relaxation_times]
    moduli = [float(modulus) for modulus in series.moduli]
    found = series.modulus_inf + sum(g * w / (1.0 + w) for g, w in zip(moduli, turns, strict=True))
    return complex(found or sum(moduli))


def _loads(job: Loaded, area: float) -> Iterator[tuple[float, float]]:
    """Yield mean pressures [Pa] and speeds [m/s]."""
    pressures = []
    for stage in job.history:
        if stage.control != "approach":
            pressures.append(stage.load.highest / (area if stage.control == "force" else 1.0))
            yield pressures[-1], stage.speed
    if job.initial.pressure is not None:
        yield job.initial.pressure, math.hypot(*job.initial.velocity)
    if job.steady is not None:
        yield from ((p, v) for p in job.steady.pressures or pressures[:1] for v in job.steady.velocities)


def _slope(surface: Sequence[Any]) -> float:
    """Return the rms slope of the rough parts of a surface, 0 where other parts have waves."""
    rough = [shape for shape in surface if isinstance(shape, Rough)]
    others = any(isinstance(shape, Spectral) and not isinstance(shape, Rough) for shape in surface)
    return 0.0 if others else math.hypot(*map(slope_of, rough))


def slope_of(shape: Rough) -> float:
    """Return the rms slope of a rough surface in a box much longer than its waves."""
    if shape.rms_slope is not None:
        return shape.rms_slope
    low, roll, high = (
        2.0 * math.pi / length for length in (shape.long_wavelength, shape.rolloff_wavelength, shape.short_wavelength)
    )
    ratio = math.log(high / low) / NODES
    heights = slopes = 0.0
    for k in (low * math.exp((node + 0.5) * ratio) for node in range(NODES)):
        power = max(k / roll, 1.0) ** (-2.0 * (1.0 + shape.hurst)) * k**2 * ratio
        heights, slopes = heights + power, slopes + power * k**2
    if shape.rms_height is not None:
        return shape.rms_height * math.sqrt(slopes / heights) if heights else 0.0
    return math.sqrt((shape.psd_constant or 0.0) * slopes / (2.0 * math.pi))


MOST_POINTS = 100_000  # tuning: largest number of points along a side
KEYS = ("points", "size")  # keys of a grid that a measured map determines
Extent = tuple[tuple[int, int], tuple[float, float] | None]


class Scenery(Part):
    """The sections of a job that determine its mesh."""

    surface: tuple[Shape, ...] = Field(description="one shape, or a list of shapes")
    initial: Initial = Initial()
    material: Material = Field(description="a mapping with model: elastic | zener | dma")
    history: tuple[Stage, ...] = Field(default=(), description="a list of stages")
    steady: Steady | None = None
    numerics: Numerics = Numerics()

    @classmethod
    def filled(cls, data: dict[str, Any], context: Origin | None) -> dict[str, Any]:
        """Return the data of a job without the keys that effects add to stages."""
        if not isinstance(stages := data.get("history"), list):
            return data
        own = Stage.model_fields.keys()
        return {**data, "history": [{k: s[k] for k in s if k in own} if isinstance(s, dict) else s for s in stages]}


def fill_grid(source: Source, origin: Origin) -> Origin:
    """Replace words for the grid, such as `auto`, in the source of a job by numbers. Return the origin of the job
    (`job.parts.Origin`) with a sentence on the chosen numbers."""
    _take_grid(source, origin)
    return _choose_points(source, origin)


def _choose_points(source: Source, origin: Origin) -> Origin:
    """Replace `points: auto` in the source of a job. Return the origin with a sentence. Errors are mistakes at this
    key; mistakes in other sections are found when the job is validated."""
    grid = source.data.get("grid") if isinstance(source.data, dict) else None
    if not isinstance(grid, dict) or grid.get("points") != AUTO:
        return origin
    known = prepared({name: source.data[name] for name in Scenery.model_fields if source.data.get(name) is not None})
    points: Any = UNREADABLE
    try:
        scenery = _with_changed_material(Scenery.model_validate(known, context=origin), source.data, origin)
        box = Grid.model_validate({**grid, "points": 1}, context=origin)
        points, said = _choose(scenery, box, source.data, origin)
        origin = origin._replace(mesh=said)
    except InputError as error:
        source.note(source.locate(("grid", "points")).place, f"grid.points: {AUTO}: {error}")
    except ValidationError:
        pass
    grid["points"] = points
    return origin


def _with_changed_material(scenery: Scenery, data: dict[str, Any], origin: Origin) -> Scenery:
    """Return the sections with the material that effects of a job put in place of its own."""
    added = [name for name, value in data.items() if name not in Job.model_fields and value is not None]
    for section, effect in listing.effects_of(added).items():
        if change := getattr(effect, "changed_material", None):
            own = TypeAdapter(effect.section).validate_python(data[section], context=origin)
            material = change(SimpleNamespace(**dict(scenery), **{section: own}))
            scenery = scenery.model_copy(update={"material": material})
    return scenery


def points_for(job: Job, accuracy: float) -> tuple[int, int]:
    """Return the numbers of points along x and y that `points: auto` chooses for a job at another accuracy. Raises
    InputError."""
    numerics = job.numerics.model_copy(update={"accuracy": accuracy})
    (nx, ny), _ = _choose(job.model_copy(update={"numerics": numerics}), job.grid, plain_data(job), job.origin)
    return nx, ny


def find_shortest_wave(job: Job) -> float:
    """Return the shortest wave [m] of the surface of a job, infinite if unknown. Raises InputError."""
    data, shapes = plain_data(job), (shape for shape in job.surface if not isinstance(shape, OnOneMesh))
    return min((_shortest(shape, job.grid, data, job.origin) for shape in shapes), default=math.inf)


def _choose(scenery: Scenery | Job, box: Grid, data: dict[str, Any], origin: Origin) -> tuple[list[int], str]:
    """Return points along x and y, and a sentence. Raises InputError if the surface has no shortest wave."""
    wave = min((_shortest(shape, box, data, origin) for shape in scenery.surface), default=math.inf)
    if not math.isfinite(wave):
        raise InputError("the surface has no shortest wave, from which cells follow; give numbers of points")
    if (waves := max(box.size) / wave) * advice.LEAST_CELLS > MOST_POINTS:
        raise InputError(
            f"a side of {max(box.size):.4g} m has {waves:.3g} of the surface's shortest waves, {wave:.4g} m: more than "
            f"{MOST_POINTS} points; make grid.size smaller, or the shortest wave longer"
        )
    directions = advice.directions_of(scenery.history, scenery.initial, scenery.steady)
    asked, share = scenery.numerics.asked, OF_MESH if scenery.history else OF_MESH_ALONE
    own = Accuracy(friction=share * asked.friction, area=share * asked.area)
    touching = guesses(scenery, wave, box.lx * box.ly)
    points = advice.choose_points(wave, box.size, directions, own, touching)
    dx, dy = (length / n for length, n in zip(box.size, points, strict=True))
    slides = " and ".join(f"({x:.3g}, {y:.3g})" for x, y in directions)
    return list(points), (
        f"mesh: {points[0]} x {points[1]} points, chosen by numerics.accuracy (friction {100 * asked.friction:g} %, "
        f"area {100 * asked.area:g} %): the shortest wave, {wave:.4g} m, has {wave / dx:.3g} cells along x and "
        f"{wave / dy:.3g} along y; {f'the surface slides along {slides}' if slides else 'nothing slides'}, "
        f"with about {100 * min(touching).share:.2g} % in contact"
    )


def _shortest(shape: Any, box: Grid, data: dict[str, Any], origin: Origin) -> float:
    """Return the shortest wave [m] of a shape, infinite without waves. Raises InputError."""
    if isinstance(shape, Rough):
        return shape.short_wavelength
    if isinstance(shape, Wave):
        count = math.hypot(shape.waves[0] / box.lx, shape.waves[1] / box.ly)
        return 1.0 / count if count else math.inf
    if isinstance(shape, RoughSpectrum):
        from ..job import measured_maps

        return float(measured_maps.read_spectrum(shape, box.is_line)[1][1])
    if isinstance(shape, OnOneMesh):
        raise InputError("heights from a file or an array are given on one mesh; give its numbers of points")
    if isinstance(shape, Topography):
        from .rigid_surface import shortest_of

        return float(shortest_of(_alone(shape, data, origin)) or math.inf)
    return math.inf


def _alone(shape: Topography, data: dict[str, Any], origin: Origin) -> Job:
    """Return a job with the measured map alone on its own points; requirements of other sections do not apply. Raises
    InputError."""
    of_box, of_map = (extent_of(data["surface"], box, origin)[0] for box in (data["grid"].get("size"), None))
    grid = {**data["grid"], "points": list(map(min, of_box, of_map))}  # limits memory for large boxes
    body, load = {"model": "elastic", "shear_modulus": 1.0}, {"pressure": 1.0}
    return Job.model_validate({"grid": grid, "surface": (shape,), "material": body, "history": [load]}, context=origin)


# -- the grid of a measured map ----------------------------------------------------------------------------------------


def _take_grid(source: Source, origin: Origin) -> None:
    """Replace `from surface` in the source of a job by numbers; errors are mistakes at this key."""
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
    except ValidationError:  # mistakes of the surface are reported where it is read
        grid.update(dict.fromkeys(wanted, UNREADABLE))
    except InputError as error:
        names = " and ".join(f"grid.{key}" for key in wanted)
        source.note(source.locate(("grid", wanted[0])).place, f"{names}: {FROM_SURFACE}: {error}")
        grid.update(dict.fromkeys(wanted, UNREADABLE))


def extent_of(surface: Any, box: Any, origin: Origin) -> Extent:
    """Return two pairs: the numbers of points along x and y in a box, with the spacing of the measured map, and the
    size [m] of the whole map. An array of heights has no size: the second result is then None.

    `box` is the length of both sides or a pair of lengths [m]. A side that is not a number is as long as the map. A
    mirrored map is twice as long. Raises InputError if the surface does not have exactly one map or array, or if the
    map is a line scan.
    """
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
    part = Topography.model_validate(maps[0], context=origin)
    ny, nx, whole = _extent_of_file(part, part.path.stat().st_mtime_ns)
    if ny == 1:
        raise InputError(f"{part.path} is a line scan, which gives no grid: give grid.points and grid.size")
    lx, ly = (part.copies * length for length in whole)
    lengths = box if isinstance(box, list | tuple) and len(box) == 2 else (box, box)
    shares = [
        length / size if isinstance(length, int | float) and length > 0 else 1.0
        for length, size in zip(lengths, (lx, ly), strict=True)
    ]
    return (max(1, round(part.copies * nx * shares[0])), max(1, round(part.copies * ny * shares[1]))), (lx, ly)


@lru_cache(maxsize=4)  # the cases of a sweep have the same map
def _extent_of_file(part: Topography, _: int) -> tuple[int, int, tuple[float, float]]:
    """Return the points along y and x of a measured map, and its size (lx, ly) [m]. Raises InputError."""
    from ..job import map_files

    found = map_files.read_map(part)
    return (*found.heights.shape, found.size)


load = partial(job.load, fill_grid=fill_grid)
load_cases = partial(job.load_cases, fill_grid=fill_grid)
