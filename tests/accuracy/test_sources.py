"""Errors by solver, folded branches and mesh: the arithmetic; of real runs: scripts/error_coverage.py."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j1, spherical_jn

from parcontact.march.budget import ErrorParts, estimate, estimate_steady, lost_at_edges, lost_in_short_waves
from parcontact.march.time_error import RunProperties, StepObservation, count_spots, radius_of
from parcontact.physics.prony import Prony
from parcontact.physics.records import SIDE

RUN = RunProperties(10_000, cells_per_wave=8.0, folded=1e-4)
SEEN = StepObservation(1e-3, 0.02, 0.1, 0.095, slope=0.02)
ONE = Prony(1e6, np.array([1e6]), np.array([1e-3]))
SLOW, FAST = 1e-6, 1e9  # cells in a second
KNOWN = replace(RUN, folded=0.0, prony=ONE, cell=(1e-6, 1e-6))
MOVES = replace(SEEN, complementarity=1e-9, way=(1e-12, 0.0))


def friction_of(run: RunProperties, seen: StepObservation, steady: bool = False) -> ErrorParts:
    found = (estimate_steady if steady else estimate)(run, seen).friction
    assert found is not None
    return found


# -- what is seen -----------------------------------------------------------------------------------------------------


def test_spots_are_counted() -> None:
    """Four circles of ten cells, and four such holes; in full contact those of half the shortest wave; one where they
    are identical."""
    points, cells, sides = 10_000, 400 * math.pi, 4 * 80
    four = replace(SEEN, area=cells / points, corrected=(cells - SIDE * sides) / points)
    holes = replace(SEEN, area=1 - cells / points, corrected=1 - (cells + SIDE * sides) / points)
    full = replace(SEEN, area=1.0, corrected=1.0)
    bare = replace(RUN, cells_per_wave=None)
    assert count_spots(bare, four) == pytest.approx(4.0)
    assert count_spots(bare, holes) == pytest.approx(4.0)
    assert count_spots(RUN, full) == pytest.approx(points / (16 * math.pi))
    assert count_spots(bare, full) == count_spots(replace(bare, identical_contacts=True), four) == 1.0


def test_radius_of_a_spot() -> None:
    """A circle of ten cells has pi r^2 cells and 8 r sides. A hole in full contact has as many."""
    points, cells, sides = 10_000, 100 * math.pi, 80
    spot = replace(SEEN, area=cells / points, corrected=(cells - SIDE * sides) / points)
    hole = replace(SEEN, area=1 - cells / points, corrected=1 - (cells + SIDE * sides) / points)
    assert radius_of(RUN, spot) == pytest.approx(10.0)
    assert radius_of(RUN, hole) == pytest.approx(10.0)
    assert radius_of(RUN, replace(SEEN, area=1.0, corrected=1.0)) == math.inf
    yielded = replace(spot, corrected=spot.area, spared=spot.area - spot.corrected)  # its edge is as long
    assert radius_of(RUN, yielded) == pytest.approx(10.0)


def test_spots_of_long_cells() -> None:
    """A circle of 10 units on cells of 1 x 4: its radius is 4 mean sides of 2.5."""
    run, cells = replace(RUN, cell=(1.0, 4.0), cells_per_wave=None), 100 * math.pi / 4.0
    seen = replace(SEEN, area=cells / 10_000, corrected=0.9 * cells / 10_000)
    radius = radius_of(run, seen)
    assert count_spots(run, seen) == pytest.approx(max(1.0, cells / (math.pi * (2.5 * radius) ** 2 / 4.0)))


# -- solver and folded branches -------------------------------------------------------------------------------------


def test_parts_add_up() -> None:
    """Friction and area have the same parts, none of them negative; the folded branches count where the gap is open."""
    budget = estimate(RUN, SEEN)
    assert budget.friction is not None
    for parts in (budget.friction, budget.area):
        assert parts.total == pytest.approx(parts.solver + parts.time + parts.folded + parts.mesh, rel=1e-15)
        assert min(parts.plain().values()) >= 0.0
    assert (budget.friction.folded, budget.area.folded) == (1e-4, pytest.approx(0.9e-4))


def test_little_friction_counts_more() -> None:
    """A quarter of the slope's friction: twice the relative error; none at all: no budget. Steady friction is a sum of
    squares, whose error does not grow."""
    less = replace(SEEN, slope=0.08)
    one, other = friction_of(RUN, SEEN), friction_of(RUN, less)
    assert other.solver == pytest.approx(2 * one.solver)
    assert (other.time, other.folded, other.mesh) == (one.time, one.folded, one.mesh)
    assert estimate(RUN, replace(less, friction=0.0)).friction is None
    assert friction_of(RUN, less, steady=True).solver == pytest.approx(one.solver)


@pytest.mark.parametrize("friction", [1e-18, 1e-7, 1e-6])
def test_friction_that_is_noise_is_0_within_its_error(friction: float) -> None:
    """Pressures wrong by 1e-3 on slopes of 0.02 may have tangential forces of 0.8 of 2e-5 of the load where there is
    one spot, by the root of their number less where there are more."""
    seen = replace(SEEN, friction=friction)
    budget = friction_of(RUN, seen)
    assert budget.solver * friction == pytest.approx(0.8 * 2e-5 / count_spots(RUN, seen) ** 0.5)
    assert budget.of_friction >= 1.0


def test_an_interface_has_the_error_of_the_area() -> None:
    """Its part of friction has the error of the area, and the body's part that of the body."""
    body = friction_of(RUN, SEEN)
    mixed, area = estimate(RUN, replace(SEEN, friction=0.08, interface=0.06)), estimate(RUN, SEEN).area
    assert mixed.friction is not None
    assert mixed.friction.total == pytest.approx(0.25 * body.total + 0.75 * area.total)


