"""Tractive rolling: closed forms of Carter and Kalker, limits of rubber, energies, and jobs that are refused."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marched_jobs import column, marched

from parcontact.errors import InputError
from parcontact.files.recorder import StepRow
from parcontact.job import load

G, RADIUS, HALF_WIDTH, MU = 1e6, 1e-2, 1e-4, 0.5
LOAD = 1e-3  # of a ball [N]
LINE_LOAD = math.pi * G * HALF_WIDTH**2 / RADIUS  # Hertz, load [N/m] of a cylinder on an incompressible half space
FULL = MU * HALF_WIDTH / RADIUS  # creep at which all slips (F. W. Carter, 1926)
ELASTIC = {"model": "elastic", "shear_modulus": G, "poisson": 0.5}


def cylinder(creep: Any, cells: int = 8, material: Any = ELASTIC, stiffer: float = 1.0, **more: Any) -> dict[str, Any]:
    """A cylinder that rolls over 12 half-widths of its contact in steps of a cell, on one row of points, in a box of 16
    half-widths. The load is `stiffer` times as large, as for a body that is as much stiffer."""
    cell, size = HALF_WIDTH / cells, 16 * HALF_WIDTH
    press = {"pressure": stiffer * LINE_LOAD / size}
    roll = {**press, "velocity": 1.0, "distance": 12 * HALF_WIDTH, "cells_per_step": 1, "creep": creep}
    return {
        "grid": {"points": [16 * cells, 1], "size": [size, cell]},
        "surface": {"shape": "cylinder", "radius": RADIUS},
        "material": material,
        "interface": {"coefficient": MU, "stick": True},
        "history": [press, roll],
        "numerics": {"tolerance": 1e-4, "branch_error": 0.0},
        **more,
    }


def carter(creep: float) -> float:
    """Traction over that of sliding, for a creep over the one at which all slips."""
    return 1.0 - (1.0 - min(creep, 1.0)) ** 2


@pytest.mark.parametrize(("share", "across"), [(0.02, 0), (1.0 - math.sqrt(0.5), 0), (0.8, 0), (0.3, 1), (1.2, 0)])
def test_carter(share: float, across: int) -> None:
    """The error is of first order in the step over the half-width, at most 6.5 % of the force with 8 steps.
    Extrapolated to short steps the force is right to 0.5 %, of which the box makes 0.2 %. The zone that sticks is right
    to a cell. Errors that are stated are at least as large, and at most 2.5 times as large. Across the velocity the
    theory holds with twice the creep, as tractions across a wave have twice the compliance of those along it."""
    exact, errors = carter(share), []
    for cells in (8, 16):
        creep = [0.0, 2.0 * share * FULL] if across else share * FULL
        march, rows = marched(cylinder(creep, cells))
        last = rows[-1]
        force = -(last.measures.force_y if across else last.measures.force_x)
        errors.append(force / (MU * LINE_LOAD * HALF_WIDTH / cells) / exact - 1.0)
        sticking = last.added[2] * march.scene.slab.points / cells / 2.0
        assert sticking == pytest.approx(math.sqrt(1.0 - exact), abs=1.0 / cells)
        assert last.errors is not None
        assert last.errors.friction is not None
        stated = last.errors.friction.time
        assert stated / 2.5 <= abs(errors[-1]) <= stated + 1e-6
    if share < 1.0:
        assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.15)
    assert abs(2.0 * errors[1] - errors[0]) < 5e-3


def ball(velocity: list[float], creep: list[float], mu: float, radii: int) -> tuple[StepRow, float]:
    """The last row of a ball that rolls over some radii of its contact, with 8 cells in the radius, along x or against
    y, and the area of its contact [m^2]."""
    radius = (3.0 * LOAD * RADIUS / (16.0 * G)) ** (1.0 / 3.0)
    points, center = [8 * (radii + 3), 24], [1.5 * radius, 1.5 * radius]
    if velocity[1]:
        points, center = points[::-1], [center[0], (radii + 1.5) * radius]
    size = [count * radius / 8.0 for count in points]
    roll = {"velocity": velocity, "distance": radii * radius, "cells_per_step": 1, "creep": creep}
    job = {
        "grid": {"points": points, "size": size, "boundary": "free"},
        "surface": {"shape": "sphere", "radius": RADIUS, "center": center},
        "material": ELASTIC,
        "interface": {"coefficient": mu, "stick": True},
        "history": [{"force": LOAD}, {"force": LOAD, **roll}],
        "numerics": {"tolerance": 1e-3},
    }
    last = marched(job)[1][-1]
    return last, last.measures.contact_area * size[0] * size[1]


@pytest.mark.parametrize(
    ("velocity", "creep", "coefficient"), [([1.0, 0.0], [1e-4, 0.0], 5.20), ([0.0, -1.0], [0.0, 1e-4], 3.98)]
)
def test_coefficients_of_kalker(velocity: Any, creep: Any, coefficient: float) -> None:
    """Without slip a ball has the force `2 G a^2 C creep` on one elastic body (J. J. Kalker, Three-Dimensional Elastic
    Bodies in Rolling Contact, 1990, table E.3, three digits), C along the velocity and across it. With 8 cells in the
    radius it is right to 3 % with the area of the contact that is found, and with 24 cells to 0.7 %."""
    last, area = ball(velocity, creep, 1e9, 12)
    assert last.added[2] == last.measures.contact_area
    expected = 2.0 * G * area / math.pi * coefficient * 1e-4  # along +x in both cases: to the left of -y is +x
    assert -last.measures.force_x == pytest.approx(expected, rel=0.03)
    assert abs(last.measures.force_y) < 1e-3 * expected


def test_ball_that_slips_everywhere() -> None:
    """With fifty times the creep at which all slips, slip is along the creep to the squares of angles of a hundredth,
    and the force is the coefficient times the load."""
    last, _ = ball([1.0, 0.0], [0.3, 0.0], MU, 2)
    assert last.added[2] == 0.0
    assert -last.measures.force_x == pytest.approx(MU * LOAD, rel=1e-3)


@pytest.mark.parametrize(("time", "stiffer"), [(1e3, 5.0), (1e-10, 1.0)])
def test_slow_and_fast_limits_of_rubber(time: float, stiffer: float) -> None:
    """Rubber that relaxes far slower, or far faster, than the contact rolls by has at all steps the tractions of an
    elastic body with the modulus at once, or after long."""
    rubber = {"model": "zener", "modulus_inf": G, "branches": [{"modulus": 4 * G, "relaxation_time": time}]}
    job = cylinder(0.3 * FULL, material=rubber, stiffer=stiffer)
    if stiffer == 1.0:
        job["history"][:1] = [{**job["history"][0], "duration": 1e-6, "time_step": {"first": 1e-11, "growth": 2.0}}]
    elastic = cylinder(0.3 * FULL, material={**ELASTIC, "shear_modulus": stiffer * G}, stiffer=stiffer)
    found, limit = (column(marched(each)[1], "force_x")[-96:] for each in (job, elastic))
    assert found == pytest.approx(limit, rel=1e-3, abs=0.0)


@pytest.mark.parametrize("creep", [(0.3, 0.0), (-0.3, 0.2)])
def test_power_lost_in_slip(creep: Any) -> None:
    """An elastic body that has reached steady rolling stores nothing more: slip loses the force of the tractions times
    the creep times the way, to 2e-5, as after 12 half-widths forces still change by 1e-6 in a step."""
    moved = np.array(creep) * FULL
    rows = marched(cylinder(moved.tolist(), output={"energy": True}, numerics={"tolerance": 1e-6}))[1]
    before, last = rows[-2:]
    lost = (
        -0.5
        * HALF_WIDTH
        / 8
        * sum(
            part * (getattr(before.measures, name) + getattr(last.measures, name))
            for part, name in zip(moved, ("force_x", "force_y"), strict=True)
        )
    )
    assert last.added[3] - before.added[3] == pytest.approx(lost, rel=2e-5, abs=0.0)


def test_energies_of_rubber() -> None:
    """The wheel does work against its rolling resistance over the way, and with the tractions over the way of its
    points: 0.3 % from the work on the body, by the trapezoidal rule over edges that move by a cell. Driving reverses
    the tractions and leaves the resistance."""
    rubber = {"model": "zener", "modulus_inf": G, "branches": [{"modulus": 4 * G, "relaxation_time": 1e-4}]}
    brakes, drives = (
        marched(cylinder(creep, material=rubber, output={"energy": True}))[1] for creep in (0.003, -0.003)
    )
    rows, outside = brakes[48:], 0.0
    for old, new in pairwise(rows):
        viscous, traction = ([row.added[one] * row.measures.normal_force for row in (old, new)] for one in (0, 1))
        outside += 0.5 * HALF_WIDTH / 8 * (sum(viscous) + 0.003 * sum(traction))
    last, first = rows[-1], rows[0]
    outside += last.measures.normal_force * (first.measures.mean_gap - last.measures.mean_gap)
    assert outside == pytest.approx(last.work - first.work, rel=5e-3, abs=0.0)
    assert last.work == pytest.approx(last.stored + last.dissipated + last.added[3], rel=1e-10, abs=0.0)
    assert last.added[1] == pytest.approx(drives[-1].added[1], rel=1e-6)
    assert last.added[0] == pytest.approx(-drives[-1].added[0], rel=1e-6)
    assert drives[-1].measures.force_x > 0.0 > last.measures.force_x


def test_heat_of_rolling() -> None:
    """A roller on rubber heats it as a rigid surface that slides without friction of the interface does, and by the
    energy lost in slip, to rounding: the force of the tractions has no power over the way of the contact."""
    rubber = {"model": "zener", "modulus_inf": G, "branches": [{"modulus": 4 * G, "relaxation_time": 1e-4}]}
    rolls = cylinder(
        0.001, material=rubber, thermal={"conductivity": 0.2, "diffusivity": 1e-7}, output={"energy": True}
    )
    slides = {key: value for key, value in rolls.items() if key != "interface"}
    slides["history"] = [{key: value for key, value in stage.items() if key != "creep"} for stage in rolls["history"]]
    marches = [marched(each) for each in (rolls, slides)]
    heat, other = (march.state.memories["thermal"].heat.mean.stored for march, _ in marches)
    lost = marches[0][1][-1].added[3] / (2.0 * HALF_WIDTH**2)
    assert heat - other == pytest.approx(lost, rel=1e-6, abs=0.0)
    assert heat > 1.05 * other > 0.0


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (", stick: true", "", "interface.coefficient needs stick: true"),
        ("interface: {coefficient: 0.5, stick: true}\n", "", "history.0.creep needs interface: {stick: true}"),
        (
            "flat",
            "rough, hurst: 0.8, rms_slope: 0.1, long_wavelength: 1.0e-3, short_wavelength: 5.0e-4, seed: 1",
            "smooth",
        ),
        ("cells_per_step: 1, ", "", "history.0.creep needs cells_per_step or a time_step"),
        (
            "velocity: 1.0, distance: 1.0e-4, cells_per_step: 1",
            "duration: 1.0, time_step: 1.0",
            "creep needs a velocity",
        ),
        ("0.01", "[0.01, a]", "history.0.creep.1 must be a creep [-] from -1000 to 1000: a number"),
    ],
)
def test_mistakes(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    text = (
        "grid: {points: 8, size: 1.0e-3}\nsurface: {shape: flat}\n"
        "material: {model: elastic, shear_modulus: 1.0e6, poisson: 0.5}\ninterface: {coefficient: 0.5, stick: true}\n"
        "history: [{pressure: 1.0e4, velocity: 1.0, distance: 1.0e-4, cells_per_step: 1, creep: 0.01}]\n"
    )
    path = tmp_path / "job.yaml"
    path.write_text(text)
    assert load(path).history[0].creep == (0.01, 0.0)
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=r"job.yaml:\d+:\d+") as failure:
        load(path)
    assert sentence in str(failure.value)
