"""Highest and dynamic friction of a slide, from made-up rows."""

import math
from typing import Any

import numpy as np
import pytest

from parcontact.job import Job, Stage
from parcontact.results.slide import absolute_errors, describe_slide, mean_errors, mean_over_end, measure_slide, ripple

REST = {"pressure": 1.0, "duration": 1.0, "time_step": 0.5}
CLIMB = {"pressure": 1.0, "velocity": 2.0, "duration": 0.5, "time_step": 0.1}
SETTLE = {"pressure": 1.0, "velocity": 2.0, "distance": 3.0, "cells_per_step": 1}
SLOW = {**CLIMB, "velocity": 0.5}
BACK = {**CLIMB, "velocity": -2.0}


def stages(*data: dict[str, Any]) -> list[Stage]:
    return [Stage.model_validate(one) for one in data]


def said(
    history: list[dict[str, Any]], table: dict[str, list[float]], cell: float = 0.1, free_area: float = 0.0, **more: Any
) -> list[str]:
    """The sentences about the slide of a job with such a history, on cells of a given number of metres."""
    data = {"grid": {"points": 8, "size": 8 * cell}, "surface": {"shape": "wave", "amplitude": 1e-9, "waves": [1, 1]}}
    material = {"model": "elastic", "shear_modulus": 1e6}
    job = Job.model_validate({**data, "material": material, "history": history, **more})
    return list(describe_slide(job.history, job.initial, job.grid.dx, table, free_area))


def rows(*rows: tuple[float, float, float]) -> dict[str, list[float]]:
    """Time, distance, friction; the area is one tenth of friction."""
    time, distance, friction = (list(column) for column in zip(*rows, strict=True))
    area = [value / 10 for value in friction]
    return {"time": time, "distance": distance, "friction": friction, "contact_area": area}


def test_mean_over_the_last_share() -> None:
    """Of a line over uneven steps, the value in the middle of the share; what was before does not matter."""
    x = np.array([1.0, 1.1, 1.7, 2.9, 3.0, 5.0])
    assert mean_over_end(x, 2.0 * x) == pytest.approx(2.0 * 3.5, rel=1e-14)
    assert mean_over_end(x, np.where(x < 2.0, 9.0, 1.0), 0.25) == pytest.approx(1.0, rel=1e-14)


def test_all_stages_at_one_velocity_are_one_slide() -> None:
    """From the last row before it; what friction was before, higher or not, is not of the slide."""
    table = rows((0, 0, 9), (1, 0, 8), (1.1, 0.2, 3), (1.5, 1, 4), (2.0, 2, 2), (3.0, 4, 2))
    found = measure_slide(stages(REST, CLIMB, SETTLE), table)
    assert found is not None
    assert (found.mu_max, found.mu_max_distance) == (4.0, 1.0)
    assert found.mu_dyn == pytest.approx((3.0 * 1 + 2.0 * 2) / 3, rel=1e-14)  # over the last 3 of 4 m
    assert found.contact_area == pytest.approx(found.mu_dyn / 10, rel=1e-14)
    assert math.isnan(found.contact_area_corrected)


@pytest.mark.parametrize(
    ("heavier", "way", "mean"), [(2.0, 3.0, 4.0625 / 2.25), ({"from": 1.0, "to": 2.0}, 2.0, 2.625 / 1.5)]
)
def test_a_slide_has_one_load(heavier: Any, way: float, mean: float) -> None:
    """Where a slide goes on under another load, results are those under the last one, or of the last ramp of load."""
    table = rows((0, 0, 9), (1, 0, 8), (1.5, 1, 4), (2.0, 2, 2), (2.5, 3, 1), (3.0, 4, 3))
    last = {**CLIMB, "pressure": heavier}
    found = measure_slide(stages(REST, CLIMB, last, {**last, "duration": 1.0}), table)
    assert found is not None
    assert (found.mu_max, found.mu_max_distance) == (3.0, way)
    assert found.mu_dyn == pytest.approx(mean, rel=1e-14)


