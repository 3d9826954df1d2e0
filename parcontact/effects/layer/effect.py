"""A layer of rubber on a rigid base: the section `body`, and the effect.

The layer changes only how the surface responds to pressure. The steps of a run, and their cost, stay the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, ClassVar

from pydantic import Field

from ...errors import Doubt, Kind
from ...job import limits
from ...job.advice import more_points
from ...job.parts import Part, Positive, Rule, rules_of
from ...job.stages import Stage
from ...job.surfaces import Flat, Rough, Sphere, Wave, wave_numbers
from ...job.yaml_text import Fault
from ...printed import rounded_up
from ..effect import Decision, Effect
from .response import Base, Layer

THINNEST = 1e-9  # rounding: least thickness of a layer over the longer side of its box
THICKEST = 1 / 3  # physics: limit of small strains for the indentation over the thickness of a layer
FEWEST_CELLS = 2.0  # accuracy: least cells in a thickness, the length over which pressure falls at the edge of contact
LONGEST = 100.0  # physics: wavelength over thickness above which the compressibility of rubber matters
NEARLY = 1e-4  # physics: distance of Poisson's ratio from 1/2 below which a body counts as incompressible


class Body(Part):
    """The section `body`: the body is a layer, which is bonded to a rigid base or slides on it without friction.
    Without this section it is a half space."""

    thickness: Positive = Field(description="a positive thickness [m]")
    base: Base = "bonded"


def _is_thick_enough(body: Any, grid: Any) -> Iterator[Fault]:
    """Yield an error if a layer in a free box is thinner than two cells, or if a layer is too thin for its compliance
    to be a number above 0."""
    least, of_box = 2 * max(grid.dx, grid.dy), THINNEST * max(grid.size)
    if body is not None and grid.boundary == "free" and body.thickness < least:
        sentence = f"must be at least two cells, {rounded_up(least)} m, when grid.boundary is free"
        yield Fault(f"{sentence}, got {body.thickness:g}", ("body", "thickness"))
    if body is not None and body.thickness < of_box:
        sentence = f"must be at least {THINNEST:g} of the box, {of_box:.3g} m, got {body.thickness:g}"
        yield Fault(sentence, ("body", "thickness"))


def _has_a_kernel(body: Any, grid: Any, material: Any, initial: Any, steady: Any) -> Iterator[Fault]:
    """Yield an error for a box that is free along y only, and for steady sliding in a free box or of a body that
    flows."""
    if body is None:
        return
    yield from limits.no_strip("a layer (body)", grid)
    if grid.boundary == "free" and (initial.state == "steady" or steady is not None):
        yield Fault("must be periodic for steady sliding on a layer", ("grid", "boundary"))
    yield from limits.refuse_flow(material, initial, steady)


def _no_bands(body: Any, bands: Any) -> Iterator[Fault]:
    if None not in (body, bands):
        yield Fault("cannot be used with bands: a layer changes the coarsest waves only; give it a grid", ("body",))


def _no_counterbody(body: Any, counterbody: Any) -> Iterator[Fault]:
    if None not in (body, counterbody):
        sentence = "needs a half space: the share of a layer depends on the wavelength"
        yield Fault(f"{sentence}; leave out body, or counterbody", ("counterbody",))


def _no_stick(body: Any, interface: Any) -> Iterator[Fault]:
    if None not in (body, interface) and interface.stick:
        sentence = "needs a half space: pressure on a layer moves its surface sideways; leave out body"
        yield Fault(sentence, ("interface", "stick"))


def _no_softening(body: Any, softening: Any) -> Iterator[Fault]:
    if None not in (body, softening):
        yield Fault("cannot be used with softening: strains are those of a half space", ("body",))


RULES = rules_of(_is_thick_enough, _has_a_kernel, _no_bands, _no_counterbody, _no_stick, _no_softening)


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
    layer. There is none if `doubts_of_layer` already warns without the heights of the surface."""
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
    """Yield a warning if the approach of a sphere is too large for the thickness [m]."""
    if len(surface) != 1 or not isinstance(surface[0], Sphere):
        return
    approaches = [(stage.load.highest, index) for index, stage in enumerate(history) if stage.control == "approach"]
    deepest, index = max(approaches, default=(0.0, 0))
    if deepest > THICKEST * thickness:
        numbers = {"approach": deepest, "thickness": thickness}
        yield WARN_DEEP_FOR_A_LAYER(f"history.{index}.approach", numbers)


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
    """A layer on a rigid base."""

    section: ClassVar[type[Part]] = Body
    columns: ClassVar[tuple[str, ...]] = ()
    in_curves: ClassVar[bool] = True
    in_bands_over_time: ClassVar[bool] = True  # all bands are refused
    lifts: ClassVar[tuple[Any, ...]] = (limits.steady_bodies_do_not_flow,)
    rules: ClassVar[tuple[Rule, ...]] = RULES
    doubts = staticmethod(doubts_of_layer)
    doubt_heights = staticmethod(doubt_span)

    @staticmethod
    def decide(job: Any) -> Decision:
        if (found := job.section("body")) is None:
            return Decision("body", False, "no body section: a half space")
        return Decision("body", True, f"a layer of {found.thickness:g} m, on a {found.base} base")

    @staticmethod
    def response(job: Any, unit: float) -> Layer:
        """Return the response of the layer of a job, with lengths in a `unit` [m]."""
        return Layer(job.body.thickness / unit, job.body.base, poisson=job.material.poisson)
