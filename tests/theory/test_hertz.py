"""The elastic sphere against a table, quadrature and its own limits."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.special import roots_legendre

from parcontact.theory import hertz

SPHERE = (0.15, 1e-2, 2.75e6)  # force (N), radius (m), shear modulus (Pa)


@pytest.mark.parametrize(
    ("force", "modulus", "radius", "approach", "peak", "mean"),
    [
        (0.15, 2.75e6, 0.000467649, 2.18696e-05, 327486, 218324),
        (0.15, 2.75e5, 0.00100752, 0.000101509, 70554.7, 47036.5),
        (0.1584, 2.75e6, 0.00047622, 2.26786e-05, 333488, 222326),
        (0.1584, 2.75e5, 0.00102599, 0.000105265, 71847.9, 47898.6),
        (1.0, 2.75e6, 0.000880149, 7.74662e-05, 616352, 410902),
        (1.0, 2.75e5, 0.00189622, 0.000359566, 132789, 88526),
        (0.01, 2.75e6, 0.000189622, 3.59566e-06, 132789, 88526),
        (0.01, 2.75e5, 0.000408529, 1.66896e-05, 28608.5, 19072.4),
    ],
)
def test_table(force: float, modulus: float, radius: float, approach: float, peak: float, mean: float) -> None:
    """Radius of the sphere 10 mm, incompressible; printed to 5 or 6 digits."""
    sphere = (force, 1e-2, modulus)
    a = hertz.contact_radius(*sphere)
    assert_allclose(a, radius, rtol=5e-6)
    assert_allclose(hertz.approach(*sphere), approach, rtol=5e-6)
    assert_allclose(hertz.peak_pressure(*sphere), peak, rtol=5e-6)
    assert_allclose(force / (np.pi * a**2), mean, rtol=6e-6)


def test_pressure_carries_the_force() -> None:
    a = float(hertz.contact_radius(*SPHERE))
    carried = quad(
        lambda angle: 2 * np.pi * a**2 * np.sin(angle) * np.cos(angle) * hertz.pressure(a * np.sin(angle), *SPHERE),
        0,
        np.pi / 2,
    )
    assert_allclose(carried[0], 0.15, rtol=1e-12)
    assert hertz.pressure(1.01 * a, *SPHERE) == 0
    assert_allclose(hertz.pressure(0.0, *SPHERE), hertz.peak_pressure(*SPHERE), rtol=1e-15)


def test_force_and_approach_are_inverse() -> None:
    for poisson in (0.0, 0.3, 0.5):
        assert_allclose(hertz.force(hertz.approach(*SPHERE, poisson), *SPHERE[1:], poisson), 0.15, rtol=1e-14)
    assert hertz.force(-1e-6, *SPHERE[1:]) == 0


def test_displacement() -> None:
    """The parabola in the contact, below it at the edge by d/2, and a point force's (1 - nu) W/(2 pi G r) far away."""
    a, d = hertz.contact_radius(*SPHERE), hertz.approach(*SPHERE)
    r = a * np.linspace(0, 1, 11)
    assert_allclose(hertz.displacement(r, *SPHERE), d - r**2 / (2 * 1e-2), rtol=1e-14)
    assert_allclose(hertz.displacement(a * (1 + 1e-12), *SPHERE), d / 2, rtol=1e-9)
    far = 1e3 * a
    assert_allclose(hertz.displacement(far, *SPHERE), 0.15 / (4 * np.pi * 2.75e6 * far), rtol=1e-6)  # next: (a/r)^2/5


def test_displacement_is_that_of_the_pressure() -> None:
    """Boussinesq's integral over rings around a point of the surface, outside the contact and inside."""
    a, g = float(hertz.contact_radius(*SPHERE)), SPHERE[2]
    nodes, weights = roots_legendre(400)
    angle = np.pi * (1 + nodes)
    for distance in (0.3 * a, 2.0 * a):
        far = distance + a
        rho, share = far * (1 + nodes[:, None]) / 2, far * weights[:, None] / 2
        r = np.sqrt(distance**2 + rho**2 - 2 * distance * rho * np.cos(angle))
        integral = np.sum(share * np.pi * weights * hertz.pressure(r, *SPHERE)) / (4 * np.pi * g)
        assert_allclose(integral, hertz.displacement(distance, *SPHERE), rtol=1e-4)  # of the rule at the contact's edge


def test_only_modulus_over_one_minus_poisson_matters() -> None:
    """3.85 MPa at nu = 0.3 is 2.75 MPa at nu = 1/2."""
    assert_allclose(hertz.contact_modulus(3.85e6, 0.3), hertz.contact_modulus(2.75e6), rtol=1e-15)
    assert_allclose(hertz.pressure(1e-4, 0.15, 1e-2, 3.85e6, 0.3), hertz.pressure(1e-4, *SPHERE), rtol=1e-14)


def test_no_load() -> None:
    assert hertz.contact_radius(0.0, 1e-2, 1e6) == hertz.pressure(0.0, 0.0, 1e-2, 1e6) == 0
    assert_allclose(hertz.displacement(np.array([0.0, 1e-3]), 0.0, 1e-2, 1e6), 0)
