"""Branch maps of a body in a steady state, and the power lost in each branch.

A wave u^ loses the power `|u^|^2/A |w| G_k''(|w|)` in branch k, with A its displacement over its pressure for a
modulus of 1 and w the frequency with which it passes a point.
"""

from collections.abc import Iterator

import numpy as np

from ..parallel.slab import Array, deal
from ..physics.convolution import PARTS, wavenumbers
from ..physics.prony import Prony
from ..scene import Setup
from ..solve.nonsymmetric.judge import SteadyContact

ROUNDING = 1e-9  # accuracy: relative rounding of wavelengths at the limits of octaves

Vector = tuple[float, float]


def branch_powers(setup: Setup, contact: SteadyContact, velocity: Vector) -> Array:
    """Return the power [W] lost in each branch to waves of each octave, shape (branches, octaves); collective.

    The first octave is from the longer side of the box to half of it. Scenes must be periodic, so that waves are
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


def branch_maps(setup: Setup, contact: SteadyContact, velocity: Vector, out: Array) -> Iterator[Array]:
    """Yield the map h_k of each branch in a steady state at a velocity [m/s], each in `out`; collective."""
    fft, half_space, speed = setup.fft, setup.half_space, setup.in_units(velocity)
    if half_space.free:
        for k in range(setup.prony.moduli.size):
            yield half_space.branch_operator(fft, speed, setup.prony, k).apply(contact.p, out)
        return
    u = fft.forward(contact.u).copy()
    for modulus, tau in zip(setup.prony.moduli, setup.prony.relaxation_times, strict=True):
        own = Prony(0.0, np.array([modulus]), np.array([tau]))
        for rows in deal(fft.my, PARTS):
            np.multiply(half_space.sliding_modulus(fft, speed, own, rows), u[rows], out=fft.spectrum[rows])
        yield fft.backward(fft.spectrum, out)
