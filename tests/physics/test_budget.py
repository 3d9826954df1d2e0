"""The arithmetic of the error budget; what it says of real runs is in scripts/error_coverage.py."""

import math
from dataclasses import astuple, replace

import numpy as np
import pytest

from parcontact.physics.budget import ErrorBudget, ErrorSums, estimate, estimate_steady
from parcontact.physics.measures import SIDE
from parcontact.physics.prony import Prony
from parcontact.physics.time_error import RunProperties, StepObservation, count_spots, spot_radius, time_error

KNOWN = RunProperties(8.0, False, 1e-4, True)
SEEN = StepObservation(1e-3, 4e-4, 2.0, 0.02, 0.02, 0.1, 0.095)
RADIUS = 8.0 / math.pi * 1000 / (50 / SIDE)  # of the spots of SEEN: 1000 cells in contact, 50 fewer by the correction
MESH = 0.25 / 19 + 0.6 / 19**2 + 0.25 * RADIUS**-0.6 * (math.pi / 1000) ** 0.5  # of its area, corrected by a 19th


def spots(seen: StepObservation, points: int) -> float:
    """As many as there are, of the radius of a spot, in the contact."""
    return max(1.0, seen.area * points / (math.pi * min(spot_radius(KNOWN, seen, points), 4.0) ** 2))


def by_spots(seen: StepObservation, points: int) -> float:
    """What the cells per radius of the spots make, of the share that is open, averaged over the spots."""
    one = 0.13 / spot_radius(KNOWN, seen, points) ** 2.3
    return (1.0 - seen.area) * one / spots(seen, points) ** 0.25


def test_parts_add_up() -> None:
    """A surface whose slope is its friction: the numbers of the module, at 8 cells per shortest wave."""
    budget = estimate(KNOWN, SEEN, 10_000)
    assert budget.friction is not None
    assert astuple(budget.friction) == pytest.approx(
        (
            1.1e-3 / spots(SEEN, 10_000) ** 0.25,
            1.7 * 4e-4 * (4e-4 / 7.2e-3) ** 0.25 * (1 - 0.9 * 0.1**2),
            1e-4,
            0.05 * 2**-2.5 + by_spots(SEEN, 10_000),
            0.0,
            0.0,
        )
    )
    solver, time = 0.1 * 1e-3**0.7, 0.21 * 0.9 ** (1 / 3) * budget.friction.time
    assert astuple(budget.area) == pytest.approx((solver, time, 0.9e-4, MESH, 0.0, 0.0))
    assert budget.area.total == pytest.approx(solver + time + 0.9e-4 + MESH)


@pytest.mark.parametrize("exponential", [True, False])
def test_area_has_no_error_of_time_in_full_contact(exponential: bool) -> None:
    """And less where less is open; friction has one. An area is not known to less than a cell."""
    known, seen = replace(KNOWN, exponential=exponential), replace(SEEN, area=1.0, corrected=1.0)
    full, nearly, open_ = (
        estimate(known, replace(seen, area=area, corrected=area), 10_000) for area in (1.0, 0.9, 0.2)
    )
    assert (full.area.time, full.area.mesh) == (0.0, pytest.approx(1e-4))
    assert full.friction is not None
    assert full.friction.time > 0.0
    assert 0.0 < nearly.area.time < open_.area.time


def test_backward_euler_is_of_the_first_order() -> None:
    budget = estimate(RunProperties(8.0, False, 0.0, False), SEEN, 10_000)
    assert budget.friction is not None
    assert budget.friction.time == pytest.approx(1.1 * 0.02)
    assert budget.area.time == pytest.approx(1.1 * 0.02 * (0.18 * 0.9**2 + 0.005 / 0.095))


