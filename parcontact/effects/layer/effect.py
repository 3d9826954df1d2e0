"""A layer of rubber on a rigid base: its response to pressure, the section `body`, and the effect.

The effect changes only how the surface responds to pressure. The steps of a run, and their cost, stay the same.

The surface of a layer of shear modulus 1, Poisson's ratio nu and thickness d moves under a pressure wave p^ of the
wavenumber q by

    u^(q) = (1 - nu)/q S(q d) p^(q),

where S is the ratio of this displacement to that of a half space. If the layer is bonded to the base,
with `kappa = 3 - 4 nu`,

    S(x) = (kappa sinh 2x - 2x) / (kappa cosh 2x + 2x^2 + 5 - 12 nu + 8 nu^2),

and if it slides freely along a smooth base,

    S(x) = (cosh 2x - 1) / (sinh 2x + 2x).

A uniform pressure p strains the layer in one direction only, and moves its surface by `p d (1 - 2 nu)/(2 (1 - nu))`: an
incompressible layer does not move. S tends to 1 for a thick layer. Sources: I. N. Sneddon, Fourier Transforms (1951);
for the bonded layer G. Carbone and L. Mangialardi, J. Mech. Phys. Solids 56 (2008) 684.

The solver of contacts needs a preconditioner, which turns a residual r (a displacement) into a pressure z. A
preconditioner K for waves in the whole box is not enough for waves that are long compared with the thickness of a
layer. These waves displace a layer by

    u = c0 p - c2 laplace p,

where c0 = 0 for a bonded incompressible layer, which flows along its base like a viscous film. For these waves the
layer is far stiffer than for its softest wave. Yet K must limit the stiffness of long waves to that of the softest
wave: the pressure vanishes outside contact, and patches of contact do not interact if their distance is larger than the
thickness. So a second part is added to the pressure that K gives. This part acts within each patch, and solves the
equation above for the pressure on the contact,

    c0 z - c2 laplace z + c2 (1 - c)/l^2 z = r,

with c = 1 in contact and 0 outside, where z decays over the length l, twice the thickness. One V-cycle, in which each
step joins two by two cells, approximates the solution. The V-cycle starts with cells of half the thickness, since K
treats shorter waves. It makes one damped Jacobi step on the way to larger cells and one on the way back, so that the
preconditioner is symmetric. Maps are in single precision.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ...compiled import loop
from ...contact.preconditioner import ExtendedPreconditioner, cell_levels, lengths
from ...contact.problem import Operator
from ...errors import Doubt, Kind
from ...job import limits
from ...job.advice import more_points
from ...job.parts import Part, Positive, Rule, rules_of
from ...job.stages import Stage
from ...job.surfaces import Flat, Indenter, Rough, Wave, wave_numbers
from ...job.yaml_text import Fault
from ...parallel.slab import Array, Slab
from ...physics.halfspace import Response, Vector
from ...physics.records import Measures
from ...printed import rounded_up
from ..effect import Decision, Effect

Base = Literal["bonded", "smooth"]
THICK = 22.0  # accuracy: x above which S(x) - 1 is below rounding
FAR = 50.0  # accuracy: distance over thickness beyond which displacements are below rounding
KNOTS_PER_THICKNESS = 16  # accuracy: knots of the spline through the correction; its error is below 1e-6
NODES = 900  # accuracy: nodes of the integral over wavenumbers, 5 per oscillation of the Bessel function
SOFTEST_BETWEEN, SOFTEST_TRIED = (1e-3, 1e2), 2000  # tuning: range and number of q d that are searched
HARDLY_STIFFER = 0.8  # tuning: stiffness ratio of softest to longest waves above which LongWaves are not used
SERIES_BELOW = 1.0  # accuracy: y below which sinh(y) - y is a series, exact to rounding
DAMPING = np.float32(0.8)  # tuning: factor on the Jacobi steps
DECAY = 2.0  # tuning: decay length of z outside contact, over the thickness
FINEST = 0.5  # tuning: least length of cells that are smoothed, over the thickness
MAPS = 4  # maps on each grid
SAME = 1e-9  # accuracy: relative difference below which two lengths are equal


@dataclass(frozen=True)
class LongWaves:
    """The compliance `c0 + c2 q^2` of long waves on a layer of this `thickness`, in a box of this `size`. All lengths
    have the same unit, which may be any.

    A preconditioner for waves in the whole box treats these waves as if they were as soft as the softest wave of the
    layer; `LongWavePreconditioner` corrects this.
    """

    c0: float
    c2: float
    thickness: float
    size: tuple[float, float]


@dataclass(frozen=True)
class Layer(Response):
    """A layer of shear modulus 1 and `thickness` [any unit of length] on a rigid base."""

    base: Base = "bonded"

    def compliance_ratio(self, q: Array) -> Array:
        """Return S(q d), the displacement of the layer divided by that of a half space, for wavenumbers q > 0; 0 for q
        = 0."""
        x = np.asarray(q * self.thickness, dtype=float)
        y, decay = 2.0 * x, np.exp(-2.0 * x)  # both are multiplied by 2 exp(-y) against overflow
        sinh, cosh = -np.expm1(-2.0 * y), 1.0 + decay**2
        if self.base == "smooth":
            ratio = np.divide(np.expm1(-y) ** 2, sinh + 2.0 * y * decay, out=np.zeros_like(y), where=y > 0.0)
            return np.asarray(ratio)
        nu, kappa = self.poisson, 3.0 - 4.0 * self.poisson
        beyond = np.where(
            y < SERIES_BELOW, 2.0 * decay * _sinh_beyond(np.minimum(y, SERIES_BELOW)), sinh - 2 * y * decay
        )
        above = kappa * beyond + (kappa - 1.0) * 2.0 * y * decay
        below = kappa * cosh + 2.0 * decay * (2.0 * x**2 + 5.0 - 12.0 * nu + 8.0 * nu**2)
        return np.asarray(above / below)

    @property
    def mean_compliance(self) -> float:
        """Displacement per unit of uniform pressure."""
        return self.thickness * (1.0 - 2.0 * self.poisson) / (2.0 * (1.0 - self.poisson))

    @cached_property
    def softest_wave(self) -> tuple[float, float]:
        """Wavenumber of the wave for which the layer is softest, and the ratio of pressure to displacement for this
        wave.

        A compressible layer is softest for the longest waves. An incompressible bonded layer is softest for waves about
        four times as long as the thickness, as longer waves must push the rubber along its base.
        """
        q = np.geomspace(*SOFTEST_BETWEEN, SOFTEST_TRIED) / self.thickness
        stiffness = q / ((1.0 - self.poisson) * self.compliance_ratio(q))
        softest = int(np.argmin(stiffness))
        return float(q[softest]), float(stiffness[softest])

    def stiffness(self, q: Array) -> Array:
        """Return the ratio of pressure to displacement for waves with the wavenumbers q, for a preconditioner.

        Waves that are longer than the softest wave get the stiffness of the softest wave. With their own, higher
        stiffness they would couple patches of contact that do not interact; `LongWavePreconditioner` adds this
        stiffness within patches.
        """
        softest, stiffness = self.softest_wave
        return np.where(q < softest, stiffness, super().stiffness(q) / self.compliance_ratio(q))

    def reach(self, size: Vector) -> float:
        """Return the distance beyond which points in a box hardly interact: the thickness, or half of it if the layer
        is nearly rigid to long waves."""
        return self.thickness * (1.0 if self.long_waves(size) is None else 0.5)

    def preconditioner(self, size: Vector) -> Callable[..., Any] | None:
        waves = self.long_waves(size)
        return None if waves is None else partial(LongWavePreconditioner, waves)

    def long_waves(self, size: Vector) -> LongWaves | None:
        """Return the compliance of those waves in a box that are longer than the softest wave. Return None if they are
        hardly stiffer than the softest wave, or if the box is too small for such waves.

        With the wavenumber q, the compliance of long waves on a bonded layer is, to second order in q, `mean_compliance
        + q^2 d^3 ((3 - 4 nu)/(6 (1 - nu)) - (1 - 2 nu)/(2 (1 - nu)^2))`. For an incompressible layer this is `q^2
        d^3/3`.
        """
        nu, softest, stiffness = self.poisson, *self.softest_wave
        least = stiffness * self.mean_compliance
        if self.base == "smooth" or least > HARDLY_STIFFER or softest * max(size) < 2 * np.pi:
            return None
        second = (3.0 - 4.0 * nu) / (6.0 * (1.0 - nu)) - (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu) ** 2)
        c0, c2 = self.mean_compliance / (1.0 - least), self.thickness**3 * second / (1.0 - least) ** 2
        return LongWaves(c0, c2, self.thickness, size)

    def coefficient(self, x: Array, y: Array, dx: float, dy: float) -> Array:
        """Return the displacements at distances (x, y) from a cell of `dx x dy` under unit pressure.

        At the distance r from a unit force, the displacement differs from that of a half space by
        `(1 - nu)/(2 pi) int (S(q d) - 1) J0(q r) dq`. This difference is smooth on the scale of the thickness, so that
        Simpson's rule averages it over the cell. It is taken as 0 for distances beyond FAR times the thickness.
        """
        correction = self._correction()
        mean = np.zeros(np.broadcast_shapes(x.shape, y.shape))
        for i, weight_x in zip((-0.5, 0.0, 0.5), (1 / 6, 2 / 3, 1 / 6), strict=True):
            for j, weight_y in zip((-0.5, 0.0, 0.5), (1 / 6, 2 / 3, 1 / 6), strict=True):
                r = np.hypot(x + i * dx, y + j * dy)
                mean += weight_x * weight_y * correction(np.minimum(r, FAR * self.thickness))
        far = np.hypot(x, y) > (FAR - 1.0) * self.thickness
        return np.where(far, 0.0, super().coefficient(x, y, dx, dy) + dx * dy * mean)

    def _correction(self) -> Callable[[Array], Array]:
        """Return a function of the distance r: the displacement under a unit force, minus that of a half space."""
        from scipy.interpolate import make_interp_spline  # slow to import, and for isolated layers only
        from scipy.special import j0

        nodes, weights = np.polynomial.legendre.leggauss(NODES)
        q = THICK / self.thickness * (nodes + 1.0) / 2.0
        strength = weights * THICK / self.thickness / 2.0 * (self.compliance_ratio(q) - 1.0)
        r = self.thickness * np.linspace(0.0, FAR, int(FAR * KNOTS_PER_THICKNESS) + 1)
        values = j0(np.outer(r, q)) @ strength * (1.0 - self.poisson) / (2.0 * np.pi)
        return make_interp_spline(r, values, k=5)


def _sinh_beyond(y: Array) -> Array:
    """Return sinh(y) - y without cancellation, for small y."""
    term = total = y**3 / 6.0
    for n in range(5, 25, 2):
        term = term * y**2 / (n * (n - 1))
        total = total + term
    return np.asarray(total)


# -- long waves within the contact ------------------------------------------------------------------------------------


class LongWavePreconditioner:
    """A preconditioner for waves in the whole box, extended by the part for long waves within contact. It holds four
    maps in single precision on each grid of cells."""

    def __init__(self, waves: LongWaves, slab: Slab, extended: ExtendedPreconditioner) -> None:
        self._extended, self._levels = extended, cell_levels(slab)
        self._first = _first_grid(slab.nx, slab.ny, waves)
        grids = [slab, *(level.coarse for level in self._levels)]
        kept = [grid if level or not self._first else None for level, grid in enumerate(grids)]
        none = np.empty((0, 0), np.float32)
        self._given, self._z, self._left, self._diagonal = (
            [none if grid is None else grid.empty(np.float32) for grid in kept] for _ in range(MAPS)
        )
        dx, dy = waves.size[0] / slab.nx, waves.size[1] / slab.ny
        self._faces = np.float32(dy / dx), np.float32(dx / dy)
        self._scale = dx * dy / waves.c2
        stiffness = waves.c0 / waves.c2 + 1.0 / max(waves.size) ** 2  # 2nd term: no wave is longer than the box
        self._inside, self._outside = dx * dy * stiffness, dx * dy / (DECAY * waves.thickness) ** 2
        self._cell_lengths = [
            (lengths(slab.ny, level)[grid.rows], lengths(slab.nx, level)) for level, grid in enumerate(grids)
        ]

    def apply(self, preconditioner: Operator, working: NDArray[Any], r: Array) -> None:
        """Replace the residual r by the pressure z; collective. `working` is not 0 at the points whose pressure the
        solver changes at present. Elsewhere r must be 0, and z has no meaning."""
        self._weigh(working)
        if not self._first:
            self._given[0][...] = r
        self._cycle(0, r)
        self._extended.apply(preconditioner, working, r)
        level = 1 if self._first else 0
        self._z[level] *= np.float32(self._scale)
        if level:
            self._add_up_back(0, r)
        else:
            r += self._z[0]

    def _weigh(self, working: NDArray[Any]) -> None:
        """Compute the diagonals of the equation for z on all grids, from the number of points in `working` in each
        cell."""
        counts = [working, *self._diagonal[1:]]
        for k, cells in enumerate(self._levels):
            cells.add_up(*counts[k : k + 2])
        for level, (diagonal, lines) in enumerate(zip(self._diagonal, self._cell_lengths, strict=True)):
            if level or not self._first:
                faces = 2.0 * sum(self._faces)
                _find_diagonal(counts[level], *lines, self._inside, self._outside, faces, diagonal)

    def _cycle(self, level: int, r: Array) -> None:
        """Approximate z on a grid by a V-cycle from this grid to larger cells and back. The right side is stored for
        each grid."""
        given, z, left, diagonal = (maps[level] for maps in (self._given, self._z, self._left, self._diagonal))
        if level == len(self._levels):  # a single cell, its own neighbour
            z[...] = given / (diagonal - 2.0 * sum(self._faces))
        elif level < self._first:
            self._add_up(level, given if level else r)
            self._cycle(level + 1, r)
            if level:
                z.fill(0.0)
                self._add_up_back(level, z)
        else:
            np.multiply(given, DAMPING, out=z)
            z /= diagonal
            self._find_rest(level)
            self._add_up(level, left)
            self._cycle(level + 1, r)
            self._add_up_back(level, z)
            self._find_rest(level)
            _correct(left, diagonal, z)

    def _find_rest(self, level: int) -> None:
        z = self._z[level]
        neighbours = self._levels[level].step.adjacent_points(z, 0, -1)
        _rest(z, neighbours, self._given[level], self._diagonal[level], *self._faces, self._left[level])

    def _add_up(self, level: int, points: NDArray[Any]) -> None:
        """Add up points over the cells of the next grid, and store the sums as the right side of the next grid."""
        self._levels[level].add_up(points, self._given[level + 1])

    def _add_up_back(self, level: int, points: NDArray[Any]) -> None:
        """Add z of each cell of the next grid to its points."""
        self._levels[level].add_up_back(self._z[level + 1], points)


def _first_grid(nx: int, ny: int, waves: LongWaves) -> int:
    """Return how many times cells are doubled before the first smoothing."""
    cell = max(waves.size[0] / nx, waves.size[1] / ny)
    return max(math.floor(math.log2(FINEST * waves.thickness / cell * (1.0 + SAME))), 0)


@loop
def _find_diagonal(count, rows, columns, inside, outside, faces, out):
    """Put `faces + inside count + outside (points - count)` into `out`. For each cell, `points` is the number of its
    points, and `count` the number of those in contact."""
    for j in range(out.shape[0]):
        for i in range(out.shape[1]):
            points = rows[j] * columns[i]
            out[j, i] = faces + inside * points + outside * (points - count[j, i])


@loop
def _rest(z, neighbours, given, diagonal, along_x, along_y, out):
    """Put the residual of the equation into `out`: `given - diagonal z` plus z of the neighbours times their faces."""
    rows, columns = z.shape
    for j in range(rows):
        below = z[j + 1] if j + 1 < rows else neighbours[0]
        above = z[j - 1] if j > 0 else neighbours[1]
        for i in range(columns):
            left = z[j, i - 1] if i > 0 else z[j, columns - 1]
            right = z[j, i + 1] if i + 1 < columns else z[j, 0]
            near = along_x * (left + right) + along_y * (below[i] + above[i])
            out[j, i] = given[j, i] - diagonal[j, i] * z[j, i] + near


@loop
def _correct(left, diagonal, z):
    for j in range(z.shape[0]):
        for i in range(z.shape[1]):
            z[j, i] += DAMPING * left[j, i] / diagonal[j, i]


THINNEST = 1e-9  # rounding: least thickness of a layer over the longer side of its box
THICKEST = 1 / 3  # physics: limit of small strains for the indentation over the thickness of a layer
FEWEST_CELLS = 2.0  # accuracy: least cells in a thickness, the length over which pressure falls at the edge of contact
LONGEST = 100.0  # physics: wavelength over thickness above which the compressibility of rubber matters
SMALL_CONTACT = (  # physics: errors of a half space, in `tests/effects/layer/test_response.py`
    "if contacts have radii below a tenth of the thickness (up to 13 % too soft under pressure, 5 % under shear)"
)
NEARLY = 1e-4  # physics: distance of Poisson's ratio from 1/2 below which a body counts as incompressible


# -- the section of a job, and its effect ------------------------------------------------------------------------------


class Body(Part):
    """The section `body`: the body is a layer, which is bonded to a rigid base or slides on it without friction.
    Without this section the body is a half space."""

    thickness: Positive = Field(description="a positive thickness [m]")
    base: Base = "bonded"


def _is_thick_enough(body: Any, grid: Any) -> Iterator[Fault]:
    """Yield an error if a layer in a free box is thinner than two cells, or if a layer is too thin for its compliance
    to be a number above 0."""
    least, of_box = 2 * max(grid.dx, grid.dy), THINNEST * max(grid.size)
    if grid.boundary == "free" and body.thickness < least:
        sentence = f"must be at least two cells, {rounded_up(least)} m, when grid.boundary is free"
        yield Fault(f"{sentence}, got {body.thickness:g}", ("body", "thickness"))
    if body.thickness < of_box:
        sentence = f"must be at least {THINNEST:g} of the box, {of_box:.3g} m, got {body.thickness:g}"
        yield Fault(sentence, ("body", "thickness"))


def _has_a_kernel(body: Any, grid: Any, material: Any, initial: Any, steady: Any) -> Iterator[Fault]:
    """Yield an error for a box that is free along y only, and for steady sliding in a free box or of a body that
    flows."""
    yield from limits.no_strip("a layer (body)", grid)
    if grid.boundary == "free" and (initial.state == "steady" or steady is not None):
        yield Fault("must be periodic for steady sliding on a layer", ("grid", "boundary"))
    yield from limits.refuse_flow(material, initial, steady)


def _no_bands(body: Any, bands: Any) -> Iterator[Fault]:
    if bands is not None:
        yield Fault("cannot be used with bands: a layer changes the coarsest waves only; give it a grid", ("body",))


def _no_counterbody(body: Any, counterbody: Any) -> Iterator[Fault]:
    sentence = "needs a half space: the share of a layer depends on the wavelength"
    yield Fault(f"{sentence}; leave out body, or counterbody", ("counterbody",))


def _no_stick(body: Any, interface: Any) -> Iterator[Fault]:
    if interface.stick:
        sentence = "needs a half space: pressure on a layer moves its surface sideways, which is not solved for"
        remedy = f"use a shear_stress without stick, or leave out body {SMALL_CONTACT}"
        yield Fault(f"{sentence}; {remedy}", ("interface", "stick"))


def _no_softening(body: Any, softening: Any) -> Iterator[Fault]:
    yield Fault("cannot be used with softening: strains are those of a half space; leave one of them out", ("body",))


WARN_THIN = Kind(
    "thin",
    "{thickness:g} m is thinner than {least:g} cells of {cell:.3g} m, so edges of contacts are not resolved; use "
    "{more}, or a smaller grid.size",
)
WARN_INCOMPRESSIBLE = Kind(
    "incompressible",
    "waves of {wave:.3g} m are more than {times:g} times as long as the layer is thick ({thickness:g} m); rubber "
    "yields to them by its compressibility, which a Poisson's ratio of {poisson:g} excludes: use 0.4995",
)


def doubts_of_layer(job: Any) -> Iterator[Doubt]:
    """Yield warnings about the `body` section of a job."""
    grid, surface, body, poisson = job.grid, job.surface, job.body, job.material.poisson
    cell = max(grid.dx, grid.dy)
    smooth = all(isinstance(shape, Wave | Flat) for shape in surface)
    if body.thickness < FEWEST_CELLS * cell and grid.boundary == "periodic" and not smooth:
        numbers = {"thickness": body.thickness, "least": FEWEST_CELLS, "cell": cell, "more": more_points(grid)}
        yield WARN_THIN("body.thickness", numbers)
    yield from _too_high(job, _least_height(surface))
    yield from _indented(surface, body.thickness, job.history)
    waves = (wave_numbers(shape, grid) for shape in surface if isinstance(shape, Wave | Rough))
    longest = max((2 * math.pi / min(each) for each in waves if each), default=0.0)
    if longest > LONGEST * body.thickness and poisson > 0.5 - NEARLY and body.base == "bonded":
        numbers = {"wave": longest, "times": LONGEST, "thickness": body.thickness, "poisson": poisson}
        yield WARN_INCOMPRESSIBLE("material.poisson", numbers)


WARN_HIGH_FOR_A_LAYER = Kind(
    "high for a layer",
    "the surface is {height:.3g} m high or more, above a third of the layer ({thickness:g} m), so strains are not "
    "small; use a thicker layer, or a lower surface",
)


def doubt_span(job: Any, span: float) -> Iterator[Doubt]:
    """Yield a warning if a surface with the height `span` [m] from its lowest to its highest point is too high for the
    layer. Yield none if `doubts_of_layer` warns already, for which it does not need the heights of the surface."""
    if not any(_too_high(job, _least_height(job.surface))):
        yield from _too_high(job, span)


def _too_high(job: Any, height: float) -> Iterator[Doubt]:
    if height > THICKEST * job.body.thickness:
        yield WARN_HIGH_FOR_A_LAYER("body.thickness", {"height": height, "thickness": job.body.thickness})


WARN_DEEP_FOR_A_LAYER = Kind(
    "deep for a layer",
    "{approach:.3g} m is more than a third of the layer ({thickness:g} m), so strains are not small; use a smaller "
    "approach, or a thicker layer",
)


def _indented(surface: tuple[Any, ...], thickness: float, history: tuple[Stage, ...]) -> Iterator[Doubt]:
    """Yield a warning if the prescribed approach of an indenter is too large for the thickness [m]."""
    if not _is_indenter(surface):
        return
    approaches = [(stage.load.highest, index) for index, stage in enumerate(history) if stage.control == "approach"]
    deepest, index = max(approaches, default=(0.0, 0))
    if deepest > THICKEST * thickness:
        numbers = {"approach": deepest, "thickness": thickness}
        yield WARN_DEEP_FOR_A_LAYER(f"history.{index}.approach", numbers)


WARN_PRESSED_DEEP = Kind(
    "pressed deep",
    "{where}: the indenter is {approach:.3g} m deep in the layer, more than a third of its thickness "
    "({thickness:g} m), so strains are not small; use a smaller load, or a thicker layer",
)


def _is_indenter(surface: tuple[Any, ...]) -> bool:
    return len(surface) == 1 and isinstance(surface[0], Indenter)


def _least_height(surface: tuple[Any, ...]) -> float:
    """Return a lower bound of the height [m] of a surface: twice the rms height of its waves and roughness. If only the
    slope of a roughness is given, its shortest waves give a lower bound of its rms height."""
    square = 0.0
    for shape in surface:
        if isinstance(shape, Wave):
            square += shape.amplitude**2 / 2
        elif isinstance(shape, Rough):
            by_slope = (shape.rms_slope or 0.0) * shape.short_wavelength / (2 * math.pi)
            square += max(shape.rms_height or 0.0, by_slope) ** 2
    return 2.0 * math.sqrt(square)


class RubberLayer(Effect[None]):
    """Effect of the section `body`: the body is a layer on a rigid base."""

    section: ClassVar[type[Part]] = Body
    columns: ClassVar[tuple[str, ...]] = ()
    in_curves: ClassVar[bool] = True
    in_bands_over_time: ClassVar[bool] = True  # all bands are refused
    lifts: ClassVar[tuple[Any, ...]] = (limits.steady_bodies_do_not_flow,)
    rules: ClassVar[tuple[Rule, ...]] = rules_of(
        *(_is_thick_enough, _has_a_kernel, _no_bands, _no_counterbody, _no_stick, _no_softening)
    )
    doubts = staticmethod(doubts_of_layer)
    doubt_heights = staticmethod(doubt_span)

    @staticmethod
    def doubt_contact(job: Any, measures: Measures, where: str) -> Iterator[Doubt]:
        """Yield a warning if a load presses an indenter too deeply into the layer."""
        deep = _is_indenter(job.surface) and measures.approach > THICKEST * job.body.thickness
        if deep and not any(_indented(job.surface, job.body.thickness, job.history)):
            numbers = {"where": where, "approach": measures.approach, "thickness": job.body.thickness}
            yield WARN_PRESSED_DEEP("", numbers)

    @staticmethod
    def decide(job: Any) -> Decision:
        if (found := job.section("body")) is None:
            return Decision("body", False, "no body section: a half space")
        return Decision("body", True, f"a layer of {found.thickness:g} m, on a {found.base} base")

    @staticmethod
    def response(job: Any, unit: float) -> Layer:
        """Return the response of the layer of a job, with lengths in a `unit` [m]."""
        return Layer(job.body.thickness / unit, job.body.base, poisson=job.material.poisson)
