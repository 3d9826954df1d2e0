"""Temperatures of steady sliding: the map below the contact, exact for its heat (`physics.heat`, `physics.flash`)."""

import math

import numpy as np

from ..effects.thermal import Thermal
from ..parallel.slab import Array
from ..physics.flash import Flash, flash_of, spread_over
from ..physics.heat import depths_of, sliding_heat
from ..physics.heat_unbounded import sliding_heat_unbounded
from ..physics.measures import Measures
from ..scene import Setup

Vector = tuple[float, float]


def warm(
    setup: Setup, section: Thermal, pressure: Array, measures: Measures, friction: float, velocity: Vector
) -> tuple[Flash, Array]:
    """Return the temperatures of a steady state, and this rank's rows of the map of rises [K]; collective.

    `pressure` is its map in the run's units, `friction` that of the body without the interface.
    """
    slab, fft, size, speed = setup.slab, setup.fft, setup.grid.size, math.hypot(*velocity)
    body, rise, heat = section.conductor, slab.zeros(), slab.zeros()
    operator = sliding_heat_unbounded if setup.half_space.free else sliding_heat
    if (power := friction * measures.pressure * speed) > 0.0:  # [W/m^2], mean over the box
        heat += spread_over(slab, pressure, power)
        half_space = setup.half_space
        depths = depths_of(fft.forward(pressure), fft, half_space, setup.units.length, velocity, setup.prony)
        rise += operator(fft, size, body, velocity, depths).apply(heat, slab.empty())
    if (power := measures.friction_interface * measures.pressure * speed) > 0.0:
        rubbed = spread_over(slab, np.where(pressure > 0.0, 1.0, 0.0), power)
        heat += rubbed
        rise += operator(fft, size, body, velocity).apply(rubbed, slab.empty())
    return flash_of(slab, rise, heat), rise