def test_little_friction_counts_more() -> None:
    """A quarter of the slope's friction: twice the relative error; none at all: no budget."""
    one = estimate(KNOWN, SEEN, 10_000).friction
    other = estimate(KNOWN, StepObservation(1e-3, 4e-4, 2.0, 0.08, 0.02, 0.1, 0.095), 10_000).friction
    assert one is not None
    assert other is not None
    assert other.solver == pytest.approx(2 * one.solver)
    assert (other.time, other.folded, other.mesh) == (one.time, one.folded, one.mesh)
    assert estimate(KNOWN, StepObservation(1e-3, 4e-4, 2.0, 0.08, 0.0, 0.1, 0.095), 10_000).friction is None


def test_radius_of_a_spot() -> None:
    """Of a circle of ten cells: pi r^2 cells and 8 r sides; of one hole in full contact the same."""
    points, cells, sides = 10_000, 100 * math.pi, 80
    spot = StepObservation(0.0, 0.0, 2.0, 0.0, 0.1, cells / points, (cells - SIDE * sides) / points)
    hole = StepObservation(0.0, 0.0, 2.0, 0.0, 0.1, 1 - cells / points, 1 - (cells + SIDE * sides) / points)
    assert spot_radius(KNOWN, spot, points) == pytest.approx(10.0)
    assert spot_radius(KNOWN, hole, points) == pytest.approx(10.0)
    assert spot_radius(KNOWN, StepObservation(0.0, 0.0, 2.0, 0.0, 0.1, 1.0, 1.0), points) == math.inf


def test_points_that_penetrate_are_missing_in_the_area() -> None:
    """Eight of ten of them, of the points in contact; friction does not change."""
    one, other = (estimate(KNOWN, replace(SEEN, penetrating=share), 10_000) for share in (0.0, 0.02))
    assert other.area.solver - one.area.solver == pytest.approx(0.016)
    assert other.friction == one.friction


def test_spots_are_counted() -> None:
    """Four circles of ten cells; three strips of forty; in full contact those of half the shortest wave."""
    points, cells, sides = 10_000, 400 * math.pi, 4 * 80
    four = StepObservation(0.0, 0.0, 2.0, 0.0, 0.1, cells / points, (cells - SIDE * sides) / points)
    strips = StepObservation(0.0, 0.0, 2.0, 0.0, 0.1, 120 / 300, (120 - SIDE * 6) / 300)
    full = StepObservation(0.0, 0.0, 2.0, 0.0, 0.1, 1.0, 1.0)
    bare = RunProperties(None, False, 0.0, True)
    assert count_spots(bare, four, points) == pytest.approx(4.0)
    assert count_spots(replace(bare, straight=True), strips, 300) == pytest.approx(3.0)
    assert count_spots(KNOWN, full, points) == pytest.approx(points / (16 * math.pi))
    assert count_spots(bare, full, points) == 1.0


def late(z: float) -> float:
    """L of the module of `time_error`."""
    return 1.0 / math.tanh(z / 2.0) - 2.0 / z


def test_spots_that_pass_within_a_step() -> None:
    """Of the module of `time_error`: a circle of ten cells passes by one; a branch that is as fast as the step, one far
    slower, one far faster. Where the pair shows more, three tenths of that count, all of it where nothing slides."""
    points, cells, dt = 10_000, 100 * math.pi, 1e-3
    seen = StepObservation(0.0, 0.0, 2.0, 0.0, 0.1, cells / points, (cells - SIDE * 80) / points, 1.0, dt)
    edges = 1.0 - seen.area**4
    for tau, share in ((dt, late(1.0)), (1e6 * dt, 0.0), (1e-6 * dt, 1.0)):
        known = replace(KNOWN, prony=Prony(1e5, np.array([1e6]), np.array([tau])))
        assert time_error(known, seen, points) == pytest.approx(0.66 * edges * 0.1 * (share + 0.019), rel=1e-4)
    jump = replace(seen, difference=1.0)
    still = time_error(known, replace(jump, slid=0.0), points)
    assert time_error(known, jump, points) == pytest.approx((0.3 * edges + seen.area**4) * still)


