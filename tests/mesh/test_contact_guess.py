"""The guess of what touches, against closed forms of spectra, of Persson's theory and of moduli."""

import math
from typing import Any

import pytest

from parcontact.job import Job
from parcontact.job.checks.cells import Guess
from parcontact.job.sections.geometry import Rough
from parcontact.mesh.contact_guess import EDGES, FEW, FINEST, LEAST, MORE, MOST, UNKNOWN, guesses, slope_of

WAVES: dict[str, Any] = {"hurst": 0.5, "long_wavelength": 1e-3, "short_wavelength": 1e-5}
LOW, HIGH = 2.0 * math.pi / 1e-3, 2.0 * math.pi / 1e-5


def guessed(**sections: Any) -> list[Guess]:
    data = {
        "grid": {"points": 256, "size": 1e-3},
        "surface": {"shape": "rough", **WAVES, "rms_slope": 0.1},
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "history": [{"pressure": 1e4}],
        **sections,
    }
    job = Job.model_validate({key: value for key, value in data.items() if value is not None})
    return guesses(job, 1e-5, 1e-6)


def persson(stiffness: float) -> float:
    """The share under 1e4 Pa where slopes are 0.1, with what sliding surfaces have more."""
    return 1.0 - (1.0 - math.erf(math.sqrt(2.0) * 1e4 / (stiffness * 0.1))) ** MORE


def share(**sections: Any) -> float:
    return min(guessed(**sections)).share


def test_waves_along_a_side() -> None:
    """Of a box of 1 mm with shortest waves of 10 um."""
    assert guessed()[0].waves == pytest.approx(100.0)


def test_rms_slope_of_a_self_affine_surface() -> None:
    """Hurst exponent 0.5: m0 = int k^-2 dk (in units of C k_0^3/2 pi), m2 = int k^0 dk; to 1e-4."""
    m0, m2 = LOW**3 * (1.0 / LOW - 1.0 / HIGH), LOW**3 * (HIGH - LOW)
    given = slope_of(Rough(**WAVES, rms_height=1e-6))
    assert given == pytest.approx(1e-6 * math.sqrt(m2 / m0), rel=1e-4)
    assert slope_of(Rough(**WAVES, psd_constant=1e-20)) == pytest.approx(
        math.sqrt(1e-20 * m2 / (2 * math.pi)), rel=1e-4
    )
    assert slope_of(Rough(**WAVES, rms_slope=0.3)) == 0.3


def test_share_by_persson() -> None:
    """erf(sqrt(2) p/(E h')), E = 4 G of an incompressible body; of the least of the loads; a force is over the box."""
    expected = persson(4e6)
    assert share() == pytest.approx(expected, rel=1e-12)
    assert share(history=[{"pressure": 1e5}, {"force": 1e-2}]) == pytest.approx(expected, rel=1e-12)
    soft = {"model": "elastic", "shear_modulus": 1e6, "poisson": 0.0}
    assert share(material=soft) == pytest.approx(persson(2e6), rel=1e-12)
    assert (share(history=[{"pressure": 1.0}]), share(history=[{"pressure": 1e9}])) == (LEAST, MOST)


def test_a_body_is_stiff_for_waves_that_pass_fast() -> None:
    """At both ends of a branch: its modulus at rest, and with the branch at once."""
    body = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 4e6, "relaxation_time": 1e-3}]}
    stage = {"pressure": 1e4, "distance": 1e-5, "cells_per_step": 1}
    slow, fast = (share(material=body, history=[{**stage, "velocity": v}]) for v in (1e-9, 1e4))
    assert slow == pytest.approx(share(), rel=1e-6)
    assert fast == pytest.approx(persson(20e6), rel=1e-6)
    curve = {"velocities": [1e-9, 1e4], "pressures": [1e4]}
    assert share(material=body, history=None, steady=curve) == pytest.approx(fast, rel=1e-12)


def test_phases_at_edges() -> None:
    """Phases are in right angles. One branch lags by atan(g x/(1 + (1 + g) x^2)) at each load, with x the frequency
    times its time and g its modulus over that at rest; elastic bodies and bodies at rest do not lag."""
    body = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 4e6, "relaxation_time": 1e-3}]}
    velocities = [1e-9, 3e-7, 1e-5]

    def expected(velocity: float) -> float:
        x = EDGES * 2.0 * math.pi / 1e-5 * velocity * 1e-3
        return math.atan(4.0 * x / (1.0 + 5.0 * x**2)) / (0.5 * math.pi)

    curve = {"velocities": velocities, "pressures": [1e4]}
    found = guessed(material=body, history=None, steady=curve)
    assert [one.phase for one in found] == pytest.approx([expected(v) for v in velocities], rel=1e-12)
    assert guessed()[0].phase == guessed(material=body)[0].phase == 0.0


def test_slow_sliding_of_a_friction_curve() -> None:
    """The loss angle in proportion to the frequency far below those of the body, its inverse far above, at
    each velocity of a curve. Marches, whose time steps between cells see the edges, have none."""
    body = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 4e6, "relaxation_time": 1e-3}]}
    curve = {"velocities": [1e-9, 1e4], "pressures": [1e4]}
    slow, fast = (each.slow for each in guessed(material=body, history=None, steady=curve))
    assert slow == pytest.approx(1.0, rel=1e-6)
    assert fast == pytest.approx((FEW / FINEST) ** 3, rel=1e-3)
    assert guessed(material=body, history=[{"pressure": 1e4, "velocity": 1e-9, "distance": 1e-5}])[0].slow == 0.0


def test_what_is_not_known() -> None:
    """Loads by their approach, and waves whose slope is in a file or a single amplitude."""
    wave = {"shape": "wave", "amplitude": 1e-6, "waves": [2, 0]}
    assert share(history=[{"approach": 1e-6}]) == share(surface=wave) == UNKNOWN
