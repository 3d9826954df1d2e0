"""A layer on a rigid base: the ratio of the displacement of its surface to that of a half space.

A layer of shear modulus 1, Poisson's ratio nu and thickness d moves under a pressure wave of the wavenumber q by

    u^(q) = (1 - nu)/q S(q d) p^(q).

If it is bonded to the base, with kappa = 3 - 4 nu,

    S(x) = (kappa sinh 2x - 2x) / (kappa cosh 2x + 2x^2 + 5 - 12 nu + 8 nu^2),

and on a smooth base, along which it slides freely,

    S(x) = (cosh 2x - 1) / (sinh 2x + 2x).

A uniform pressure p strains it in one direction only, and moves it by `p d (1 - 2 nu)/(2 (1 - nu))`: an
incompressible layer does not move. S tends to 1 for a thick layer. Sources: I. N. Sneddon, Fourier Transforms
(1951); for the bonded layer G. Carbone and L. Mangialardi, J. Mech. Phys. Solids 56 (2008) 684.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from ..parallel.slab import Array

Base = Literal["bonded", "smooth"]
THICK = 22.0  # accuracy: x above which S(x) - 1 is below rounding
FAR = 50.0  # accuracy: distance over thickness beyond which displacements are below rounding
KNOTS_PER_THICKNESS = 16  # accuracy: knots of the spline through the correction; its error is below 1e-6
NODES = 900  # accuracy: nodes of the integral over wavenumbers, 5 per oscillation of the Bessel function
SOFTEST_BETWEEN, SOFTEST_TRIED = (1e-3, 1e2), 2000  # tuning: range and number of q d that are searched
HARDLY_STIFFER = 0.8  # tuning: stiffness ratio of softest to longest waves above which LongWaves are not used
SERIES_BELOW = 1.0  # accuracy: y below which sinh(y) - y is a series, exact to rounding


@dataclass(frozen=True)
class LongWaves:
    """Compliance `c0 + c2 q^2` that corrects a preconditioner in which long waves on a layer are as soft as its softest
    wave, in a box of `size`; lengths have one unit."""

    c0: float
    c2: float
    thickness: float
    size: tuple[float, float]


@dataclass(frozen=True)
class Layer:
    """A layer of shear modulus 1 and `thickness` [any unit of length] on a rigid base."""

    thickness: float
    base: Base = "bonded"
    poisson: float = 0.5

    def compliance_ratio(self, q: Array) -> Array:
        """Return S(q d) for wavenumbers q > 0; 0 for q = 0."""
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
        """Displacement over a uniform pressure."""
        return self.thickness * (1.0 - 2.0 * self.poisson) / (2.0 * (1.0 - self.poisson))

    @cached_property
    def softest_wave(self) -> tuple[float, float]:
        """Wavenumber at which the layer is softest, and pressure over displacement there.

        A compressible layer is softest for the longest waves; an incompressible bonded one for waves about four
        times as long as its thickness, as longer ones must push it along its base.
        """
        q = np.geomspace(*SOFTEST_BETWEEN, SOFTEST_TRIED) / self.thickness
        stiffness = q / ((1.0 - self.poisson) * self.compliance_ratio(q))
        softest = int(np.argmin(stiffness))
        return float(q[softest]), float(stiffness[softest])

    def long_waves(self, size: tuple[float, float]) -> LongWaves | None:
        """Return the compliance by which longer waves in a box are stiffer than the softest one; None if they are
        hardly stiffer, or do not exist.

        The compliance of long waves on a bonded layer is `mean_compliance` plus, to second order in q, `d^3 ((3 - 4
        nu)/(6 (1 - nu)) - (1 - 2 nu)/(2 (1 - nu)^2))`, which is d^3/3 for an incompressible one.
        """
        nu, softest, stiffness = self.poisson, *self.softest_wave
        least = stiffness * self.mean_compliance
        if self.base == "smooth" or least > HARDLY_STIFFER or softest * max(size) < 2 * np.pi:
            return None
        second = (3.0 - 4.0 * nu) / (6.0 * (1.0 - nu)) - (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu) ** 2)
        c0, c2 = self.mean_compliance / (1.0 - least), self.thickness**3 * second / (1.0 - least) ** 2
        return LongWaves(c0, c2, self.thickness, size)

    def coefficients(self, x: Array, y: Array, dx: float, dy: float, of_half_space: Array) -> Array:
        """Return the displacements at distances (x, y) from a `dx x dy` cell under unit pressure.

        `of_half_space` has the displacements of a half space (Love's). The difference is smooth on the scale of the
        thickness: `(1 - nu)/(2 pi) int (S(q d) - 1) J0(q r) dq`, averaged over the cell by Simpson's rule. Beyond
        FAR it is cut off.
        """
        correction = self._correction()
        mean = np.zeros(np.broadcast_shapes(x.shape, y.shape))
        for i, weight_x in zip((-0.5, 0.0, 0.5), (1 / 6, 2 / 3, 1 / 6), strict=True):
            for j, weight_y in zip((-0.5, 0.0, 0.5), (1 / 6, 2 / 3, 1 / 6), strict=True):
                r = np.hypot(x + i * dx, y + j * dy)
                mean += weight_x * weight_y * correction(np.minimum(r, FAR * self.thickness))
        far = np.hypot(x, y) > (FAR - 1.0) * self.thickness
        return np.where(far, 0.0, of_half_space + dx * dy * mean)

    def _correction(self) -> Callable[[Array], Array]:
        """Return the difference to the displacement of a half space under a unit force, as a function of
        the distance."""
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
