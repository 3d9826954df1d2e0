"""Warnings about the mesh, the box and the time steps of a job, and the mesh that an accuracy needs.

The errors of friction and of the contact area depend on the number of cells per shortest wave of the surface, along and
across the sliding direction.

The mesh causes two kinds of errors, both at edges of contact. Systematic errors grow with the phase of the modulus,
because the pressure at one edge of a spot is steeper than at the other. Random errors come from the positions of edges
between points. Consider a square whose sides are as long as the shortest wave. If the share A of the surface is in
contact, random errors in this square have the relative standard deviation ((1 - A)/A)^0.5. A box with N shortest waves
along a side has N^2 such squares.

`friction_error` and `area_error` add both kinds of errors. The random errors, and the differences of systematic errors
between surfaces, are taken at `SURE` standard deviations.

The constants were fitted by maximum likelihood to steady states of rough surfaces. The share in contact and the phase
were those that `march.mesh` guesses. Between 1 and 100 % of these surfaces were in contact, and 12 or 24 shortest waves
lay along a side; a surface with fewer waves is treated as a surface with 12. There were 36 states for friction, each on
about 110 meshes, and 24 states for the area, each on about 40 meshes; the references had 160 cells per shortest wave.
`scripts/chosen_mesh.py` tests the chosen meshes on other surfaces. Along a direction (x, y) a cell is hypot(x dx, y dy)
long. If the surface does not slide, x and y are both treated as sliding directions.

Warnings about physics are in `meaning.py`, about memory in `limits.py`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any, NamedTuple, Protocol

from ..errors import Doubt, Kind
from ..printed import per_cent
from .calculation import Accuracy, Grid, Numerics, Output
from .materials import AnyMaterial
from .parts import AUTO, Origin
from .stages import GeometricStep, Initial, Stage, Steady
from .surfaces import Rough


class Sections(Protocol):
    """The sections of a job that determine its warnings and its steps."""

    grid: Grid
    surface: tuple[Any, ...]
    material: AnyMaterial
    initial: Initial
    history: tuple[Stage, ...]
    numerics: Numerics
    output: Output
    steady: Steady | None

    @property
    def origin(self) -> Origin:
        """Return the file, the included materials and the places of keys from which the job was read."""

    @property
    def directions(self) -> list[Vector]:
        """Return the different sliding directions (unit vectors)."""

    @property
    def sheared_first(self) -> bool:
        """Return True if an effect shears the contact before the surface slides over it."""

    @property
    def remembers(self) -> bool:
        """Return True if the result depends on the history."""

    def asked(self, name: str) -> list[Any]:
        """Return the attributes called `name` that classes of effects have. Only effects whose sections the job has are
        asked."""


Vector = tuple[float, float]

SURE = 1.2  # fitted: standard deviations within which nine of ten surfaces lie (`scripts/chosen_mesh.py`)
FEW = 12.0  # accuracy: smallest number of shortest waves along a side in the fits
CELLS_PER_WAVE = 8  # tuning: square cells per shortest wave for an error of 1 %, below which a warning is given
FRICTION_ORDER, AREA_ORDER = 2.5, 1.6  # tuning: order of this error in the number of cells
FRICTION_ASIDE, FRICTION_ASIDE_ORDER = 3e-3, 2.5  # tuning: error with four cells across, and its order, for the same
AREA_ASIDE, AREA_ASIDE_ORDER = 0.0148, 1.1  # tuning: the same for the area
ASIDE = 0.25  # accuracy: component of a unit vector along an axis, up to which the axis is across the sliding
LEAST_CELLS = 2.1  # accuracy: least cells per shortest wave; a grid has no waves shorter than two cells
LONG = 1.2  # accuracy: ratio of the sides of a cell up to which it counts as square
LONGEST = 4.0  # accuracy: largest ratio of the sides of a cell in the fits
MOST_CELLS = 400.0  # tuning: most cells per shortest wave
MULTIPLE = 16  # tuning: divisor of the number of points along a side, for coarser grids to start from
SAME_LENGTH = 1e-9  # rounding: relative difference below which numbers are the same


class Guess(NamedTuple):
    """A guess of the contact before the contact is solved.

    `share` is the share of the surface in contact. `phase` is the phase of the modulus at the frequency at which edges
    of contact pass, divided by 90 degrees. `waves` is the number of shortest waves along a side of the box. `slow` is 1
    if the surface slides far below all frequencies of the body, so that edges lose power in waves shorter than the
    cells, and 0 if it slides fast.
    """

    share: float
    phase: float
    waves: float
    slow: float = 0.0

    @property
    def spread(self) -> float:
        """Return the relative standard deviation of the contact area in a square whose sides are as long as the
        shortest wave."""
        return math.sqrt((1.0 - self.share) / self.share)

    @property
    def few(self) -> float:
        """Return the factor on random errors: 1 for a box with at most `FEW` shortest waves along a side, and less for
        a larger box, in proportion to 1 over the number of these waves."""
        return FEW / max(self.waves, FEW)


def friction_error(c: float, across: float, guess: Guess) -> float:
    """Return a bound on the relative error of friction by the mesh. The error of nine of ten surfaces is smaller.

    `c` and `across` are the numbers of cells per shortest wave along and across the sliding direction. In slow sliding,
    the power that is lost in waves shorter than the cells is added.
    """
    along = (4.0 / c) ** 1.5
    steep = 0.016 * (1.0 - math.exp(-guess.phase / 1.5)) - 0.0004
    counted = math.hypot((4.0 / c) ** 2.15, 0.13 * (4.0 / across) ** 2.7)
    chance = guess.few * 0.0034 * (1.0 + 4.6 * guess.phase) * counted
    unknown = SURE * math.hypot(chance, 0.007 * guess.phase * along)
    return guess.spread * (abs(steep) * along + unknown + 0.09 * guess.slow * 4.0 / c + 0.008 * (4.0 / c) ** 4)


def area_error(c: float, across: float, guess: Guess) -> float:
    """Return a bound on the relative error of the contact area by the mesh, after the area was corrected for cells at
    its edges. The error of nine of ten surfaces is smaller. The correction is too large for elastic bodies. For
    viscoelastic bodies it is too small at edges across the sliding direction. The arguments are those of
    `friction_error`."""
    along, aside = 4.0 / c, 4.0 / across
    known = 0.067 * guess.phase * along - 0.005 * (along + aside)
    chance = guess.few * 0.0078 * math.hypot(along**1.2, 0.7 * aside**1.6)
    return guess.spread**0.8 * abs(known) + SURE * guess.spread * chance


def one_cell(stage: Stage, grid: Grid) -> float:
    """Return the time in which the surface slides by one cell [s]; the stage must have a velocity."""
    return along(stage.velocity, stage.speed, grid) / stage.speed


def along(way: Vector, length: float, grid: Grid) -> float:
    """Return the length of a cell [m] along the direction of the vector `way`. `length` is the magnitude of this
    vector."""
    return math.hypot(way[0] / length * grid.dx, way[1] / length * grid.dy)


def has_wave(grid: Grid, shortest: float, longest: float) -> bool:
    """Return True if a grid resolves any wave, in any direction, whose wavelength is between `shortest` and `longest`
    [m]."""
    least, most = (1 - SAME_LENGTH) / longest, (1 - SAME_LENGTH) / shortest
    rows = (grid.ny - 1) // 2
    for column in range(min(grid.nx // 2, int(most * grid.lx)) + 1):
        rest = math.sqrt(max(least**2 - (column / grid.lx) ** 2, 0.0))
        row = max(math.ceil(rest * grid.ly), 0 if column else 1)
        if row <= rows and math.hypot(column / grid.lx, row / grid.ly) < most:
            return True
    return False


def cells_per_wave(accuracy: float) -> int:
    """Return the number of cells per shortest wave along the sliding direction that keeps the relative error of
    friction below `accuracy`."""
    return max(2, math.ceil(CELLS_PER_WAVE * (1e-2 / accuracy) ** (1.0 / FRICTION_ORDER) * (1 - SAME_LENGTH)))


def cells_for_area(accuracy: float) -> float:
    """Return the number of cells per shortest wave along the sliding direction that keeps the relative error of the
    contact area below `accuracy`."""
    return max(LEAST_CELLS, CELLS_PER_WAVE * (1e-2 / accuracy) ** (1.0 / AREA_ORDER))


def needed(axis: int, directions: Sequence[Vector], asked: Accuracy) -> tuple[float, float]:
    """Return two numbers of cells per shortest wave along an axis (0 for x, 1 for y): those that friction and the
    contact area need for the accuracies `asked`. The surface slides along `directions` (unit vectors). If it does not
    slide, both numbers are those that the area needs."""
    if not directions:
        return cells_for_area(asked.area), cells_for_area(asked.area)
    if any(abs(way[axis]) > ASIDE for way in directions):
        return cells_per_wave(asked.friction), cells_for_area(asked.area)
    for_friction = max(LEAST_CELLS, 4.0 * (FRICTION_ASIDE / asked.friction) ** (1.0 / FRICTION_ASIDE_ORDER))
    return for_friction, max(LEAST_CELLS, 4.0 * (AREA_ASIDE / asked.area) ** (1.0 / AREA_ASIDE_ORDER))


def directions_of(history: Sequence[Stage | None], initial: Initial, steady: Steady | None) -> list[Vector]:
    """Return the different sliding directions of a job (unit vectors); opposite directions count once."""
    ways = [stage.velocity for stage in history if stage is not None and stage.speed] + [initial.velocity]
    found = {_unit(way) for way in ways if any(way)} | ({_unit(steady.unit_direction)} if steady else set())
    return sorted(found)


def _unit(way: Vector) -> Vector:
    """Return the rounded unit vector along `way` or against it that points to +x, else to +y."""
    sign = math.copysign(1.0, way[0] or way[1]) / math.hypot(*way)
    return round(sign * way[0], 9) + 0.0, round(sign * way[1], 9) + 0.0  # no -0


def more_points(grid: Grid) -> str:
    """Return the advice to use more points, along the longer side of the cells if they are not square."""
    if 1 in grid.points or max(grid.dx, grid.dy) < LONG * min(grid.dx, grid.dy):
        return "more grid.points"
    return f"more grid.points along {'x' if grid.dx > grid.dy else 'y'}"


def fast_length(least: float) -> int:
    """Return the smallest number of points for which Fourier transforms are fast, but at least `least`: `MULTIPLE`
    times a number whose prime factors are 2, 3 and 5."""
    count = max(1, math.ceil(least / MULTIPLE * (1.0 - SAME_LENGTH)))
    while 60 ** count.bit_length() % count:  # 60 = 2 * 2 * 3 * 5
        count += 1
    return MULTIPLE * count


def choose_points(
    wave: float, size: Vector, directions: Sequence[Vector], asked: Accuracy, guesses: Sequence[Guess]
) -> tuple[int, int]:
    """Return the numbers of points along x and y of the smallest mesh that meets the accuracies `asked`.

    The surface has the shortest wave `wave` [m] in a box of `size` [m], and slides along `directions` (unit vectors),
    or not at all. The mesh meets the accuracies for all `guesses` of the contact. Of equally large meshes, the mesh
    whose longer side has the fewest points is returned.
    """
    along_x, along_y = (_fast_lengths(MOST_CELLS * length / wave) for length in size)
    meshes = sorted(product(along_x, along_y), key=lambda points: (math.prod(points), max(points)))
    x, y = (wave / length for length in size)
    return next((mesh for mesh in meshes if _fits(mesh[0] * x, mesh[1] * y, directions, asked, guesses)), meshes[-1])


def _fast_lengths(most: float) -> list[int]:
    """Return all lengths of fast transforms up to the first one of at least `most`."""
    found = [fast_length(1)]
    while found[-1] < most:
        found.append(fast_length(found[-1] + 1))
    return found


def _fits(cx: float, cy: float, directions: Sequence[Vector], asked: Accuracy, guesses: Sequence[Guess]) -> bool:
    """Return True if `cx` and `cy` cells per wave along x and y keep the errors `asked`."""
    if min(cx, cy) < LEAST_CELLS or max(cx, cy) > LONGEST * min(cx, cy):
        return False
    for (x, y), guess in product(directions or ((1.0, 0.0), (0.0, 1.0)), guesses):
        c, across = 1.0 / math.hypot(x / cx, y / cy), 1.0 / math.hypot(y / cx, x / cy)
        if area_error(c, across, guess) > asked.area:
            return False
        if directions and friction_error(c, across, guess) > asked.friction:
            return False
    return True


LONG_WAVES = 4  # accuracy: least number of longest waves along the box for a representative surface (paper, section 3)
MOST_LONG_WAVES = 500  # tuning: number of longest waves along the box above which its unit is doubted
STEPS_PER_WAVE = 4  # accuracy: least time steps per shortest wave while sliding
LITTLE = 0.05  # tuning: relative lack of points that gets no warning

# fitted: relative standard deviation over seeds, times longest waves along a side (`scripts/chosen_mesh.py`); 0.1 to
# 0.4 for friction, 0.01 to 0.5 for the area
SEED_FRICTION, SEED_AREA = 0.24, 0.17


def doubts_of_resolution(job: Sections) -> Iterator[Doubt]:
    """Yield warnings about mesh, box and time steps, section by section, but not about a mesh that the program chose
    (`points: auto`)."""
    grid, surface, numerics = job.grid, job.surface, job.numerics
    for index, shape in enumerate(surface):
        if isinstance(shape, Rough) and max(grid.points) > 1:
            yield from _long_waves(index, shape, grid)
            yield from doubt_size(index, shape, grid)
            if not job.origin.mesh:
                found = _few_cells(shape.short_wavelength, grid, numerics.asked, job.directions)
                yield from (WARN_FEW_CELLS(f"surface.{index}", numbers) for numbers in found)
    short = min((shape.short_wavelength for shape in surface if isinstance(shape, Rough)), default=None)
    material = job.material.fitted
    times = [material.time_factor * branch.relaxation_time for branch in material.branches]
    shortest = min((time for time in times if 0 < time < math.inf), default=math.inf)
    for index, stage in enumerate(job.history):
        yield from _steps(index, stage, grid, shortest if numerics.integrator == "backward-euler" else math.inf, short)


def _directions(grid: Grid) -> list[tuple[str, float, float]]:
    """Return name, box length and cell [m] of the axes that have more than one point."""
    found = zip("xy", grid.size, (grid.dx, grid.dy), grid.points, strict=True)
    return [(name, length, cell) for name, length, cell, points in found if points > 1]


WARN_FEW_LONG_WAVES = Kind(
    "few long waves",
    "only {waves:.3g} of the longest waves fit into the box along {axis}; a representative surface needs at least "
    "{least}: use a grid.size of {size!u} m or a long_wavelength of {wave!d} m",
)


def _long_waves(index: int, shape: Rough, grid: Grid) -> Iterator[Doubt]:
    longest = dict(zip("xy", shape.longest, strict=True))
    count, axis = min((length / longest[name], name) for name, length, _ in _directions(grid))
    if count < LONG_WAVES * (1 - SAME_LENGTH):
        enough = {"size": LONG_WAVES * longest[axis], "wave": count / LONG_WAVES * shape.long_wavelength}
        yield WARN_FEW_LONG_WAVES(f"surface.{index}", {"waves": count, "axis": axis, "least": LONG_WAVES, **enough})


WARN_LARGE_BOX = Kind(
    "large box",
    "a side of {length:g} m, {times:.4g} times {key}, {wave:g} m; is it in m? {length:g} mm would be {in_milli:g}",
)


def doubt_size(index: int, shape: Rough, grid: Grid) -> Iterator[Doubt]:
    """Yield a warning if the box is longer than `MOST_LONG_WAVES` times the longest wave of a shape. `index` is the
    place of the shape in the list `surface`."""
    length = max((length for _, length, _ in _directions(grid)), default=0.0)
    if length > MOST_LONG_WAVES * shape.long_wavelength:
        of_wave = {"wave": shape.long_wavelength, "times": length / shape.long_wavelength}
        numbers = {"length": length, "in_milli": length / 1000, "key": f"surface.{index}.long_wavelength", **of_wave}
        yield WARN_LARGE_BOX("grid.size", numbers)


WARN_FEW_CELLS = Kind(
    "few cells",
    "only {cells:.3g} cells per shortest wave along {axis}; {reason} needs {needed:.3g}: use {points} points "
    "({memory:.2g} times the memory{time}) or a short_wavelength of {wave:.4g} m",
)


WARN_FEW_CELLS_OF_A_MAP = Kind(
    "few cells of a map",
    "only {cells:.3g} cells per shortest wave along {axis} ({known:.3g} m, by the spectrum of the "
    "heights{spikes}); {reason} needs {needed:.3g}: use {points} points ({memory:.2g} times the memory{time}), to "
    "which a topography is interpolated (resample an array yourself), or heights without waves shorter than "
    "{wave:.4g} m",
)


def doubt_measured_waves(
    grid: Grid, wave: float, asked: Accuracy, directions: Sequence[Vector], spiky: bool = False
) -> Iterator[Doubt]:
    """Yield a warning if a measured surface, which slides along `directions`, has too few cells per shortest wave.

    `wave` [m] is the length of the shortest wave. If the surface is `spiky`, the warning says that outliers may be the
    reason for such a short wave.
    """
    spikes = ", which has outliers" if spiky else ""
    for numbers in _few_cells(wave, grid, asked, directions):
        yield WARN_FEW_CELLS_OF_A_MAP("surface", {**numbers, "known": wave, "spikes": spikes})


def _few_cells(wave: float, grid: Grid, asked: Accuracy, directions: Sequence[Vector]) -> Iterator[dict[str, object]]:
    """Yield the numbers of a warning if the shortest wave [m] has too few cells: the points needed along the axis that
    lacks most, and the factors of memory and time."""
    wants = {name: needed("xy".index(name), directions, asked) for name, _, _ in _directions(grid)}
    lacks = {name: max(wants[name]) * cell / wave for name, _, cell in _directions(grid)}
    name, length, cell = max(_directions(grid), key=lambda direction: lacks[direction[0]], default=("", 0.0, 0.0))
    more = math.prod(max(lack, 1.0) for lack in lacks.values())
    if not name or more <= 1 + LITTLE:
        return
    least, of_area = wants[name]
    reason = "a resolved contact" if math.isclose(least, of_area) else "friction" if least > of_area else "its area"
    slides = lambda axis: not directions or any(abs(way["xy".index(axis)]) > ASIDE for way in directions)  # noqa: E731
    finer = max((max(lack, 1.0) for axis, lack in lacks.items() if slides(axis)), default=1.0)
    yield {
        "cells": wave / cell,
        "axis": name,
        "reason": reason,
        "needed": max(wants[name]),
        "points": math.ceil((1 - SAME_LENGTH) * max(wants[name]) * length / wave),
        "memory": more,
        "time": f", about {more * finer:.2g} times the time in sliding" if directions else "",
        "wave": max(wants[name]) * cell,
    }


def longest_step(stage: Stage, grid: Grid) -> float:
    """Return the longest time step of a stage [s], before steps are fitted to the end of the stage. Return 0 for
    `time_step: auto`, since chosen steps need no warning."""
    step = stage.time_step
    if step == AUTO:
        return 0.0
    if stage.cells_per_step is not None:
        return min(stage.seconds, stage.cells_per_step * one_cell(stage, grid))
    if isinstance(step, GeometricStep):  # n steps last first (growth^n - 1) / (growth - 1)
        return min(stage.seconds, (stage.seconds * (step.growth - 1) + step.first) / step.growth)
    return min(stage.seconds, step or 0.0)


WARN_SLIDES_IN_NO_TIME = Kind(
    "slides in no time", "a stage without duration or distance does not slide; its velocity has no effect"
)
WARN_LONG_STEPS = Kind(
    "long steps",
    "time steps of up to {step:.3g} s exceed the shortest relaxation time, {shortest:.3g} s, which backward-euler "
    "must resolve; use shorter steps or integrator: exponential",
)
WARN_SKIPPED_WAVES = Kind(
    "skipped waves",
    "the surface slides {slid:.3g} m in one step, {share:.2g} of its shortest wave; use time steps of at most "
    "{step!d} s (cells_per_step of at most {cells!d})",
)


def _steps(index: int, stage: Stage, grid: Grid, resolved: float, short: float | None) -> Iterator[Doubt]:
    """Yield warnings about steps longer than the time `resolved` [s], or too long for the shortest wave `short` [m]."""
    step = longest_step(stage, grid)
    slid = step * stage.speed
    if stage.speed and not stage.seconds:
        yield WARN_SLIDES_IN_NO_TIME(f"history.{index}")
    if step > resolved * (1 + SAME_LENGTH):
        yield WARN_LONG_STEPS(f"history.{index}", {"step": step, "shortest": resolved})
    if short is not None and slid > short / STEPS_PER_WAVE * (1 + SAME_LENGTH):
        enough = short / STEPS_PER_WAVE / stage.speed
        numbers = {"slid": slid, "share": slid / short, "step": enough, "cells": enough / one_cell(stage, grid)}
        yield WARN_SKIPPED_WAVES(f"history.{index}", numbers)


def describe_sample(grid: Grid, surface: tuple[Any, ...], slides: bool) -> str:
    """Return a sentence on how much the contact area differs between seeds of the surface, and friction, too, if the
    surface `slides`. Return '' for a surface without a seed.

    The scatter falls with the square root of the number of longest waves in the box.
    """
    rough = [shape.longest for shape in surface if isinstance(shape, Rough)]
    if not rough:
        return ""
    longest = dict(zip("xy", map(max, zip(*rough, strict=True)), strict=True))
    counts = [max(length / longest[name], 1.0) for name, length, _ in _directions(grid)]
    root = math.sqrt(math.prod(counts))
    friction = f"friction by about {per_cent(SEED_FRICTION / root)} and " if slides else ""
    return (
        f"another seed of the surface would change {friction}the contact area by about {per_cent(SEED_AREA / root)} "
        f"(standard deviation): {' x '.join(f'{count:.3g}' for count in counts)} of its longest waves fit into the box"
    )
