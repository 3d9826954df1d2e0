"""Warnings about the physics of a job, before it runs.

The warnings concern jobs outside of the theory, a linear half space with small slopes and strains. Tests use lower
bounds of slopes, heights, pressures and radii. So a job within the theory gets no warning, and a job outside of it does
not always get one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import groupby
from typing import Any

from ..errors import Doubt, Kind
from ..rubber.shift import doubt_kelvin
from . import limits
from .advice import Sections, Vector, doubts_of_resolution
from .calculation import Grid
from .materials import Elastic, PronyBranch, Zener, heated
from .stages import Stage, Swing
from .surfaces import (
    Cone,
    HeightFile,
    Indenter,
    OnOneMesh,
    Punch,
    Pyramid,
    Rough,
    RoughSpectrum,
    Sphere,
    Topography,
    Wave,
    wave_numbers,
)

STEEP = 0.5  # physics: largest rms slope that counts as small
STEEPEST = 1.0  # physics: radius of contact over radius of the sphere, up to which slopes are small
SOFTEST, HARDEST = 1e3, 1e12  # physics: range of shear moduli [Pa]; gels have 1e3, diamond 5e11
STRAIN = 1.0  # physics: mean pressure over 2 G/(1 - nu), up to which strains are small
LEAST = 1e-12  # rounding: smallest modulus of a fluid over its instantaneous modulus, to avoid division by 0
NEAR = 0.4  # accuracy: distance to the starting point, over the longest wave, at which imprints overlap
REMEMBERS = 0.1  # accuracy: relaxation time over the time since the imprint, below which it is forgotten
ALONE = 0.01  # accuracy: limit on the relative change of the load by periodic images
IMAGES = 20  # accuracy: number of images summed on each side; the others add 3 %
ROUNDS = 1000  # tuning: limit on the passages through the box that are checked for imprints
SAME = 1e-9  # rounding: relative difference below which distances are the same
BEYOND = 100.0  # physics: frequency over the frequency of every branch, above which nothing relaxes


WARN_STEEP = Kind(
    "steep",
    "its rms slope is {slope:.3g}; the theory assumes small slopes, up to {most:g}. Are heights and lengths in "
    "m?{needed}",
)


def doubt_slope(slope: float, surface: tuple[Any, ...]) -> Iterator[Doubt]:
    """Yield a warning about an rms `slope` above `STEEP`, which is not small. The warning names keys, such as a unit,
    that a surface from files may need and does not have."""
    if slope > STEEP:
        yield WARN_STEEP("surface", {"slope": slope, "most": STEEP, "needed": _needed(surface)})


def _needed(surface: tuple[Any, ...]) -> str:
    """Return sentences on what heights of files may need and do not have."""
    files = [shape for shape in surface if isinstance(shape, HeightFile)]
    maps = [shape for shape in surface if isinstance(shape, Topography)]
    keys = ["scale: 1.0e-6 (shape: file)"] * any(shape.scale == 1.0 for shape in files)
    keys += ["unit: um (shape: topography)"] * any(shape.unit_of_heights in (None, "m") for shape in maps)
    units = f" Heights in um need {' or '.join(keys)}." if keys else ""
    missing = bool(files) or any(shape.nodata is None for shape in maps)
    return units + " Missing points must be nan." * missing


READ = OnOneMesh | RoughSpectrum | Topography  # shapes whose heights are read from files or arrays


def says_all(surface: tuple[Any, ...]) -> bool:
    """Return True if the keys of the job determine the rms slope of a surface, so that its heights need not be read."""
    return not any(isinstance(shape, READ) or getattr(shape, "rms_slope", 0.0) is None for shape in surface)


def _slopes(job: Sections) -> Iterator[Doubt]:
    """Yield a warning about the rms slope if it follows from the job."""
    grid, surface = job.grid, job.surface
    if not says_all(surface):
        return
    square = 0.0
    for shape in surface:
        if isinstance(shape, Wave):
            q = 2 * math.pi * math.hypot(shape.waves[0] / grid.lx, shape.waves[1] / grid.ly)
            square += (q * shape.amplitude) ** 2 / 2
        elif isinstance(shape, Rough):
            square += (shape.rms_slope or 0.0) ** 2
        elif isinstance(shape, Cone | Pyramid):
            square += shape.slope**2
    yield from doubt_slope(math.sqrt(square), surface)


WARN_SOFT = Kind(
    "soft",
    "its instantaneous shear modulus is {modulus:.3g} Pa, below {least:g} Pa and as soft as a gel. Moduli are in "
    "Pa: {modulus:.3g} MPa would be {in_mega:.3g}",
)
WARN_HARD = Kind(
    "hard",
    "its instantaneous shear modulus is {modulus:.3g} Pa, above {most:g} Pa and harder than diamond; moduli are in Pa",
)


def _moduli(job: Sections) -> Iterator[Doubt]:
    """Yield a warning about an instantaneous modulus that no solid has."""
    modulus = job.material.fitted.instant_modulus
    if modulus < SOFTEST:
        yield WARN_SOFT("material", {"modulus": modulus, "least": SOFTEST, "in_mega": 1e6 * modulus})
    elif modulus > HARDEST:
        yield WARN_HARD("material", {"modulus": modulus, "most": HARDEST})


def _temperatures(job: Sections) -> Iterator[Doubt]:
    """Yield a warning for each key with a temperature that may be in kelvin."""
    material, steady = job.material.given, job.steady
    shift = getattr(material, "shift", None)
    yield from doubt_kelvin("material.temperature", [getattr(material, "temperature", None)])
    yield from doubt_kelvin("material.reference", [getattr(material, "reference", None)])
    yield from doubt_kelvin("material.shift.reference", [getattr(shift, "reference", None)])
    yield from doubt_kelvin("material.shift.temperatures", getattr(shift, "temperatures", ()))
    yield from doubt_kelvin("steady.temperatures", (steady.temperatures if steady else None) or ())


def instant_contact_modulus(material: Elastic | Zener) -> float:
    """Return the instantaneous contact modulus E* = 2 G/(1 - nu) [Pa]. At all later times the contact modulus is
    smaller or equal."""
    return 2.0 * material.instant_modulus / (1.0 - material.poisson)


def _mean(stage: Stage, load: float, grid: Grid) -> float:
    """Return the mean pressure of a stage with a load [Pa], or 0 for a stage with an approach."""
    if stage.control == "approach":
        return 0.0
    return load / (grid.lx * grid.ly) if stage.control == "force" else load


WARN_STRAIN_IN_TIME = Kind(
    "strain in time",
    "a mean pressure of {pressure:.3g} Pa{where}, held for {seconds:.3g} s, exceeds 2 G/(1 - nu) = {modulus:.3g} Pa of "
    "the relaxed body, where strains are far beyond linear theory; are pressures and moduli both in Pa?",
)
WARN_STRAIN_AT_ONCE = Kind(
    "strain at once",
    "a mean pressure of {pressure:.3g} Pa{where} exceeds 2 G/(1 - nu) = {modulus:.3g} Pa, where strains are far beyond "
    "linear theory; are pressures and moduli both in Pa?",
)


def _pressures(job: Sections) -> Iterator[Doubt]:
    """Yield warnings about large strains and about a load that hardly touches.

    A single punch bears the load on its face: its edge may be as steep as that of the sharp punch in linear theory.
    """
    material, grid, punch, share = job.material.fitted, job.grid, job.surface[0], 1.0
    if len(job.surface) == 1 and isinstance(punch, Punch) and grid.ny > 1:
        share = min(1.0, math.pi * punch.radius**2 / (grid.lx * grid.ly))
    loads = [("initial.pressure", job.initial.pressure or 0.0, 0.0)]
    loads.append(("steady.pressures", max((job.steady.pressures if job.steady else None) or (0.0,)), 0.0))
    least, held = 0.0, 0.0
    for index, stage in enumerate(job.history):
        ends = [_mean(stage, load, grid) for load in (stage.load.lowest, stage.load.highest)]
        least, held = (least, held + stage.seconds) if min(ends) == least else (min(ends), stage.seconds)
        loads += [(f"history.{index}.{stage.control}", *load) for load in ((max(ends), 0.0), (least, held))]
    found = [
        (load / share / modulus_after(material, seconds), key, load / share, seconds) for key, load, seconds in loads
    ]
    strain, key, pressure, seconds = max(found)
    if strain > STRAIN:
        kind = WARN_STRAIN_IN_TIME if seconds else WARN_STRAIN_AT_ONCE
        where = " on the face of the punch" * (share < 1.0)
        yield kind(key, {"pressure": pressure, "modulus": pressure / strain, "seconds": seconds, "where": where})
    yield from _light(job, material, *max((pressure, key) for key, pressure, _ in loads))


WARN_LIGHT = Kind(
    "light",
    "under the largest load, {pressure:.3g} Pa, only {touching:.2g} points of the grid would touch, less than 1; "
    "use a larger load. Pressures are in Pa: {pressure:.3g} MPa is {in_mega:.3g}",
)


def _light(job: Sections, material: Elastic | Zener, pressure: float, key: str) -> Iterator[Doubt]:
    """Yield a warning if the largest load gives less than one point in contact by Persson, erf(sqrt(2) p/(E* h'))."""
    pulled = any(limits.loads_press in lifted for lifted in job.asked("lifts"))
    pulled |= any(stage.control == "approach" for stage in job.history)
    slopes = [shape.rms_slope or 0.0 if isinstance(shape, Rough) else math.inf for shape in job.surface]
    stiffness = 2.0 * material.long_modulus / (1.0 - material.poisson) * math.hypot(*slopes)
    known = not pulled and pressure > 0.0 and 0.0 < stiffness < math.inf
    touching = math.erf(math.sqrt(2.0) * pressure / stiffness) * math.prod(job.grid.points) if known else 1.0
    if touching < 1.0:
        yield WARN_LIGHT(key, {"pressure": pressure, "touching": touching, "in_mega": 1e6 * pressure})


def modulus_after(material: Elastic | Zener, seconds: float) -> float:
    """Return an upper bound of 1/J(t) [Pa]: a constant pressure divided by the strain that it has caused after the time
    t, given as `seconds`. J is the creep compliance that belongs to the contact modulus E*.

    The bound is the mean of E* over this time: as int_0^t E*(t - s) J(s) ds = t, and as J rises, J(t) is at least
    t/int_0^t E*(s) ds.
    """
    return _contact_modulus(material, seconds, lambda ratio: -math.expm1(-ratio) / ratio if ratio > 0.0 else 1.0)


def _contact_modulus(material: Elastic | Zener, seconds: float, kept: Callable[[float], float]) -> float:
    """Return the contact modulus E* [Pa] after `seconds`. `kept` returns the share of a branch that is left, from the
    time over the relaxation time of the branch."""
    modulus = material.long_modulus
    for branch in material.branches:
        ratio = seconds / (material.time_factor * branch.relaxation_time) if branch.relaxation_time else math.inf
        modulus += material.modulus_factor * (branch.instant_modulus - branch.long_modulus) * kept(ratio)
    return 2.0 * max(modulus, LEAST * material.instant_modulus) / (1.0 - material.poisson)


# -- relaxation -------------------------------------------------------------------------------------------------------


WARN_AT_AN_INSTANT = Kind(
    "at an instant",
    "its {stages} stages have no duration, so the rubber keeps its instantaneous shear modulus of {modulus:.3g} "
    "Pa; give them a duration [s] to let it relax to {relaxed:.3g} Pa",
)


def _instants(job: Sections) -> Iterator[Doubt]:
    """Yield a warning if a relaxing body has several stages and none has a duration."""
    material = job.material.fitted
    timeless = len(job.history) > 1 and not any(stage.seconds for stage in job.history)
    if timeless and material.instant_modulus > material.long_modulus and job.initial.state == "virgin":
        moduli = {"modulus": material.instant_modulus, "relaxed": material.long_modulus}
        yield WARN_AT_AN_INSTANT("history", {"stages": len(job.history), **moduli})


WARN_ELASTIC = Kind(
    "elastic",
    "sliding excites {low:.3g} to {high:.3g} rad/s, all more than {times:g} times {how} than the branches, which "
    "relax at {slow:.3g} to {fast:.3g} rad/s: the body is elastic with its {modulus} modulus; are velocities in "
    "m/s, lengths in m and relaxation times in s?",
)


def _band(job: Sections) -> Iterator[Doubt]:
    """Yield a warning if the angular frequencies q v of the sliding waves are far from all 1/relaxation time.

    An effect may shear a contact before it slides, within far less than a wave. Then its highest frequency is not
    known, and slow sliding gives no warning.
    """
    material = job.material.fitted
    branches = [one for one in material.branches if isinstance(one, PronyBranch) or one.G0 > 0.0]
    times = [branch.relaxation_time for branch in branches if 0.0 < branch.relaxation_time < math.inf]
    rough = [shape for shape in job.surface if isinstance(shape, Rough)]
    lengths = [length for shape in rough for length in (shape.long_wavelength, shape.short_wavelength)]
    speeds = [stage.speed for stage in job.history if stage.slides and stage.seconds]
    speeds += [math.hypot(*job.initial.velocity)] if any(job.initial.velocity) else []
    speeds += job.steady.velocities if job.steady else ()
    if not (times and lengths and speeds):
        return
    degrees = (job.steady.temperatures if job.steady else None) or ()
    factors = [heated(material, value).time_factor for value in degrees]
    factors += [material.time_factor] if job.history or not degrees else []
    low, high = 2 * math.pi * min(speeds) / max(lengths), 2 * math.pi * max(speeds) / min(lengths)
    slow, fast = 1.0 / (max(factors) * max(times)), 1.0 / (min(factors) * min(times))
    if (high * BEYOND < slow and not job.sheared_first) or low > fast * BEYOND:
        how, modulus = ("slower", "long-term") if high < slow else ("faster", "instantaneous")
        rates = {"low": low, "high": high, "slow": slow, "fast": fast}
        yield WARN_ELASTIC("material", {**rates, "times": BEYOND, "how": how, "modulus": modulus})


WARN_ALONG_RIDGES = Kind(
    "along ridges",
    "with one point along {axis} the surface consists of ridges along {axis}, and the body has no friction in sliding "
    "along them; give several points along {axis}",
)


def doubt_ridges(key: str, points: tuple[int, int], directions: list[Vector]) -> Iterator[Doubt]:
    """Yield a warning, on a `key` of a job, for a surface on a line of `points` that slides across this line only.
    `directions` are unit vectors."""
    if (points[0] == 1) != (points[1] == 1) and directions:
        axis = points.index(1)
        if not any(way[1 - axis] for way in directions):
            yield WARN_ALONG_RIDGES(key, {"axis": "xy"[axis]})


def _ridges(job: Sections) -> Iterator[Doubt]:
    yield from doubt_ridges("grid.points", job.grid.points, job.directions)


# -- isolated contacts ------------------------------------------------------------------------------------------------


WARN_CENTRE_OUTSIDE = Kind(
    "centre outside",
    "its centre at {axis} = {at:g} m is outside the free box, which ends at 0 and {length:g} m and cuts contact off: "
    "put center into the box",
)


def _outside(job: Sections) -> Iterator[Doubt]:
    """Yield a warning for each indenter whose centre is outside a free box."""
    ends = list(zip("xy", job.grid.size, job.grid.cyclic, strict=True))
    for index, shape in enumerate(job.surface):
        if not isinstance(shape, Indenter) or shape.center is None:
            continue
        along = "x" if job.grid.ny == 1 else {"x": "y", "y": "x"}.get(getattr(shape, "axis", ""), "xy")
        for at, (axis, length, cyclic) in zip(shape.center, ends, strict=True):
            if axis in along and not cyclic and not 0.0 <= at <= length:
                yield WARN_CENTRE_OUTSIDE(f"surface.{index}", {"axis": axis, "at": at, "length": length})


WARN_SHORT_LINE = Kind(
    "short line",
    "in a free box one row of points is a strip of the width {width:g} m, with the same pressure across; it is a line "
    "contact only if it is wider than long: give grid.size {length:g} m or more {across}",
)


def _short_line(job: Sections) -> Iterator[Doubt]:
    """Yield a warning for a row or column of points in a free box that is less wide than long."""
    axis = job.grid.points.index(1) if job.grid.is_line else 0
    width, length = job.grid.size[axis], job.grid.size[1 - axis]
    if job.grid.is_line and not job.grid.cyclic[axis] and width < length:
        yield WARN_SHORT_LINE("grid", {"width": width, "length": length, "across": f"along {'xy'[axis]}"})


WARN_LARGE_CONTACT = Kind(
    "large contact",
    "the contact would have a radius of {contact:.3g} m or more, above the radius of the sphere, {radius:g} m; the "
    "theory assumes small slopes: use a smaller load",
)
WARN_SLIDES_OUT_OF_THE_BOX = Kind(
    "slides out of the box",
    "a free box does not move with the surface: after {way:.3g} m of the {length:.3g} m that it slides, the "
    "contact, with a radius of some {contact:.3g} m, reaches the edge of the box of {lx:g} x {ly:g} m and is cut "
    "off there. Let it slide {way:.3g} m at most, use a larger grid.size, or put surface.0.center farther back",
)
WARN_OUT_OF_THE_BOX = Kind(
    "out of the box",
    "the contact has a radius of some {contact:.3g} m and leaves the box of {lx:g} x {ly:g} m, whose edge is "
    "{room:.3g} m from its centre; use a larger grid.size, a smaller load or a shorter distance",
)


def _room(job: Sections) -> Iterator[Doubt]:
    """Yield warnings if the least contact of a single sphere is too large for its radius, or the relaxed one leaves the
    box. Yield none for a body that is no half space, on which contacts are smaller."""
    material = job.material.fitted
    grid, sphere = job.grid, job.surface[0]
    single = len(job.surface) == 1 and isinstance(sphere, Sphere) and min(grid.points) > 1
    if not single or any(grid.cyclic) or job.asked("response"):
        return
    x, y = sphere.center or (grid.lx / 2, grid.ly / 2)
    if not (0.0 <= x <= grid.lx and 0.0 <= y <= grid.ly):
        return  # `_outside` warns
    modulus, found, elapsed = instant_contact_modulus(material), set(), 0.0
    for index, stage in enumerate(job.history):
        elapsed += stage.seconds
        radius = _hertz(stage, sphere.radius, modulus, grid)
        if radius / sphere.radius > STEEPEST and "steep" not in found:
            found.add("steep")
            yield WARN_LARGE_CONTACT(f"history.{index}", {"contact": radius, "radius": sphere.radius})
        # under a constant load 1/E*(t) bounds the creep compliance from above, and with it the contact
        relaxed = _contact_modulus(material, elapsed, lambda ratio: math.exp(-ratio))
        radius = _hertz(stage, sphere.radius, relaxed, grid)
        room = min(x, grid.lx - x, y, grid.ly - y)
        farthest = 0.25 / stage.velocity.frequency if isinstance(stage.velocity, Swing) else stage.seconds
        way, length = _way_to_edge((x, y), stage, radius, grid.size), stage.speed * stage.moving(farthest)
        if radius > 0.0 and (radius > room or way < length) and "room" not in found:
            found.add("room")
            numbers = {"contact": radius, "lx": grid.lx, "ly": grid.ly, "room": max(room, 0.0), "way": way}
            kind = WARN_OUT_OF_THE_BOX if radius > room else WARN_SLIDES_OUT_OF_THE_BOX
            yield kind(f"history.{index}", {**numbers, "length": length})
        moving = stage.moving(stage.seconds)
        x, y = x + stage.velocity[0] * moving, y + stage.velocity[1] * moving


def _way_to_edge(start: tuple[float, float], stage: Stage, radius: float, size: tuple[float, float]) -> float:
    """Return the distance [m] that a contact within the box can slide until it reaches the edge; inf at rest."""
    ways = [math.inf]
    for centre, velocity, length in zip(start, stage.velocity, size, strict=True):
        behind, ahead = centre - radius, length - centre - radius
        if velocity < 0.0:
            behind, ahead = ahead, behind
        if velocity != 0.0:
            room = min(ahead, behind) if isinstance(stage.velocity, Swing) else ahead
            ways.append(room * stage.speed / abs(velocity))
    return min(ways)


def _hertz(stage: Stage, radius: float, modulus: float, grid: Grid) -> float:
    """Return the contact radius [m] by Hertz (1882) for a contact modulus [Pa], at the end of a stage or at the highest
    load of an oscillation."""
    load = max(stage.load.highest if stage.frequency else stage.load.end, 0.0)
    if stage.control == "approach":
        return math.sqrt(load * radius)
    return float((0.75 * _mean(stage, load, grid) * grid.lx * grid.ly * radius / modulus) ** (1 / 3))


def neighbours(job: Sections) -> Iterator[Doubt]:
    """Yield a warning if the images of a single sphere in a periodic box change the load of the sphere. The contact
    radii in the history are taken from Hertz's theory."""
    modulus, grid = instant_contact_modulus(job.material.fitted), job.grid
    yield from acting_neighbours(
        job, lambda radius: max((_hertz(stage, radius, modulus, grid) for stage in job.history), default=0.0)
    )


WARN_IMAGES = Kind(
    "images",
    "its images in the periodic box of {lx:g} x {ly:g} m change the load at a given radius of contact by "
    "{change!p} or more (limit: {most!p}); use a grid.size {times!u} times as large, or boundary: free",
)


def acting_neighbours(job: Sections, contact: Callable[[float], float]) -> Iterator[Doubt]:
    """Yield a warning if the periodic images of a single sphere change the load of the sphere by more than the fraction
    `ALONE` of this load.

    `contact` returns the contact radius a [m] for a radius of the sphere [m]; an effect may give another function than
    Hertz's. An image at the distance r with the force P adds the curvature `P/(2 pi E* r^3)`, so the load at a given
    contact radius changes by `2 a^3/(3 pi) sum 1/r^3`.
    """
    grid, sphere = job.grid, job.surface[0]
    single = len(job.surface) == 1 and isinstance(sphere, Sphere) and min(grid.points) > 1
    if not single or not all(grid.cyclic) or job.asked("response"):
        return
    around = range(-IMAGES, IMAGES + 1)
    images = math.fsum(math.hypot(i * grid.lx, j * grid.ly) ** -3 for i in around for j in around if i or j)
    change = 2.0 * contact(sphere.radius) ** 3 * images / (3.0 * math.pi)
    if change > ALONE:
        times = (change / ALONE) ** (1.0 / 3.0)
        yield WARN_IMAGES("surface.0", {"lx": grid.lx, "ly": grid.ly, "change": change, "most": ALONE, "times": times})


# -- slides over their own imprint ------------------------------------------------------------------------------------


WARN_IMPRINT = Kind(
    "imprint",
    "after {way:.3g} m of its {length:.3g} m the surface has crossed the periodic box, returns to within "
    "{near:.3g} m of its start, and slides over its own imprint, which the body remembers for {memory:.3g} s. "
    "Beyond this distance friction and mu_dyn depend on the box; use a shorter distance or a larger grid.size",
)


def _imprints(job: Sections) -> Iterator[Doubt]:
    """Yield a warning for each slide (consecutive stages of one velocity) that meets the imprint of its own beginning.

    Surfaces of waves only are periodic by intention. A slide that begins in its steady state meets no other imprint.
    """
    grid, initial, material = job.grid, job.initial, job.material.fitted
    times = [branch.relaxation_time for branch in material.branches if branch.relaxation_time < math.inf]
    if not all(grid.cyclic) or not times or all(isinstance(shape, Wave) for shape in job.surface):
        return
    memory = max(times) * material.time_factor
    longest = max((shape.long_wavelength for shape in job.surface if isinstance(shape, Rough)), default=0.0)
    near = NEAR * min(longest, *grid.size)
    steady = (initial.velocity, initial.pressure) if initial.state == "steady" else None
    for velocity, stages in groupby(enumerate(job.history), key=lambda stage: stage[1].velocity):
        (index, first), *more = stages
        speed = math.hypot(*velocity)
        seconds = first.seconds + sum(stage.seconds for _, stage in more)
        if not first.slides or not speed * seconds or steady == (velocity, first.load.end):
            continue
        start = _round_trip(grid, velocity, seconds + near / speed, near) - near
        if speed * seconds > start * (1.0 + SAME) and memory > REMEMBERS * start / speed:
            numbers = {"way": start, "length": speed * seconds, "near": near, "memory": memory}
            yield WARN_IMPRINT(f"history.{index}", numbers)


def _round_trip(grid: Grid, velocity: tuple[float, float], most: float, near: float) -> float:
    """Return the distance [m] after which a slide of at most `most` seconds is within `near` [m] of a periodic image of
    its start, or inf if it never is."""
    along = [abs(one) for one in velocity]
    main, other = (0, 1) if along[0] / grid.lx >= along[1] / grid.ly else (1, 0)
    for count in range(1, ROUNDS):
        seconds = count * grid.size[main] / along[main]
        if seconds > most * (1.0 + SAME):
            break
        if abs(math.remainder(along[other] * seconds, grid.size[other])) <= near + SAME * grid.size[other]:
            return math.hypot(*velocity) * seconds
    return math.inf


def excited_band(job: Sections) -> tuple[float, float] | None:
    """Return the range of frequencies [Hz] at which the waves of a job's surface load a point of the body, over all
    stages and steady velocities, or None if the surface does not move and no load oscillates."""
    velocities = [*(stage.velocity for stage in job.history), job.initial.velocity]
    speeds = [*(math.hypot(*velocity) for velocity in velocities), *(job.steady.velocities if job.steady else ())]
    turns = [stage.frequency for stage in job.history if stage.frequency]
    moving = [speed for speed in speeds if speed > 0.0]
    waves = [number for shape in job.surface for number in wave_numbers(shape, job.grid)]
    if moving and waves:
        turns += [min(moving) * min(waves) / (2 * math.pi), max(moving) * max(waves) / (2 * math.pi)]
    return (min(turns), max(turns)) if turns else None


# tests of a job, in the order of their warnings
IN_BANDS = _temperatures, _moduli
ON_A_GRID = (
    *(_temperatures, doubts_of_resolution, _slopes, _moduli, _pressures, _instants, _band, _imprints),
    *(_ridges, _outside, _short_line, _room, neighbours, limits.doubt_needs),
)
