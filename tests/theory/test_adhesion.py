"""Elastic adhesion against printed numbers, and each theory against its neighbours."""

import numpy as np
import pytest
from closed_forms import adhesion, viscoelastic_adhesion
from numpy.testing import assert_allclose
from rubbers import TWELVE_DECADES
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

from parcontact.theory import hertz

RADIUS, WORK, MODULUS = 2e-3, 0.05, 4e6  # m, J/m^2, Pa
SPHERE = (RADIUS, WORK, MODULUS)
UNLOADED = (9 * np.pi * WORK * RADIUS**2 / (2 * MODULUS)) ** (1 / 3)


def test_sphere_at_its_limits() -> None:
    """Pull-off under a load at 0.62996 a0, end under approach control at a0/36^(1/3), no force at a0; 5 digits."""
    assert_allclose(adhesion.sphere_force(UNLOADED, *SPHERE), 0, atol=1e-12 * WORK * RADIUS)
    lowest = minimize_scalar(lambda a: adhesion.sphere_force(a * UNLOADED, *SPHERE), bounds=(0.1, 1))
    assert_allclose(lowest.fun, adhesion.sphere_pull_off(RADIUS, WORK), rtol=1e-9)
    assert_allclose(lowest.x, 0.62996, rtol=1e-5)
    last = minimize_scalar(lambda a: 1e6 * adhesion.sphere_approach(a * UNLOADED, *SPHERE), bounds=(0.01, 1))
    assert_allclose(last.x, 36 ** (-1 / 3), rtol=1e-5)
    assert_allclose(adhesion.sphere_force(last.x * UNLOADED, *SPHERE), -5 / 6 * np.pi * WORK * RADIUS, rtol=1e-3)


def test_sphere_radius_inverts_its_force() -> None:
    radii = UNLOADED * np.array([0.63, 0.8, 1.0, 2.0, 5.0])
    assert_allclose(adhesion.sphere_contact_radius(adhesion.sphere_force(radii, *SPHERE), *SPHERE), radii, rtol=1e-6)


def test_sphere_without_adhesion_is_hertz() -> None:
    force = hertz.force(1e-5, RADIUS, MODULUS / 4)
    a = hertz.contact_radius(force, RADIUS, MODULUS / 4)
    assert_allclose(adhesion.sphere_force(a, RADIUS, 0.0, MODULUS), force, rtol=1e-12)
    assert_allclose(adhesion.sphere_approach(a, RADIUS, 0.0, MODULUS), 1e-5, rtol=1e-12)
    assert_allclose(adhesion.sphere_contact_radius(force, RADIUS, 0.0, MODULUS), a, rtol=1e-12)


def test_sphere_work_is_griffiths() -> None:
    """Along the equilibria, `P dd` is the elastic energy at fixed contact, K^2 of the edge apart: the rise of the
    elastic energy less w per area, with the energy of a Hertzian contact and a punch,
    U = (E* a^5/R^2)(8/15) - (4/3) a^2 T/R + T^2/(4 E* a) for the punch's force T."""

    def elastic(a: float) -> float:
        punch = np.sqrt(8 * np.pi * MODULUS * WORK * a**3)
        hertzian = 8 / 15 * MODULUS * a**5 / RADIUS**2
        return float(hertzian - 2 / 3 * a**2 * punch / RADIUS + punch**2 / (4 * MODULUS * a))

    first, last = UNLOADED, 1.7 * UNLOADED

    def power(a: float) -> float:
        step = 1e-6 * a
        rate = adhesion.sphere_approach(a + step, *SPHERE) - adhesion.sphere_approach(a - step, *SPHERE)
        return float(adhesion.sphere_force(a, *SPHERE) * rate / (2 * step))

    work = quad(power, first, last)[0]
    gain = WORK * np.pi * (last**2 - first**2)
    assert_allclose(work, elastic(last) - elastic(first) - gain, rtol=1e-7)


def test_cylinder_and_punch() -> None:
    """The lowest force of a cylinder, to 6 printed digits; a punch is a sphere of infinite radius."""
    lowest = minimize_scalar(lambda a: adhesion.cylinder_force(1e-3 * a, *SPHERE), bounds=(0, 1)).fun
    assert_allclose(lowest, adhesion.cylinder_pull_off(*SPHERE), rtol=1e-9)
    assert_allclose(lowest / np.cbrt(MODULUS * WORK**2 * RADIUS), -1.74367, rtol=3e-6)
    punch = adhesion.punch_pull_off(1e-3, WORK, MODULUS)
    assert_allclose(adhesion.sphere_force(1e-3, np.inf, WORK, MODULUS), punch, rtol=1e-14)


@pytest.mark.parametrize(("parameter", "pull_off"), [(0.2, -1.88047), (1, -1.60073), (5, -1.50635)])
def test_maugis_pull_off(parameter: float, pull_off: float) -> None:
    assert_allclose(adhesion.maugis_pull_off(parameter), pull_off, rtol=4e-6)


def test_maugis_between_dmt_and_jkr() -> None:
    """The pull-off goes from -2 to -1.5 monotonically; at lambda 0.001 and 50 it is there but for 1e-3 and 1e-4."""
    forces = [adhesion.maugis_pull_off(parameter) for parameter in np.geomspace(1e-3, 50, 15)]
    assert np.all(np.diff(forces) > 0)
    assert_allclose(forces[0], -2, rtol=1e-3)
    assert_allclose(forces[-1], -1.5, rtol=1e-4)


