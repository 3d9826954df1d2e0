"""The arithmetic of the error budget; what it says of real runs is in scripts/error_coverage.py."""

import math
from dataclasses import astuple, replace

import numpy as np
import pytest

from parcontact.accuracy.budget import ErrorBudget, ErrorSums, estimate, estimate_steady
from parcontact.accuracy.time_error import RunProperties, StepObservation, count_spots, spot_radius, time_error
from parcontact.physics.measures import SIDE
from parcontact.physics.prony import Prony

KNOWN = RunProperties(8.0, False, 1e-4, True)
SEEN = StepObservation(1e-3, 4e-4, 2.0, 0.02, 0.02, 0.1, 0.095)


def spots(seen: StepObservation, points: int) -> float:
    """As many as there are, of the radius of a spot, in the contact."""
    return max(1.0, seen.area * points / (math.pi * min(spot_radius(KNOWN, seen, points), 4.0) ** 2))


def test_parts_add_up() -> None:
    """Friction and area have the same parts, none of them negative; the folded branches count where the gap is open."""
    budget = estimate(KNOWN, SEEN, 10_000)
    assert budget.friction is not None
    for parts in (budget.friction, budget.area):
        assert parts.total == pytest.approx(parts.solver + parts.time + parts.folded + parts.mesh, rel=1e-15)
        assert min(astuple(parts)) >= 0.0
    assert (budget.friction.folded, budget.area.folded) == (1e-4, pytest.approx(0.9e-4))


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
    """The pair differs in the second order: a quarter of the difference is half the error, of friction and of area."""
    known = RunProperties(8.0, False, 0.0, False)
    one, half = (estimate(known, replace(SEEN, difference=each), 10_000) for each in (4e-4, 1e-4))
    assert one.friction is not None
    assert half.friction is not None
    assert half.friction.time == pytest.approx(0.5 * one.friction.time)
    assert half.area.time == pytest.approx(0.5 * one.area.time)


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
    """Branches that are faster than the step are the more wrong, in proportion to how far spots pass in it; several
    branches are as wrong as those between them."""

    def error(*times: float, slid: float = 1.0) -> float:
        known = replace(KNOWN, prony=Prony(1e5, np.full(len(times), 1e6), np.array(times)))
        return time_error(known, replace(SEEN, difference=0.0, slid=slid, seconds=1e-3), 10_000)

    slow, equal, fast = (error(tau) for tau in (1e3, 1e-3, 1e-9))
    assert 0.0 < slow < equal < fast
    assert error(1e-9, slid=0.5) == pytest.approx(0.5 * fast, rel=0.05)  # and a little of the second order
    assert equal < error(1e-3, 1e-4) < error(1e-4)


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


def test_summary() -> None:
    """Without a slide means over time, of friction in proportion to it; in sentences."""
    slower = replace(SEEN, complementarity=3e-3, slope=0.01, friction=0.01)
    seen = SEEN, slower, replace(SEEN, friction=0.0, corrected=0.1)
    first, second, third = (estimate(KNOWN, each, 10_000) for each in seen)
    summary = ErrorSums().plus(first, 0.02, 3.0).plus(second, 0.01, 2.0).plus(third, 0.0, 1.0)
    assert first.friction is not None
    assert second.friction is not None
    assert summary.friction is not None
    assert summary.area is not None
    mean = (0.06 * first.friction.solver + 0.02 * second.friction.solver) / 0.08
    assert summary.friction.solver == pytest.approx(mean)
    mean = (3 * first.area.solver + 2 * second.area.solver + third.area.solver) / 6
    assert summary.area.solver == pytest.approx(mean)
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
    assert summary.lines((0.01, 0.01))[-1].startswith(f"friction is 0 ± {budget.total * friction:.2g}: ")


def test_the_two_views_bound_the_mesh() -> None:
    """Friction by slopes and by energy that are 0.004 apart, of 0.02, add a fifth to what both have in common."""
    seen = replace(SEEN, slid=2.5, seconds=1e-3, views_apart=4e-3)
    budgets = (estimate(KNOWN, each, 10_000).friction for each in (seen, replace(seen, views_apart=0.0)))
    apart, alike = (budget.mesh for budget in budgets if budget)
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
    """It has no error of time steps, and less of the difference of the views than in a march, but where contacts are
    alike; without friction there is no budget."""
    seen, known = replace(SEEN, slope=0.2, views_apart=4e-3), replace(KNOWN, folded=0.0)
    some, whole = (estimate_steady(replace(known, alike=alike), seen, 10_000) for alike in (False, True))
    march = estimate(known, seen, 10_000)
    assert some.friction is not None
    assert whole.friction is not None
    assert march.friction is not None
    assert (some.friction.time, some.friction.folded, some.area.time) == (0.0, 0.0, 0.0)
    assert some.friction.mesh < whole.friction.mesh < march.friction.mesh
    assert some.area.mesh == march.area.mesh
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
    stills = [StepObservation(error, 0.0, 2.0, 0.0, 0.0, 0.1, 0.1) for error in (1e-3, 2e-3, 6e-3, 8e-3)]
    *loads, lasting = (estimate(KNOWN, still, 10_000) for still in stills)
    summary = ErrorSums()
    for budget in loads:
        summary = summary.plus(budget, 0.0, 0.0)
    assert summary.friction is None
    assert summary.area is not None
    assert summary.area.solver == pytest.approx(np.mean([budget.area.solver for budget in loads]))
    area = summary.plus(lasting, 0.0, 1e-9).area
    assert area is not None
    assert area.solver == pytest.approx(lasting.area.solver)
