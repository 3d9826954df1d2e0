"""A guess of the contact area before any solve, for the mesh that `points: auto` chooses.

Persson's theory for frictionless contact of an elastic body (B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840):
under a mean pressure p on a surface of rms slope h' the share in contact is

    A = erf(sqrt(2) p/(E h')),      E = 2 |G|/(1 - nu),

here with the modulus G at FEW times the frequency with which the shortest wave passes. Sliding surfaces have the
larger area 1 - (1 - A)^MORE. The phase of the modulus is taken at EDGES times this frequency. If the loss angle is
still proportional to the frequency at FINEST times this frequency, sliding is slow, and edges lose power in waves
shorter than the cells (`accuracy.sources`).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from typing import Any, Protocol

from ..job.checks.cells import Guess
from ..job.sections.geometry import Rough, Spectral
from ..job.sections.materials import AnyMaterial
from ..job.sections.stages import Initial, Stage, Steady

UNKNOWN, USUAL_PHASE = 0.1, 0.25  # accuracy: share in contact and phase if slopes or loads are unknown
LEAST, MOST = 0.005, 0.99  # accuracy: limits on the share for which the laws of the mesh hold
MORE = 1.42  # fitted: power of the open share in sliding (50 steady states, 17 %)
FEW, EDGES, FINEST = 0.5, 4.0, 16.0  # accuracy: frequencies of spots, edges and finest waves over the shortest wave's
SLOWNESS = 1.5  # accuracy: power of the slowness
NODES = 400  # accuracy: nodes of integrals over the spectrum; their error is 1e-4


class Loaded(Protocol):
    """Sections of a job that determine the contact area."""

    surface: tuple[Any, ...]
    material: AnyMaterial
    history: tuple[Stage, ...]
    initial: Initial
    steady: Steady | None


def guesses(job: Loaded, wave: float, area: float) -> list[Guess]:
    """Return guesses for each load and speed of a job with this shortest wave [m] and area of the box [m^2]; slow
    sliding only occurs in friction curves."""
    from ..effects.relaxation import relaxation_of  # only a mesh that is chosen needs it

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
    """Return the rms slope of a rough surface in a large box."""
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