def test_steady_friction_of_rounded_pressures_is_not_known() -> None:
    """Waves of rounded pressures lose up to the square of the least single number: friction along ridges is 0."""
    least = float(np.finfo(np.float32).eps) ** 2
    for friction, error in ((least, 1.0), (100.0 * least, 0.01)):
        found = friction_of(RUN, replace(SEEN, complementarity=1e-9, friction=friction), steady=True)
        assert found.solver == pytest.approx(error)


# -- mesh -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("judge", "way", "share"),
    [(estimate, (1.0, 0.0), 0.5), (estimate, (0.0, 0.0), 0.72), (estimate_steady, (1.0, 0.0), 0.72)],
)
def test_the_mesh_makes_the_area_wrong(judge: Any, way: tuple[float, float], share: float) -> None:
    """By 0.5 of the correction over the fourth root of the number of spots in a slide, 0.72 at rest and in steady
    sliding, a cell at least; four times that of one spot where they are identical. Where edges follow an axis of the
    grid it is four times as large, as they have one position on it; where three of four do, two and a half times."""
    seen = replace(SEEN, way=way)
    found = judge(RUN, seen).area.mesh
    assert found == pytest.approx(share / 19.0 / count_spots(RUN, seen) ** 0.25)
    straight = (judge(RUN, replace(seen, straight=share)).area.mesh for share in (0.5, 1.0))
    assert list(straight) == pytest.approx([2.5 * found, 4.0 * found])
    run = replace(RUN, identical_contacts=True)
    assert judge(run, seen).area.mesh == pytest.approx(4.0 * share / 19.0)
    assert judge(RUN, replace(seen, area=0.5, corrected=0.5)).area.mesh == pytest.approx(2e-4)


def test_the_two_views_bound_the_mesh_of_marches() -> None:
    """Friction by slopes and by energy that are 0.004 apart, of 0.02: 0.75 of a fifth."""
    assert friction_of(RUN, replace(SEEN, friction_mismatch=4e-3)).mesh == pytest.approx(0.15)
    assert friction_of(RUN, SEEN).mesh == 0.0


def test_steady_friction_has_no_error_of_time_steps() -> None:
    """Nor of folded branches; without friction there is no budget."""
    found = estimate_steady(RUN, SEEN)
    assert found.friction is not None
    assert (found.friction.time, found.friction.folded, found.area.time) == (0.0, 0.0, 0.0)
    assert found.friction.mesh == pytest.approx(0.1 / 19.0 / count_spots(RUN, SEEN) ** 0.25)
    assert estimate_steady(RUN, replace(SEEN, friction=0.0)).friction is None


@pytest.mark.parametrize("steady", [False, True])
def test_a_map_lacks_waves_on_a_coarse_grid(steady: bool) -> None:
    """Below three cells per shortest wave: 0.05 at four cells, with the power 2.5. A rough surface has all of them."""
    for cells, measured, lacks in ((2.0, True, 0.05 * 2.0**2.5), (2.0, False, 0.0), (3.5, True, 0.0)):
        seen = replace(SEEN, area=1.0, corrected=1.0)
        run = replace(RUN, cells_per_wave=cells, measured=measured)
        assert friction_of(run, seen, steady).mesh == pytest.approx(lacks)


# -- power that edges lose ------------------------------------------------------------------------------------------


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
    """m of the module by adaptive quadrature, to 2 %: the error of its nodes for one branch."""

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


def test_steady_friction_has_what_edges_lose() -> None:
    """Twice the share that is lost, of all up to half contact, and of twice what is open beyond; six times in
    free boxes; none at rest and where waves pass fast; four times as much of identical contacts. Cells count along the
    sliding."""
    share, _ = lost_in_short_waves(ONE, radius_of(KNOWN, MOVES), SLOW, False)
    assert lost_at_edges(KNOWN, MOVES) == pytest.approx(2.0 * share, rel=1e-4)
    assert lost_at_edges(replace(KNOWN, free=True), MOVES) == pytest.approx(6.0 * share, rel=1e-4)
    still, fast = (replace(MOVES, way=way) for way in ((0.0, 0.0), (1e3, 0.0)))
    assert lost_at_edges(KNOWN, still) == 0.0
    assert lost_at_edges(KNOWN, fast) < 0.01 * share
    for run, times in (KNOWN, 1.0), (replace(KNOWN, identical_contacts=True), 4.0):
        both = (friction_of(run, seen, steady=True).mesh for seen in (MOVES, still))
        assert next(both) - next(both) == pytest.approx(times * 2.0 * share, rel=1e-4)
    seen = replace(MOVES, area=0.75, corrected=0.745)
    share, _ = lost_in_short_waves(ONE, radius_of(KNOWN, seen), SLOW, False)
    assert lost_at_edges(KNOWN, seen) == pytest.approx(2.0 * 0.5 * share, rel=1e-4)
    along, across = (lost_at_edges(replace(KNOWN, cell=cell), MOVES) for cell in ((1e-6, 4e-6), (4e-6, 1e-6)))
    assert across == pytest.approx(4.0 * along, rel=1e-3)
