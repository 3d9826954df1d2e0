"""Amplitude of the shear strain that softens each wave of a rough contact, in steady sliding.

A wave of the surface displacement with the amplitude A and the wavenumber q strains an incompressible half space at
the depth z by a tensor e that turns with the constant magnitude

    gamma(z) = sqrt(2 e:e) = 2 q A (q z) exp(-q z).                                                               (1)

The strain is local: it counts where power is dissipated. With the density of the power d(x, z) of a map of displacements

    S(z) = <d gamma^2>/<d>/R(z),                                                                                  (2)

where R is the same ratio `<d gamma^2>/(<d> <gamma^2>)` for waves with the same amplitudes and independent phases: in full
contact S is the sum of (1) over all waves. The strain of a wave is its mean over depth, weighted by its dissipation,

    gamma_q^2 = int 4 s^2 exp(-2 s) S(s/q) ds,                                                                    (3)

which for one wave is 3/8 (q A)^2. The strain of an octave, or of a band, is the mean of (3) over its waves, weighted by
their power.
"""

import math
from collections.abc import Iterator
from itertools import combinations_with_replacement

import numpy as np

from ...parallel.fft import Spectrum
from ...parallel.slab import Array
from ...physics.convolution import wavenumbers
from ...scene import Setup
from .strain_table import Softened

SHALLOW, DEEP = 0.2, 4.0  # accuracy: least depth times the largest wavenumber, largest depth times the smallest
SPACING = 2.5  # accuracy: largest ratio of two depths
FARTHEST, PARTS = 12.0, 240  # accuracy: end and number of the steps of the integral (3)
PER_OCTAVE = 4  # accuracy: wavenumbers per octave at which (3) is evaluated
TINY = 1e-300  # rounding: least square of a strain, for logarithms
Vector = tuple[float, float]


def strains_of(setup: Setup, softened: Softened, u: Array, velocity: Vector) -> tuple[Array, Array]:
    """Return the strain [-] of each octave of `softened` under a surface of this velocity [m/s], and the power of its
    waves, to a common factor; collective. The displacement u is in the run's units.

    An octave without power keeps its strain in `softened`.
    """
    q = np.hypot(*wavenumbers(setup.fft, setup.size))
    spectrum = setup.fft.forward(u) * (setup.units.height / setup.units.length)
    power = _power(setup, q, velocity)
    low, high = _ends(setup)
    count = 2 + int(math.log(DEEP / SHALLOW * high / low) / math.log(SPACING))
    depths = np.geomspace(SHALLOW / high, DEEP / low, count)
    squares = np.array([_square_at(setup, spectrum, power, q, float(z)) for z in depths])
    return _means(setup, softened, power * np.abs(spectrum) ** 2 * setup.fft.multiplicity, q, depths, squares)


def _power(setup: Setup, q: Array, velocity: Vector) -> Array:
    """Return the dissipated power of each wave over the square of its amplitude, to a common factor."""
    speed = setup.in_units(velocity)
    omega = np.abs(setup.half_space.frequencies(setup.fft, speed))
    modulus = setup.half_space.sliding_modulus(setup.fft, speed, setup.prony)
    return np.asarray(q * omega * np.abs(modulus.imag))


def _square_at(setup: Setup, spectrum: Spectrum, power: Array, q: Array, depth: float) -> float:
    """Return S of (2) at a depth; 0 without dissipation."""
    waves = spectrum * (depth * np.exp(-q * depth))  # times components of q: strains
    heavy = waves * np.sqrt(power / np.where(q > 0.0, q, 1.0))
    strain, density = (_squared(setup, one) for one in (waves, heavy))
    sums = setup.slab.sum(float((density * strain).sum()), float(density.sum()), float(strain.sum()))
    if not sums[1] * sums[2] > 0.0:
        return 0.0
    return sums[0] / sums[1] / _of_independent_waves(setup, waves, heavy)


def _squared(setup: Setup, waves: Spectrum) -> Array:
    """Return the map of `2 e:e` for waves in proportion to the displacement; (1) with `z exp(-q z)` times it."""
    fft, out, total = setup.fft, setup.slab.empty(), setup.slab.zeros()
    for weight, symbol in _components(setup):
        np.multiply(waves, symbol, out=fft.spectrum)
        total += weight * fft.backward(fft.spectrum, out) ** 2
    return total


