"""The sphere on a viscoelastic body against tables, quadrature and elastic limits."""

from itertools import pairwise

import numpy as np
import pytest
from closed_forms import step_responses
from numpy.testing import assert_allclose
from rubbers import TWELVE_DECADES, ZENER, relaxation
from scipy.integrate import quad

from parcontact.physics.prony import Prony
from parcontact.theory import hertz, lee_radok

FORCE, RADIUS, CREEP_TIME = 0.15, 1e-2, 1e-2
HERTZ_RADIUS = float(hertz.contact_radius(FORCE, RADIUS, 2.75e6))
MEAN_PRESSURE = FORCE / (np.pi * HERTZ_RADIUS**2)
DISTANCES = np.array([0, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2])
ELASTIC = Prony(2e6, np.array([]), np.array([]))

# t/tau0, a (mm), a/a*, d (um), p/p0 at DISTANCES
LOAD_STEP = [
    (0, 0.467649, 1, 21.8696, [1.5, 1.452, 1.299, 0.9922, 0, 0, 0, 0, 0]),
    (0.01, 0.481211, 1.029001, 23.1564, [1.413, 1.371, 1.236, 0.9689, 0.3428, 0, 0, 0, 0]),
    (0.03, 0.505899, 1.081791, 25.5933, [1.257, 1.224, 1.118, 0.9153, 0.5188, 0, 0, 0, 0]),
    (0.1, 0.574754, 1.229029, 33.0342, [0.8684, 0.8536, 0.8077, 0.7264, 0.615, 0, 0, 0, 0]),
    (0.3, 0.698526, 1.493697, 48.7939, [0.4574, 0.4551, 0.4484, 0.4393, 0.4376, 0.4781, 0, 0, 0]),
    (0.5, 0.774422, 1.65599, 59.9729, [0.3688, 0.3672, 0.3625, 0.3553, 0.3486, 0.3539, 0.4048, 0, 0]),
    (1, 0.881134, 1.884179, 77.6398, [0.3315, 0.3295, 0.3233, 0.3128, 0.2978, 0.2782, 0.2561, 0.2613, 0]),
    (1.5, 0.934979, 1.999319, 87.4186, [0.3256, 0.3234, 0.3169, 0.3058, 0.2895, 0.2672, 0.2377, 0.2006, 0]),
    (3, 0.99224, 2.121763, 98.454, [0.3233, 0.3211, 0.3144, 0.3031, 0.2864, 0.2634, 0.2322, 0.1888, 0.1215]),
    (5, 1.00548, 2.150071, 101.099, [0.3232, 0.321, 0.3143, 0.303, 0.2862, 0.2632, 0.232, 0.1885, 0.1202]),
    (10, 1.00751, 2.154405, 101.507, [0.3232, 0.321, 0.3143, 0.303, 0.2862, 0.2632, 0.232, 0.1885, 0.1201]),
    (20, 1.00752, 2.154435, 101.509, [0.3232, 0.321, 0.3143, 0.303, 0.2862, 0.2632, 0.232, 0.1885, 0.1201]),
]


@pytest.mark.parametrize(("time", "radius", "ratio", "approach", "pressures"), LOAD_STEP)
def test_load_step_table(time: float, radius: float, ratio: float, approach: float, pressures: list[float]) -> None:
    """Radii and approaches printed to 6 digits, pressures to 4 digits and with an error of 1e-4."""
    case = (FORCE, RADIUS, *ZENER)
    a = step_responses.load_step_contact_radius(time * CREEP_TIME, *case)
    assert_allclose(a, 1e-3 * radius, rtol=6e-6)
    assert_allclose(a / HERTZ_RADIUS, ratio, rtol=6e-7)
    assert_allclose(a**2 / RADIUS, 1e-6 * approach, rtol=6e-6)
    computed = step_responses.load_step_pressure(DISTANCES * HERTZ_RADIUS, time * CREEP_TIME, *case) / MEAN_PRESSURE
    assert_allclose(computed, pressures, rtol=5e-4, atol=1e-4)


def carried(time: float, material: Prony) -> float:
    """The force of the load step's pressure, by a rule that is graded towards the edges of its smooth parts."""
    edges = step_responses.load_step_contact_radius(np.array([0, time]), FORCE, RADIUS, *material)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    angle = np.pi / 4 * (1 + nodes)
    force = 0.0
    for inner, outer in ((0.0, edges[0]), (edges[0], edges[1])):
        # r^2 = inner^2 + (outer^2 - inner^2) sin^2 takes the square roots out at both ends
        r = np.sqrt(inner**2 + (outer**2 - inner**2) * np.sin(angle) ** 2)
        share = (outer**2 - inner**2) * np.sin(angle) * np.cos(angle) * np.pi / 4 * weights
        force += 2 * np.pi * np.sum(share * step_responses.load_step_pressure(r, time, FORCE, RADIUS, *material))
    return force


@pytest.mark.parametrize("time", [1e-5, 1e-3, 3e-2, 1.0])
def test_load_step_pressure_carries_the_force(time: float) -> None:
    assert_allclose(carried(time, ZENER), FORCE, rtol=1e-7)


@pytest.mark.parametrize("time", [1e-10, 1e-6, 1e-3, 1e3])
def test_load_step_pressure_carries_the_force_over_twelve_decades(time: float) -> None:
    """The rule of this test resolves the contact's widening over decades less well."""
    assert_allclose(carried(time, TWELVE_DECADES), FORCE, rtol=2e-3)