def test_branches_count_by_the_friction_they_make() -> None:
    """Of the module of `time_error`: w = G omega tau/(1 + (omega tau)^2), for spots that pass and for waves."""
    dt, moduli, times = 1e-3, np.array([1e6, 3e6]), np.array([1e-3, 1e-4])
    known = replace(KNOWN, prony=Prony(1e5, moduli, times))
    spot = StepObservation(0.0, 0.0, 2.0, 0.0, 0.1, 0.1, 0.08, 1.0, dt)
    x = 1.0 / spot_radius(KNOWN, spot, 10_000)

    def mean(angle: float) -> float:
        weights = moduli * (angle / dt * times) / (1.0 + (angle / dt * times) ** 2)
        return float(np.average([late(dt / tau) for tau in times], weights=weights))

    passing = 0.66 * (1.0 - 0.1**4) * x * (mean(x) + 0.19 * x)
    assert time_error(known, spot, 10_000) == pytest.approx(passing, rel=1e-12)
    full = replace(spot, area=1.0, corrected=1.0, angle=0.5)
    assert time_error(known, full, 10_000) == pytest.approx(0.5**2 / 8.0 * (1.0 + mean(0.5)), rel=1e-12)


@pytest.mark.parametrize(("order", "power"), [(1.0, 1.7), (1.2, 1.7 / 1.2), (2.0, 1.25)])
def test_order_of_the_pair(order: float, power: float) -> None:
    """The error goes with the power 1.7 of the step, the difference with its order: with that of the difference by
    which these agree, 1.25 at least."""
    one, other = (time_error(KNOWN, replace(SEEN, difference=e, order=order), 10_000) for e in (1e-4, 2e-4))
    assert other / one == pytest.approx(2.0**power, rel=1e-12)


@pytest.mark.parametrize("z", [1e-9, 0.9e-3, 1.1e-3, 2.0, 1e3])
def test_waves_that_turn_within_a_step(z: float) -> None:
    """In full contact, of one branch: L, a sixth of z where that has no digits left. The true error of a harmonic wave
    is two thirds of the estimate: short waves weigh more in friction than in what is seen of them."""
    dt, angle = 1e-3, 0.01
    known = replace(KNOWN, prony=Prony(1e5, np.array([1e6]), np.array([dt / z])))
    seen = StepObservation(0.0, 0.0, 2.0, 0.0, 0.1, 1.0, 1.0, 1.0, dt, angle=angle)
    share = late(z) if z > 0.1 else z / 6.0
    found = time_error(known, seen, 100)
    assert found == pytest.approx(angle**2 / 8.0 * (1.0 + share), rel=1e-6)
    decay, half = math.exp(-z), 2.0 * math.sin(angle / 2.0)
    lost = (1.0 - decay) ** 2 / z * math.sin(angle) / ((1.0 - decay) ** 2 + decay * half**2)
    exact = angle * z / (z**2 + angle**2)
    if z > 0.1:
        assert abs(lost / exact - 1.0) == pytest.approx(found / 1.5, rel=0.15)


def test_nearly_full_contact_has_edges_and_waves() -> None:
    """Of a branch that is far slower than the step; the pair counts by three tenths of what has edges, and the rest."""
    known = replace(KNOWN, prony=Prony(1e5, np.array([1e6]), np.array([1e3])))
    seen = StepObservation(0.0, 0.0, 2.0, 0.0, 0.1, 0.8, 0.75, 1.0, 1e-3, angle=0.2)
    full, share = 0.8**4, 1.0 / spot_radius(KNOWN, seen, 10_000)
    passing, turning = 0.66 * 0.19 * share**2, 0.2**2 / 8.0
    found = time_error(known, seen, 10_000)
    assert found == pytest.approx((1.0 - full) * passing + full * turning, rel=1e-4)
    differs = replace(seen, difference=1.0)
    still = time_error(known, replace(differs, slid=0.0), 10_000)
    assert time_error(known, differs, 10_000) == pytest.approx((0.3 * (1.0 - full) + full) * still)


