"""A rigid surface wavy in two directions on an elastic half-space (Johnson, Greenwood and Higginson).

The surface is h(x, y) = Delta cos(2 pi x/lambda) cos(2 pi y/lambda), two crests per square lambda x lambda; p is the
mean pressure. Contact is complete at p* = sqrt(2) pi E* Delta/lambda, E* = 4 G. Below there is no closed form,
but for high loads:

    f -> 1 - 3/(2 pi) (1 - p/p*)         pressurised penny-shaped cracks at the lowest points

Source: K. L. Johnson, J. A. Greenwood, J. G. Higginson, Int. J. Mech. Sci. 27 (1985) 383. Arguments are in SI units
and broadcast.
"""

from typing import NamedTuple

import numpy as np

from parcontact.theory.wavy import Array, Values


class Reference(NamedTuple):
    """A numerical solution, dimensionless: loads and peak pressures over p*, mean gaps over Delta."""

    load: float
    contact_fraction: float
    contact_fraction_error: float
    mean_gap: float
    peak_pressure: float


# Boundary elements, 256 x 256 points per wave, areas corrected for the size of a cell; `contact_fraction_error` is the
# spread over grids. Mean gaps and peak pressures are converged to 1e-4: compare with these rather than with areas.
REFERENCE = (
    Reference(0.005, 0.02253, 0.002, 0.88015, 0.33492),
    Reference(0.01, 0.03609, 0.0006, 0.81829, 0.42072),
    Reference(0.02, 0.05853, 0.001, 0.72883, 0.52767),
    Reference(0.05, 0.1136, 0.001, 0.55637, 0.7094),
    Reference(0.2, 0.3446, 0.009, 0.20465, 1.0955),
    Reference(0.4, 0.6196, 0.005, 0.076908, 1.3638),
    Reference(0.5, 0.7046, 0.002, 0.045079, 1.4793),
    Reference(0.6, 0.7761, 0.002, 0.02417, 1.5892),
    Reference(0.8, 0.8973, 0.001, 0.0038462, 1.7983),
    Reference(0.9, 0.9505, 0.0006, 0.00065146, 1.8997),
    Reference(0.95, 0.9756, 0.0008, 0.000113, 1.95),
)


def full_contact_pressure(amplitude: Values, wavelength: Values, shear_modulus: Values) -> Array:
    """p* = sqrt(2) pi E* Delta/lambda in Pa, the mean pressure at which contact becomes complete."""
    return np.asarray(np.sqrt(2) * np.pi * 4 * shear_modulus * amplitude / wavelength)


def high_load_contact_fraction(
    mean_pressure: Values, amplitude: Values, wavelength: Values, shear_modulus: Values
) -> Array:
    """The asymptote 1 - 3/(2 pi) (1 - p/p*) of the contact fraction for p -> p* from below; 1 above."""
    load = mean_pressure / full_contact_pressure(amplitude, wavelength, shear_modulus)
    return 1 - 3 / (2 * np.pi) * np.maximum(1 - load, 0)


def full_contact_pressure_field(
    x: Values, y: Values, mean_pressure: Values, amplitude: Values, wavelength: Values, shear_modulus: Values
) -> Array:
    """p + p* cos(2 pi x/lambda) cos(2 pi y/lambda) in Pa, the exact pressure wherever the mean pressure p >= p*."""
    k = 2 * np.pi / wavelength
    full = full_contact_pressure(amplitude, wavelength, shear_modulus)
    return mean_pressure + full * np.cos(k * x) * np.cos(k * y)