def test_displacement_step() -> None:
    """50 um held; printed to 6 digits."""
    times = np.array([0, 1e-3, 1.0])
    forces = step_responses.displacement_step_force(times, 50e-6, RADIUS, *ZENER)
    assert_allclose(forces[[0, 2]], [0.518545, 0.0518545], rtol=2e-6)
    assert_allclose(forces, forces[0] * relaxation(times, *ZENER) / 2.75e6, rtol=1e-14)


@pytest.mark.parametrize(
    ("rise_time", "peak_force", "lift_off", "depth"),
    [(1e-4, 0.500399, 0.00019181292, 0.0818708), (1e-3, 0.375215, 0.0015420981, 0.457902)],
)
def test_triangle_table(rise_time: float, peak_force: float, lift_off: float, depth: float) -> None:
    """Up to 50 um and back; printed to 6 and 8 digits."""
    case = (50e-6, rise_time, RADIUS, *ZENER)
    assert_allclose(lee_radok.triangle_force(rise_time, *case), peak_force, rtol=2e-6)
    time = lee_radok.triangle_lift_off_time(rise_time, *ZENER)
    assert_allclose(time, lift_off, rtol=4e-8)
    assert_allclose(2 - time / rise_time, depth, rtol=2e-6)


def test_triangle_samples() -> None:
    """Up to 50 um in 1 ms and back; printed to 6 digits, but the last two at times that are themselves rounded."""
    case = (50e-6, 1e-3, RADIUS, *ZENER)
    forces = lee_radok.triangle_force(np.array([0.5e-3, 1e-3, 1.259e-3]), *case)
    assert_allclose(forces, [0.154568, 0.375215, 0.136800], rtol=2e-5)
    radii = step_responses.triangle_contact_radius(np.array([1.259e-3, 1.51499e-3]), *case)
    assert_allclose(radii, [0.576611e-3, 0.206653e-3], rtol=1e-4)
    assert_allclose(lee_radok.triangle_force(1.51499e-3, *case), 0.00399031, rtol=2e-4)


@pytest.mark.parametrize("material", [ZENER, TWELVE_DECADES, Prony(0.0, ZENER.moduli, ZENER.relaxation_times)])
@pytest.mark.parametrize("rise_time", [1e-5, 1e-3, 1.0])
def test_triangle_by_quadrature(material: Prony, rise_time: float) -> None:
    """The condition on the earlier time and the integral for the force, with a^2 = R d on the way up."""
    case = (50e-6, rise_time, RADIUS, *material)
    lift_off = lee_radok.triangle_lift_off_time(rise_time, *material)
    for t in (0.3 * rise_time, 0.5 * (rise_time + lift_off), 0.1 * rise_time + 0.9 * lift_off):
        earlier = float(step_responses.triangle_contact_radius(t, *case)) ** 2 / RADIUS / 50e-6 * rise_time
        if t > rise_time:
            down, up = history(material, t, rise_time, t, 0), history(material, t, earlier, rise_time, 0)
            assert_allclose(up, down, rtol=1e-9)
        rate = 8 / RADIUS * (RADIUS * 50e-6 / rise_time) ** 1.5
        force = rate * history(material, t, 0, earlier, 0.5)
        assert_allclose(lee_radok.triangle_force(t, *case), force, rtol=1e-7)  # of the rule at the square root


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
    time = lee_radok.triangle_lift_off_time(1e-3, *ZENER)
    t = np.linspace(0, 3e-3, 301)
    forces, radii = lee_radok.triangle_force(t, *case), step_responses.triangle_contact_radius(t, *case)
    assert np.all(forces >= 0)
    assert np.all((forces > 0) == ((t > 0) & (t < time)))
    assert np.all((radii > 0) == ((t > 0) & (t < time)))


def test_elastic_body_is_hertz() -> None:
    r, t = np.linspace(0, 1e-3, 9), np.array([0.0, 1.0, 1e5])
    radii = step_responses.load_step_contact_radius(t, FORCE, RADIUS, *ELASTIC)
    assert_allclose(radii, hertz.contact_radius(FORCE, RADIUS, 2e6), rtol=1e-14)
    pressures = step_responses.load_step_pressure(r, t[:, None], FORCE, RADIUS, *ELASTIC)
    assert_allclose(pressures, np.tile(hertz.pressure(r, FORCE, RADIUS, 2e6), (3, 1)), rtol=1e-12)
    assert_allclose(lee_radok.triangle_lift_off_time(1e-3, *ELASTIC), 2e-3, rtol=1e-11)
    t = np.array([0.5e-3, 1e-3, 1.5e-3])
    depths = 50e-6 * np.array([0.5, 1, 0.5])
    forces = lee_radok.triangle_force(t, 50e-6, 1e-3, RADIUS, *ELASTIC)
    assert_allclose(forces, hertz.force(depths, RADIUS, 2e6), rtol=1e-9)


def test_early_and_late_are_elastic() -> None:
    """With the instantaneous and the long-term modulus."""
    r = np.linspace(0, 1.2e-3, 13)
    for time, modulus in ((1e-16, 2.75e6), (1e3, 0.275e6)):
        pressures = step_responses.load_step_pressure(r, time, FORCE, RADIUS, *ZENER)
        peak = float(hertz.peak_pressure(FORCE, RADIUS, modulus))
        assert_allclose(pressures, hertz.pressure(r, FORCE, RADIUS, modulus), rtol=0, atol=1e-6 * peak)