def test_summary() -> None:
    """Without a slide means over time, of friction in proportion to it; in sentences."""
    summary = ErrorSums()
    summary = summary.plus(estimate(KNOWN, SEEN, 10_000), 0.02, 3.0)
    summary = summary.plus(estimate(KNOWN, StepObservation(3e-3, 4e-4, 2.0, 0.01, 0.01, 0.1, 0.095), 10_000), 0.01, 2.0)
    summary = summary.plus(estimate(KNOWN, StepObservation(5e-3, 0.0, 2.0, 0.02, 0.0, 0.1, 0.1), 10_000), 0.0, 1.0)
    assert summary.friction is not None
    assert summary.area is not None
    one = 1.1e-3 / spots(SEEN, 10_000) ** 0.25
    assert summary.friction.solver == pytest.approx((0.06 * one + 0.02 * 3 * one) / 0.08)
    assert summary.area.solver == pytest.approx(0.1 * (3 * 1e-3**0.7 + 2 * 3e-3**0.7 + 1 * 5e-3**0.7) / 6)
    friction, area = summary.lines((0.012, 0.012))
    assert friction.startswith("estimated error of friction: ")
    assert "solver 0.078 %" in friction
    assert "try" not in friction
    assert area.startswith("estimated error of the corrected contact area: ")
    assert area.endswith("; more than the 1.2 % that numerics.accuracy asks for: try a finer grid")
    assert ErrorSums().lines((0.012, 0.012)) == []
    assert ", mean over time; more than the" in area
    assert summary.lines((0.012, 0.012), ["mesh"])[1].endswith(": try a smaller numerics.accuracy")


def test_a_rest_does_not_dilute_what_a_slide_says() -> None:
    """A slide of 1 mm, then an hour at rest under other errors: the slide's, but for nothing."""
    summary, slide = ErrorSums(), estimate(KNOWN, SEEN, 10_000)
    rest = estimate(KNOWN, StepObservation(5e-2, 0.1, 2.0, 0.02, 0.01, 0.1, 0.05), 10_000)
    summary = summary.plus(rest, 0.0, 1e-3)
    summary = summary.plus(slide, 0.02, 1e-2, slid=1e-3)
    summary = summary.plus(rest, 0.01, 3600.0)
    assert summary.friction is not None
    assert summary.area is not None
    assert slide.friction is not None
    assert astuple(summary.friction) == pytest.approx(astuple(slide.friction), rel=1e-12)
    assert astuple(summary.area) == pytest.approx(astuple(slide.area), rel=1e-12)
    assert all(", mean over the distance slid" in line for line in summary.lines((0.012, 0.012)))


@pytest.mark.parametrize("friction", [1e-18, 1e-7, 1e-6])
def test_friction_that_is_noise_is_0_within_its_error(friction: float) -> None:
    """Pressures wrong by 1e-3 on slopes of 0.02 may have tangential forces of 0.4 of 2e-5 of the load where there is
    one spot, by the root of their number less where there are more."""
    seen = StepObservation(1e-3, 4e-4, 2.0, 0.02, friction, 0.1, 0.095)
    budget = estimate(KNOWN, seen, 10_000).friction
    assert budget is not None
    assert budget.solver * friction == pytest.approx(0.4 * 2e-5 / spots(seen, 10_000) ** 0.5)
    summary = ErrorSums()
    summary = summary.plus(ErrorBudget(budget, budget), friction, 1.0, slid=1e-3)
    assert summary.friction_within == pytest.approx(budget.total * friction)
    assert summary.lines((0.01, 0.01))[-1].startswith(f"friction is 0 +- {budget.total * friction:.2g}: ")


def test_the_two_views_bound_the_mesh() -> None:
    """Friction by slopes and by energy that are 0.004 apart, beside what both have in common: cells per wave, and per
    radius of the spots."""
    seen = replace(SEEN, slid=2.5, seconds=1e-3, views_apart=4e-3)
    budgets = (estimate(KNOWN, each, 10_000).friction for each in (seen, replace(seen, views_apart=0.0)))
    apart, alike = (budget.mesh for budget in budgets if budget)
    assert alike == pytest.approx(0.05 * 2**-2.5 + by_spots(SEEN, 10_000))
    assert apart - alike == pytest.approx(4e-3 / 0.02)


