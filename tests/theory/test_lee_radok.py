"""The sphere on a viscoelastic body against tables, quadrature and elastic limits."""

from itertools import pairwise

import numpy as np
import pytest
from closed_forms import step_responses
from numpy.testing import assert_allclose
from rubbers import TWELVE_DECADES, ZENER, relaxation
from scipy.integrate import quad

from parcontact.physics.prony import Prony
from parcontact.theory import hertz

FORCE, RADIUS, CREEP_TIME = 0.15, 1e-2, 1e-2
ELASTIC = Prony(2e6, np.array([]), np.array([]))


@pytest.mark.parametrize("material", [ZENER, TWELVE_DECADES, Prony(0.0, ZENER.moduli, ZENER.relaxation_times)])
@pytest.mark.parametrize("rise_time", [1e-5, 1e-3, 1.0])
def test_triangle_by_quadrature(material: Prony, rise_time: float) -> None:
    """The condition on the earlier time and the integral for the force, with a^2 = R d on the way up."""
    case = (50e-6, rise_time, RADIUS, *material)
    lift_off = hertz.triangle_lift_off_time(rise_time, *material)
    for t in (0.3 * rise_time, 0.5 * (rise_time + lift_off), 0.1 * rise_time + 0.9 * lift_off):
        earlier = float(step_responses.triangle_contact_radius(t, *case)) ** 2 / RADIUS / 50e-6 * rise_time
        if t > rise_time:
            down, up = history(material, t, rise_time, t, 0), history(material, t, earlier, rise_time, 0)
            assert_allclose(up, down, rtol=1e-9)
        rate = 8 / RADIUS * (RADIUS * 50e-6 / rise_time) ** 1.5
        force = rate * history(material, t, 0, earlier, 0.5)
        assert_allclose(hertz.triangle_force(t, *case), force, rtol=1e-7)  # of the rule at the square root


def history(material: Prony, t: float, start: float, end: float, power: float) -> float:
    """The integral of G(t - s) s^power from start to end, piece by piece over every half decade of age."""

    def integrand(s: float) -> float:
        return float(relaxation(t - s, *material) * s**power)

    cuts = [float(t - age) for age in np.geomspace(1e3, 1e-10, 27)]
    stops = [start, *(cut for cut in cuts if start < cut < end), end]
    return float(sum(quad(integrand, *piece, epsabs=0, epsrel=1e-11)[0] for piece in pairwise(stops)))


def test_triangle_ends_at_lift_off() -> None:
    """Contact is lost below the original surface; from then on there is no force, and never a negative one."""
    case = (50e-6, 1e-3, RADIUS, *ZENER)
    time = hertz.triangle_lift_off_time(1e-3, *ZENER)
    t = np.linspace(0, 3e-3, 301)
    forces, radii = hertz.triangle_force(t, *case), step_responses.triangle_contact_radius(t, *case)
    assert np.all(forces >= 0)
    assert np.all((forces > 0) == ((t > 0) & (t < time)))
    assert np.all((radii > 0) == ((t > 0) & (t < time)))


def test_elastic_body_is_hertz() -> None:
    r, t = np.linspace(0, 1e-3, 9), np.array([0.0, 1.0, 1e5])
    radii = step_responses.load_step_contact_radius(t, FORCE, RADIUS, *ELASTIC)
    assert_allclose(radii, hertz.contact_radius(FORCE, RADIUS, 2e6), rtol=1e-14)
    pressures = step_responses.load_step_pressure(r, t[:, None], FORCE, RADIUS, *ELASTIC)
    assert_allclose(pressures, np.tile(hertz.pressure(r, FORCE, RADIUS, 2e6), (3, 1)), rtol=1e-12)
    assert_allclose(hertz.triangle_lift_off_time(1e-3, *ELASTIC), 2e-3, rtol=1e-11)
    t = np.array([0.5e-3, 1e-3, 1.5e-3])
    depths = 50e-6 * np.array([0.5, 1, 0.5])
    forces = hertz.triangle_force(t, 50e-6, 1e-3, RADIUS, *ELASTIC)
    assert_allclose(forces, hertz.force(depths, RADIUS, 2e6), rtol=1e-9)
