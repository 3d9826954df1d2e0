"""A steady state of sliding as data, and the power lost in each branch of the body.

A wave of amplitude u^ loses the power `|u^|^2/A |w| G_k''(|w|)` in branch k, with w the frequency with which it passes
a point, and A its displacement divided by its pressure for a modulus of 1.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..contact.problem import Contact
from ..parallel.slab import Array, deal
from ..physics.convolution import PARTS, wavenumbers
from ..physics.prony import Prony
from ..physics.records import Certificate, Measures
from .budget import ErrorBudget
from .scene import Setup

Vector = tuple[float, float]


@dataclass(frozen=True)
class Point:
    """A steady state of sliding, with its measures, errors and cost.

    `velocity` [m/s], `pressure` [Pa] and `temperature` [deg C] (NaN if none is given) are its parameters;
    `shift_factor` is the ratio of relaxation times to those at the reference temperature. `friction` is the dissipated
    power divided by load and speed, plus the friction of an interface; `errors` is its error budget. `measures` holds
    friction by the slopes of the rigid surface, which differs by a mesh error. `operator_calls` are counted as
    applications on the finest grid. `dissipated` is the power [W] of each branch (empty for a free box, whose wake
    continues outside). `effects` holds the results of effects by section.
    """

    velocity: Vector
    pressure: float
    temperature: float
    shift_factor: float
    measures: Measures
    friction: float
    errors: ErrorBudget
    certificate: Certificate
    operator_calls: float
    seconds: float
    dissipated: tuple[float, ...]
    effects: Mapping[str, Any] = field(default_factory=dict)

    @property
    def speed(self) -> float:
        """Magnitude of the velocity [m/s]."""
        return math.hypot(*self.velocity)

    @property
    def error_friction(self) -> float:
        """Relative error of friction, 1 or more if the error exceeds friction itself; NaN without friction, and if
        spots may be smaller than a cell."""
        return self.errors.friction.of_friction if self.errors.friction and self.errors.resolved else math.nan

    @property
    def error_area(self) -> float:
        """Relative error of the corrected area; NaN if spots may be smaller than a cell."""
        return self.errors.area.total if self.errors.resolved else math.nan

    def with_effect(self, section: str, found: Any) -> Point:
        """Return the point with the result `found` of the effect of a section."""
        return replace(self, effects={**self.effects, section: found})


def in_rounds(points: Sequence[Point]) -> Point:
    """Return the last of the points that the rounds of a fixed point have given, with the cost of all rounds, and with
    the relative changes in the last round as errors."""
    *_, before, last = [*points[-1:], *points]
    friction, area = (
        abs(one - other) / one if one > 0.0 else 0.0
        for one, other in (
            (last.friction, before.friction),
            (last.measures.contact_area_corrected, before.measures.contact_area_corrected),
        )
    )
    calls, seconds = (sum(getattr(point, name) for point in points) for name in ("operator_calls", "seconds"))
    return replace(last, errors=last.errors.with_rounds(friction, area), operator_calls=calls, seconds=seconds)


ROUNDING = 1e-9  # accuracy: relative rounding of wavelengths at the limits of octaves


def branch_powers(setup: Setup, contact: Contact, velocity: Vector) -> Array:
    """Return the power [W] that waves of each octave lose in each branch, shape (branches, octaves); collective.

    The first octave is from the longer side of the box to half of it. The box must be periodic, so that waves are
    independent.
    """
    fft, prony, grid, half_space = setup.fft, setup.prony, setup.grid, setup.half_space
    spectrum, speed, longest = fft.forward(contact.u), setup.in_units(velocity), max(grid.size)
    powers = np.zeros((prony.moduli.size, count_octaves(setup)))
    for rows in deal(fft.my, PARTS):
        omega = np.abs(half_space.frequencies(fft, speed, rows))
        compliance = half_space.symbol(fft, rows)
        waves = fft.multiplicity * np.abs(spectrum[rows]) ** 2
        waves = np.divide(waves, compliance, out=np.zeros_like(waves), where=compliance > 0.0)
        q = np.hypot(*wavenumbers(fft, grid.size, rows))
        if half_space.factors is not None:
            waves *= half_space.factors(q * setup.units.length)[1]
        octave = np.floor(np.log2(np.maximum(q * longest / (2 * np.pi), 1.0) * (1 + ROUNDING))).astype(np.int64)
        for branch, modulus, tau in zip(powers, prony.moduli, prony.relaxation_times, strict=True):
            loss = waves * omega * modulus * omega * tau / (1.0 + (omega * tau) ** 2)
            branch += np.bincount(octave.ravel(), loss.ravel(), branch.size)
    unit = setup.units.pressure * setup.units.height * grid.lx * grid.ly / (grid.nx * grid.ny) ** 2
    return np.array(setup.slab.sum(*powers.ravel())).reshape(powers.shape) * unit


def count_octaves(setup: Setup) -> int:
    """Return the number of octaves of wavelengths from the longer side of the box to the shortest waves of the grid."""
    cells = max(setup.grid.size) / min(setup.grid.dx, setup.grid.dy)  # along the longer side, of the smaller length
    return 2 + int(np.log2(cells * (1 + ROUNDING)))


def branch_maps(setup: Setup, contact: Contact, velocity: Vector, out: Array) -> Iterator[Array]:
    """Yield the map h_k of each branch in steady sliding at a velocity [m/s], each in `out`. Collective."""
    fft, half_space, speed = setup.fft, setup.half_space, setup.in_units(velocity)
    if half_space.free:
        for k in range(setup.prony.moduli.size):
            yield half_space.branch_operator(fft, speed, setup.prony, k).apply(contact.p, out)
        return
    u = fft.forward(contact.u).copy()
    for modulus, tau in zip(setup.prony.moduli, setup.prony.relaxation_times, strict=True):
        moduli = half_space.sliding_moduli(fft, speed, Prony(0.0, np.array([modulus]), np.array([tau])))
        for rows in deal(fft.my, PARTS):
            np.multiply(moduli(rows), u[rows], out=fft.spectrum[rows])
        yield fft.backward(fft.spectrum, out)