def test_rows_that_the_box_cuts_off_do_not_count() -> None:
    """The results are those of the rows before, and no error is known: the slide is not whole."""
    table = rows((0, 0, 9), (1, 0, 8), (1.1, 0.2, 3), (1.5, 1, 4), (2.0, 2, 2), (3.0, 4, 7))
    table |= {"error_friction": [math.nan, 0.5, 0.02, 0.03, 0.01, math.nan], "error_area": [0.1] * 5 + [math.nan]}
    history, table["contact_area_corrected"] = stages(REST, CLIMB, SETTLE), table["contact_area"]
    short = {name: column[:-1] for name, column in table.items()}
    whole, before = measure_slide(history, table), measure_slide(history, short)
    assert whole is not None
    assert whole.mu_max == 7.0
    table["cut_off"] = [0, 0, 0, 0, 0, 1]
    assert measure_slide(history, table) == before
    assert absolute_errors(history, short, 0.1).keys() == {"mu_max", "mu_dyn", "contact_area"}
    assert absolute_errors(history, table, 0.1) == {}
    assert all(map(math.isnan, mean_errors(history, table).values()))
    first, *others = said([REST, CLIMB, SETTLE], table)
    assert first.startswith("in 1 of 5 rows of the slide the contact is cut off by the edge of the box")
    assert not any("±" in text or "error" in text for text in others)
    table["cut_off"] = [0, 1, 1, 1, 1, 1]
    found = measure_slide(history, table)
    assert found is not None
    assert all(map(math.isnan, found))
    assert len(said([REST, CLIMB, SETTLE], table)) == 1


def test_the_error_of_the_highest_friction_may_be_unknown() -> None:
    """As in the row of a snap: it is not 0."""
    table = rows((0, 0, 0), (0.5, 1, 4), (1.0, 2, 2)) | {"error_friction": [math.nan, math.nan, 0.01]}
    assert math.isnan(absolute_errors(stages({**CLIMB, "duration": 1.0}), table, 0.1)["mu_max"])


@pytest.mark.parametrize("before", [SLOW, BACK])
def test_another_velocity_before_is_another_slide(before: dict[str, Any]) -> None:
    table = rows((0, 0, 9), (0.5, 1, 8), (0.6, 1.2, 3), (1.0, 2.0, 3))
    found = measure_slide(stages(before, CLIMB), table)
    assert found is not None
    assert (found.mu_max, found.mu_max_distance, found.mu_dyn) == (3.0, pytest.approx(0.2), pytest.approx(3.0))


def test_what_comes_after_the_slide_is_not_of_it() -> None:
    table = rows((0, 0, 2), (0.25, 0.5, 2), (0.5, 1, 2), (1.0, 1, 5), (1.5, 1, 5))
    found = measure_slide(stages(CLIMB, REST), table)
    assert found is not None
    assert (found.mu_max, found.mu_dyn) == (2.0, pytest.approx(2.0))


def test_sentences_about_a_slide() -> None:
    """Each number with what it is; errors as far as they are known, the largest of the slide alone."""
    table = rows((0, 0, 9), (1, 0, 8), (1.1, 0.2, 3), (1.5, 1, 4), (2.0, 2, 2), (3.0, 4, 2))
    table["error_friction"] = [float("nan"), 0.5, 0.02, 0.03, float("nan"), 0.01]  # 0.12, 0, 0.02 at 1, 2, 4 m
    assert said([REST, CLIMB, SETTLE], table) == [
        "mu_max, the highest friction of the slide, is 4.00 ± 0.12, 1 m after its start",
        "mu_dyn, the mean friction over the last three quarters of this slide of 4 m, is 2.333 ± 0.027",
        "the mean contact area over the same distance is 0.2333 by counting points",
        "largest estimated errors of single steps of the slide: friction 3 %",
    ]
    assert not said([REST], table)
    table |= {"flash_temperature": [0.0, 9.0, 0.5, 0.5, 0.5, 0.5], "max_temperature": [0.0, 9.0, 2.0, 3.0, 1.0, 1.0]}
    assert "the mean flash temperature over the same distance is 0.5 K, at most 3 K at a point" in said(
        [REST, CLIMB, SETTLE], table
    )


def test_forces_of_a_slide_under_no_load() -> None:
    """Surfaces that stick have forces where friction is not defined: the largest and the mean are stated."""
    table = rows((0, 0, 0), (1, 0, 0), (1.5, 1, 0), (2.0, 2, 0), (3.0, 4, 6))
    table |= {"force_x": [9.0, 9.0, -3.0, 0.0, -1.0], "force_y": [0.0, 0.0, 4.0, 2.0, 0.0]}
    found = measure_slide(stages(REST, CLIMB, SETTLE), table)
    assert found is not None
    assert math.isnan(found.mu_max + found.mu_dyn)
    (force, *_), where = said([REST, CLIMB, SETTLE], table), "in 2 of 3 steps of the slide, which have no load"
    mean = "5 N at most, and 2.17 N on average"  # 3.5 over a metre, 1.5 over two
    assert force.startswith(f"friction is not defined {where}, and is 0 in the table: the tangential force is {mean}")
    table |= {"force_x": [9.0, 9.0, 0.0, 0.0, -1.0], "force_y": [0.0] * 5}  # no force, as where nothing touches
    assert said([REST, CLIMB, SETTLE], table)[0].startswith("mu_max, the highest friction of the slide, is 6")


