"""Power that edges of contact lose in waves shorter than the cells: closed forms of Hertz, and the budget."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j1, spherical_jn

from parcontact.accuracy.budget import estimate, estimate_steady
from parcontact.accuracy.edge_loss import lost_in_short_waves
from parcontact.accuracy.time_error import RunProperties, StepObservation, radius_of
from parcontact.physics.prony import Prony

ONE = Prony(1e6, np.array([1e6]), np.array([1e-3]))
SLOW, FAST = 1e-6, 1e9  # cells in a second
KNOWN = RunProperties(8.0, False, 0.0, True, ONE, (1e-6, 1e-6))
SEEN = StepObservation(1e-9, 0.0, 2.0, 0.02, 0.02, 0.1, 0.095, way=(1e-12, 0.0))


@pytest.mark.parametrize("straight", [True, False])
def test_hertz_contacts_of_a_body_that_loses_in_proportion_to_the_frequency(straight: bool) -> None:
    """Beyond Q a of J1(x)^2/x, of which all is 1/2, and of j1(x)^2, of which all is pi/6: a strip of half width a and a
    circle. Their waves average out where Q a is a multiple of pi for one, and a quarter of it more for the other.
    """
    for radius in (5.25, 20.25) if straight else (5.0, 20.0):
        x = math.pi * radius
        inside = (
            quad(lambda t: j1(t) ** 2 / t, 0.0, x, limit=500)[0] / 0.5
            if straight
            else quad(lambda t: spherical_jn(1, t) ** 2, 0.0, x, limit=500)[0] / (math.pi / 6.0)
        )
        share, slow = lost_in_short_waves(ONE, radius, SLOW, straight)
        assert share == pytest.approx(1.0 - inside, rel=0.02)
        assert slow == pytest.approx(1.0, rel=1e-4)


def test_far_above_the_frequencies_of_the_body() -> None:
    """The loss angle falls with the frequency: s^3 in all."""
    share, slow = lost_in_short_waves(ONE, 5.0, FAST, False)
    assert slow == pytest.approx(share**2, rel=1e-4)


def test_between_both() -> None:
    """m by adaptive quadrature, to 2 %."""

    def mean(frequency: float) -> float:
        def loss(t: float) -> float:
            turn = 1j * frequency / t * 1e-3
            modulus = 1.0 + turn / (1.0 + turn)
            return 2.0 * t * modulus.imag / abs(modulus)

        return float(quad(loss, 0.0, 1.0)[0])

    for speed in (1e2, 1e3):
        share, slow = lost_in_short_waves(ONE, 5.0, speed, False)
        assert slow == pytest.approx(share * mean(math.pi * speed) / mean(share * math.pi * speed), rel=0.02)


def test_without_edges_or_losses() -> None:
    """Full contact, an elastic body; and spots too small for the mesh."""
    assert lost_in_short_waves(ONE, math.inf, SLOW, False) == (0.0, 0.0)
    assert lost_in_short_waves(Prony(1e6, np.array([]), np.array([])), 5.0, SLOW, False) == (0.0, 0.0)
    assert lost_in_short_waves(ONE, 0.0, SLOW, False) == lost_in_short_waves(ONE, 0.2, SLOW, True) == (1.0, 1.0)


def test_friction_of_slow_sliding_has_their_error() -> None:
    """Twice the share that is lost, of what is open; in steady sliding of all up to half contact, and of twice what is
    open beyond, six times in free boxes. Along straight edges by their half width. None at rest and where waves pass
    fast."""
    share, _ = lost_in_short_waves(ONE, radius_of(KNOWN, SEEN, 10_000), SLOW, False)
    lost = 2.0 * share
    for judge, free, expected in (
        (estimate, True, 0.9 * lost),
        (estimate_steady, False, lost),
        (estimate_steady, True, 3 * lost),
    ):
        known = replace(KNOWN, free=free)
        still, slides, fast = (
            judge(known, replace(SEEN, way=way), 10_000).friction for way in ((0.0, 0.0), SEEN.way, (1e3, 0.0))
        )
        assert still is not None
        assert slides is not None
        assert fast is not None
        assert slides.mesh - still.mesh == pytest.approx(expected, rel=1e-4)
        assert slides.edges == pytest.approx(expected, rel=1e-4)
        assert fast.mesh - still.mesh < 0.01 * lost
    ridges = replace(KNOWN, straight=True)
    share, _ = lost_in_short_waves(ONE, radius_of(ridges, SEEN, 10_000), SLOW, True)
    found = estimate(ridges, SEEN, 10_000).friction
    assert found is not None
    assert found.edges == pytest.approx(2.0 * 0.9 * share, rel=1e-4)
    for area, few in ((0.5, 1.0), (0.75, 0.5)):
        seen = replace(SEEN, area=area, corrected=area - 0.005)
        share, _ = lost_in_short_waves(ONE, radius_of(KNOWN, seen, 10_000), SLOW, False)
        found = estimate_steady(KNOWN, seen, 10_000).friction
        assert found is not None
        assert found.edges == pytest.approx(2.0 * few * share, rel=1e-4)


def test_the_larger_one_of_it_and_of_the_two_views() -> None:
    """Friction by energy lacks what edges lose, and the difference of the views shows it, but where they agree."""
    lost = estimate(KNOWN, SEEN, 10_000).friction
    apart = estimate(KNOWN, replace(SEEN, views_apart=0.02), 10_000).friction
    assert lost is not None
    assert apart is not None
    assert apart.mesh - lost.mesh == pytest.approx(1.0 - lost.edges)
    assert apart.edges == lost.edges


def test_long_cells_across_the_sliding_lose_nothing() -> None:
    """Cells four times as long across the sliding, and along it."""
    along, across = (
        estimate(replace(KNOWN, cell=cell), SEEN, 10_000).friction for cell in ((1e-6, 4e-6), (4e-6, 1e-6))
    )
    assert along is not None
    assert across is not None
    assert across.edges == pytest.approx(4.0 * along.edges, rel=1e-3)