def test_small_spots_of_long_waves_have_an_error() -> None:
    """Spots of a radius of 1.5 cells on waves of 16 cells: it was 6 % where cells per wave alone said 0.2 %. Many of
    them average it out, and a contact without edges has none."""
    few = replace(SEEN, area=0.0035, corrected=0.0035 * (1.0 - 0.118 * 8.0 / math.pi / 1.5))
    known = replace(KNOWN, cells_per_wave=16.0)
    one, many, full = (
        estimate(known, seen, points).friction
        for seen, points in ((few, 2_000), (few, 200_000), (replace(SEEN, area=1.0, corrected=1.0), 2_000))
    )
    assert one is not None
    assert many is not None
    assert full is not None
    assert one.mesh > 0.03
    assert full.mesh == pytest.approx(0.05 * 4**-2.5)
    assert many.mesh - full.mesh == pytest.approx((one.mesh - full.mesh) / 100**0.25, rel=0.01)


def test_steady_friction_is_by_energy() -> None:
    """Three tenths of the difference of the views, or all of it where contacts are alike, over as much of the slope
    where friction is less, a fifth of what waves make in a march by the root of what is open, and what spots do."""
    seen = replace(SEEN, slope=0.2, views_apart=4e-3)
    solver = 1.1e-3 / spots(seen, 10_000) ** 0.25
    for alike, counts in ((False, 0.3), (True, 1.0)):
        budget = estimate_steady(replace(KNOWN, folded=0.0, alike=alike), seen, 10_000)
        assert budget.friction is not None
        mesh = counts * 4e-3 / (0.3 * 0.2) + 0.2 * 0.9**0.5 * 0.05 * 2**-2.5 + by_spots(seen, 10_000)
        assert astuple(budget.friction) == pytest.approx((solver, 0.0, 0.0, mesh, 0.0, 0.0))
    assert (budget.area.time, budget.area.mesh) == pytest.approx((0.0, MESH))
    assert estimate_steady(KNOWN, replace(seen, friction=0.0), 10_000).friction is None


def test_summary_goes_on() -> None:
    """From the entries of another, as if there had been one; as plain data it has parts that add up."""
    other = ErrorSums().plus(estimate(KNOWN, SEEN, 10_000), 0.02, 3.0, 3e-4)
    on = ErrorSums.restored({name: np.asarray(entry.value) for name, entry in other.entries().items()})
    step = estimate(KNOWN, StepObservation(3e-3, 4e-4, 2.0, 0.01, 0.01, 0.1, 0.095), 10_000), 0.01, 2.0, 2e-4
    assert on.plus(*step).facts(0.01) == other.plus(*step).facts(0.01)
    friction = on.facts(0.01)["friction"]
    assert friction.pop("mesh_across") == 0.0
    assert friction.pop("total") == pytest.approx(sum(friction.values()))
    assert on.sums[0, 0] == pytest.approx(0.02 * 3e-4)  # not changed by what was added to it


def test_steps_that_last_no_time_count_where_none_does() -> None:
    """Three loads without duration: their mean; beside a step that lasts they are nothing."""
    summary = ErrorSums()
    for complementarity in (1e-3, 2e-3, 6e-3):
        still = StepObservation(complementarity, 0.0, 2.0, 0.0, 0.0, 0.1, 0.1)
        summary = summary.plus(estimate(KNOWN, still, 10_000), 0.0, 0.0)
    assert summary.friction is None
    assert summary.area is not None
    assert summary.area.solver == pytest.approx(0.1 * (1e-3**0.7 + 2e-3**0.7 + 6e-3**0.7) / 3)
    area = summary.plus(estimate(KNOWN, StepObservation(8e-3, 0.0, 2.0, 0.0, 0.0, 0.1, 0.1), 10_000), 0.0, 1e-9).area
    assert area is not None
    assert area.solver == pytest.approx(0.1 * 8e-3**0.7)