def test_sentences_about_a_slide_that_others_follow() -> None:
    """As long as the last slide has not begun; then the sentences are about that one."""
    table = rows((0, 0, 9), (1, 0, 8), (1.5, 1, 4), (2.0, 2, 2))
    history = [REST, CLIMB, REST, {**CLIMB, "velocity": 3.0}]
    stated = said(history, table)
    assert stated[0] == "the last slide has not begun; these numbers are of the previous one, ending with history.1"
    assert stated[1:] == said(history[:2], table)
    assert measure_slide(stages(*history), table) is None
    assert len(said([REST, CLIMB, SETTLE], rows((0, 0, 9), (1, 0, 8), (1.2, 0.4, 5)))) == 3
    begun = rows((0, 0, 9), (1, 0, 8), (1.5, 1, 2), (2.5, 1, 1), (3.0, 2.5, 7))
    late = "1.5 m after its start, in its last tenth: friction may still rise"
    assert said(history, begun)[0] == f"mu_max, the highest friction of the slide, is 7, {late}"


def test_mu_max_on_a_ripple() -> None:
    """Of a height of 1 and the period of the cell, in steps of an eighth of it: its mean over a cell is 1 less, by
    trapezoids to round-off. Steps of a cell do not show it, and the rise in the first cell of a slide is none."""
    x = np.arange(0.0, 4.0 + 1e-9, 0.125)
    friction = 5.0 + np.cos(2 * np.pi * x)
    assert ripple(x, friction, 16, 1.0) == pytest.approx(1.0, rel=1e-12)
    assert ripple(x[::8], friction[::8], 2, 1.0) == 0.0
    assert ripple(x, np.minimum(x, 1.25 - x / 2.0), 6, 1.0) == 0.0
    table = rows(*zip(x / 2.0, x, friction, strict=True))
    stated = said([{**CLIMB, "duration": 2.0}], table, 1.0)[0]
    assert "is 6.0 ± 1.0 (1 of it a ripple with the period of a cell), " in stated


def test_a_steady_start_that_does_not_last() -> None:
    """The slide that goes on from it has the same friction; a difference beyond the errors of both is stated, one
    within them is not, nor one to a slide under another load."""
    start: Any = {"initial": {"state": "steady", "velocity": 2.0, "pressure": 1.0}}
    table = rows((0, 0, 3), (0.25, 0.5, 4), (0.5, 1, 4))
    table["error_friction"] = [0.1, 0.1, 0.1]  # of 3, and of the slide's 3.92
    text = "mu_dyn differs from friction of the steady start, 3, by 0.92, more than their estimated errors together, "
    assert said([CLIMB], table, **start)[-1].startswith(text)
    assert "left" not in said([{**CLIMB, "pressure": 2.0}], table, **start)[-1]
    table["error_friction"] = [0.2, 0.2, 0.2]
    assert "left" not in said([CLIMB], table, **start)[-1]


def test_the_area_whose_error_is_stated_and_friction_that_is_all_error() -> None:
    """The corrected area stands next to the counted one; an error of more than all of friction is said to be that."""
    table = rows((0, 0, 3), (0.25, 0.5, 4), (0.5, 1, 4))
    table["contact_area_corrected"] = [0.8 * area for area in table["contact_area"]]
    table["error_friction"] = [float("nan"), 0.1, 1.1]
    stated = said([CLIMB], table)
    area = "the mean contact area over the same distance is 0.3133 corrected for its edges, "
    assert f"{area}and 0.3917 by counting points" in stated
    in_free_box = f"{area.replace('0.3133', '1.253 mm²')}and 1.567 mm² by counting points"
    assert in_free_box in said([CLIMB], table, free_area=4e-6)
    assert "largest estimated errors of single steps of the slide: friction unknown" in stated
    assert stated[-1] == "in some steps of the slide friction is smaller than its estimated error"