def _components(setup: Setup) -> Iterator[tuple[float, Array]]:
    """Yield the components of the strain: their weights in `2 e:e`, and symbols."""
    qx, qy = wavenumbers(setup.fft, setup.size)
    q = np.hypot(qx, qy)
    flat = [direction for direction, points in ((qx, setup.slab.nx), (qy, setup.slab.ny)) if points > 1]
    yield 2.0, q**2
    for k, one in enumerate(flat):
        yield 4.0, 1j * one * q
        for other in flat[k:]:
            yield (2.0 if other is one else 4.0), one * other + 0.0 * q


def _of_independent_waves(setup: Setup, waves: Spectrum, heavy: Spectrum) -> float:
    """Return R of (2) from fourth moments of waves with independent phases.

    With the vectors E and W of weighted components, whose squares are gamma^2 and d, it is
    `1 + (2 sum_ij <E_i W_j>^2 - sum_k <E^2>_k <W^2>_k)/(<E^2> <W^2>)`, with the waves k.
    """
    counts = setup.fft.multiplicity
    q = np.hypot(*wavenumbers(setup.fft, setup.size))
    vectors = [math.sqrt(weight) * symbol for weight, symbol in _components(setup)]
    both = counts * np.abs(waves) * np.abs(heavy)
    own, other = (8.0 * q**4 * np.abs(one) ** 2 for one in (waves, heavy))
    pairs = list(combinations_with_replacement(vectors, 2))
    products = [float((both * (one * np.conj(two)).real).sum()) for one, two in pairs]
    whole = float((counts * own).sum()), float((counts * other).sum()), float((2.0 * counts * own * other).sum())
    first, second, same, *found = setup.slab.sum(*whole, *products)
    squares = sum((1.0 if one is two else 2.0) * product**2 for (one, two), product in zip(pairs, found, strict=True))
    return 1.0 + (2.0 * squares - same) / (first * second)


def _means(
    setup: Setup, softened: Softened, power: Array, q: Array, depths: Array, squares: Array
) -> tuple[Array, Array]:
    """Return the strain of each octave, the mean of (3) over its waves weighted by `power`, and its power."""
    octave = softened.octave(q)
    low, high = np.log2(_ends(setup))
    places = np.linspace(low, high, 2 + int(PER_OCTAVE * (high - low)))
    known = _over_depth(2.0**places, depths, squares)
    own = np.interp(np.log2(np.maximum(q, 2.0**low)), places, known)
    count = len(softened.strains)
    sums = [np.bincount(octave.ravel(), one.ravel(), count) for one in (power, power * own)]
    weights, weighted = np.array(setup.slab.sum(*np.concatenate(sums))).reshape(2, count)
    kept = np.array(softened.strains)
    found = np.sqrt(np.divide(weighted, weights, out=kept**2, where=weights > 0.0))
    return np.where(found > 0.0, found, kept), weights


def _ends(setup: Setup) -> Vector:
    """Return the smallest and the largest wavenumber of the grid."""
    cells = setup.slab.nx / setup.size[0], setup.slab.ny / setup.size[1]
    return 2.0 * math.pi / max(setup.size), math.pi * math.hypot(*cells)


def _over_depth(q: Array, depths: Array, squares: Array) -> Array:
    """Return the integral (3) for wavenumbers; between depths log S is a cubic spline in log z, above them S grows with
    z^2, and below them it is 0."""
    from scipy.interpolate import CubicSpline  # slow to import, and of use to few

    s = FARTHEST / PARTS * (np.arange(PARTS) + 0.5)
    z = s / q[:, None]
    spline = CubicSpline(np.log(depths), np.log(np.maximum(squares, TINY)))
    found = np.exp(spline(np.log(np.clip(z, depths[0], depths[-1]))))
    found = np.where(z < depths[0], squares[0] * (z / depths[0]) ** 2, np.where(z > depths[-1], 0.0, found))
    return np.asarray((FARTHEST / PARTS) * found @ (4.0 * s**2 * np.exp(-2.0 * s)))