def test_maugis_tends_to_jkr() -> None:
    """The curve around the pull-off: the zone c - a is O(lambda^-2), and so is what is left."""
    stiffness = 4 / 3 * MODULUS
    length = np.cbrt(np.pi * WORK * RADIUS**2 / stiffness)
    errors = []
    for parameter in (30.0, 300.0):
        found = adhesion.maugis_sphere(parameter, 1 + np.geomspace(0.3, 2, 9) / parameter**2)
        a = found.contact_radius * length
        assert a[0] > a[-1]
        force = adhesion.sphere_force(a, *SPHERE) / (np.pi * WORK * RADIUS)
        approach = adhesion.sphere_approach(a, *SPHERE) / (length**2 / RADIUS)
        errors.append(max(np.abs(found.force - force).max(), np.abs(found.approach - approach).max()))
    assert errors[0] < 0.03
    assert errors[1] < errors[0] / 50


# -- a wave ----------------------------------------------------------------------------------------------------------


def test_wave() -> None:
    """alpha = 0.3, to the digits printed: pull-off, jump to full contact, and the contact without load."""
    limits = adhesion.wave_limits(0.3)
    assert_allclose(limits.pull_off, -0.09594, rtol=5e-5)
    assert_allclose(limits.pull_off_fraction / 2, 0.05857, rtol=5e-5)
    assert_allclose(limits.jump, 0.3877, rtol=2e-4)
    unloaded = brentq(lambda f: adhesion.wave_pressure(f, 0.3), limits.pull_off_fraction, limits.jump_fraction)
    assert_allclose(unloaded, 0.3092, rtol=2e-4)


def test_wave_without_load() -> None:
    """Full contact without load from alpha = 0.56988: the jump is then at no pressure."""
    assert_allclose(adhesion.wave_limits(0.56988).jump, 0, atol=2e-5)
    with pytest.raises(ValueError, match="stable"):
        adhesion.wave_limits(1.07)


def test_short_contacts_of_a_wave_are_cylinders() -> None:
    """2a/lambda = 0.002: the next terms are of the order of psi^2."""
    amplitude, wavelength = 1e-5, 1e-2
    radius = (wavelength / (2 * np.pi)) ** 2 / amplitude
    alpha = np.sqrt(2 * WORK * wavelength / (MODULUS * (np.pi * amplitude) ** 2))
    pressure = np.pi * MODULUS * amplitude / wavelength * adhesion.wave_pressure(2e-3, alpha)
    cylinder = adhesion.cylinder_force(1e-3 * wavelength, radius, WORK, MODULUS)
    assert_allclose(pressure * wavelength, cylinder, rtol=2e-5)


# -- the steady crack, against printed numbers and their limits -------------------------------------------------------

RATIO = 10.0
SOLID = (1.0, [RATIO - 1], [1.0])  # creeps with tau_c = k tau = 10 s


@pytest.mark.parametrize(("velocity", "opening", "closing"), [(0.1, 1.1981, 0.8175), (10.0, 4.5272, 0.2001)])
def test_steady_crack(velocity: float, opening: float, closing: float) -> None:
    """V tau_c/c0 = `velocity`; to the digits printed."""
    assert_allclose(viscoelastic_adhesion.opening_crack(velocity / RATIO, *SOLID), opening, rtol=2e-5)
    assert_allclose(viscoelastic_adhesion.closing_crack(velocity / RATIO, *SOLID), closing, rtol=3e-4)


@pytest.mark.parametrize("crack", [viscoelastic_adhesion.opening_crack, viscoelastic_adhesion.closing_crack])
def test_crack_at_its_limits(crack: object) -> None:
    """Slow: 1, and away from it like V ln V; fast: k or 1/k; no relaxation: 1 at any velocity."""
    assert callable(crack)
    slow = crack(1e-6, *SOLID) - 1
    assert 1e-6 < abs(slow) < 1e-4
    limit = RATIO if slow > 0 else 1 / RATIO
    assert_allclose(crack(1e9, *SOLID), limit, rtol=1e-6)
    assert_allclose(crack(1.0, 1.0, [1e-9], [1.0]), 1, rtol=2e-9)


def test_first_loss_is_the_same_opening_and_closing() -> None:
    """A slow cycle loses as much when it opens as when it closes: both depart from 1 by int (1 - e) F' dx."""
    opening = viscoelastic_adhesion.opening_crack(1e-6, *SOLID) - 1
    closing = viscoelastic_adhesion.closing_crack(1e-6, *SOLID) - 1
    assert_allclose(opening, -closing, rtol=1e-4)


def test_strength_rises_with_velocity() -> None:
    """Also of twelve branches, from 1 to k, between that of the slowest branch alone and the body's ratio."""
    velocities = np.geomspace(1e-8, 1e10, 10)
    opening = [viscoelastic_adhesion.opening_crack(velocity, *TWELVE_DECADES) for velocity in velocities]
    closing = [viscoelastic_adhesion.closing_crack(velocity, *TWELVE_DECADES) for velocity in velocities]
    assert np.all(np.diff(opening) > 0)
    assert np.all(np.diff(closing) < 0)
    assert 1 <= opening[0] < opening[-1] <= 1 + TWELVE_DECADES.moduli.sum() / TWELVE_DECADES.modulus_inf


def test_a_liquid_has_no_crack_at_rest() -> None:
    with pytest.raises(ValueError, match="must be positive"):
        viscoelastic_adhesion.opening_crack(1.0, 0.0, [1.0], [1.0])
