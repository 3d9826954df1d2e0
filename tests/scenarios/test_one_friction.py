"""Friction is one thing in marches, steady states and theory: the force along the sliding over the normal one."""

import csv
import json
import math
from pathlib import Path
from typing import Any

import pytest
from marching import marched

import parcontact as pc
from parcontact.effects.interface import shares

BODY = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 9e6, "relaxation_time": 1e-3}]}
RIDGES = {"shape": "wave", "amplitude": 2e-8, "waves": [4, 0]}  # all of them touch
SPEED, PRESSURE, POINTS = 0.1, 1e5, 32
DIRECTION = (1.0 / math.sqrt(10.0), 3.0 / math.sqrt(10.0))
VELOCITY = [SPEED * each for each in DIRECTION]


def job(**sections: Any) -> dict[str, Any]:
    """Ridges along y that slide obliquely: all force is along x, and most of it across the sliding."""
    return {
        "grid": {"points": POINTS, "size": 1e-3},
        "surface": RIDGES,
        "material": BODY,
        "history": [{"pressure": PRESSURE, "velocity": VELOCITY, "distance": 2e-3, "cells_per_step": 0.25}],
        "numerics": {"tolerance": 1e-9},
        **sections,
    }


@pytest.fixture(scope="module")
def exact() -> tuple[float, float]:
    """Friction, and the force along x over the normal one, q^2 h0^2 G''(q v_x)/P0: a wave of amplitude h0 has the
    pressure 2 q |G| h0 on an incompressible body."""
    q = 4 * 2.0 * math.pi / 1e-3
    turn = q * VELOCITY[0] * 1e-3
    along_x = (q * 2e-8) ** 2 * 9e6 * turn / (1.0 + turn**2) / PRESSURE
    return along_x * DIRECTION[0], along_x


@pytest.mark.parametrize("stress", [0.0, 2e3])
def test_marches_and_steady_states(stress: float, exact: tuple[float, float]) -> None:
    """Of all columns, to 1 % for the steps of the march; an interface adds its shear stress over the pressure along the
    sliding."""
    friction, along_x = exact
    more = {"interface": {"shear_stress": stress}} if stress else {}
    added = stress / PRESSURE
    steady = {"velocities": [SPEED], "direction": list(DIRECTION)}
    curve = pc.steady(job(**more, steady=steady), velocities=[SPEED], pressures=[PRESSURE])
    assert curve.friction[0] == pytest.approx(friction + added, rel=1e-6)
    assert curve.friction_slopes[0] == pytest.approx(friction + added, rel=1e-6)
    assert curve.force_x[0] / (-PRESSURE * 1e-6) == pytest.approx(along_x + added * DIRECTION[0], rel=1e-6)
    _, rows = marched(job(**more))
    last = rows[-1].measures
    assert last.friction == pytest.approx(friction + added, rel=0.01)
    assert last.friction_x == pytest.approx(along_x + added * DIRECTION[0], rel=0.01)
    assert sum(shares(last, (VELOCITY[0], VELOCITY[1]))) == pytest.approx(last.friction, rel=1e-12)
    begun = marched(job(**more, initial={"state": "steady", "velocity": VELOCITY, "pressure": PRESSURE}))[1][0].measures
    assert begun.friction == pytest.approx(friction + added, rel=1e-6)


def test_columns_of_both_tables(tmp_path: Path, exact: tuple[float, float], main: Any) -> None:
    """friction_x of steady.csv is -force_x over the normal force, as in measures.csv."""
    friction, along_x = exact
    (tmp_path / "job.yaml").write_text(json.dumps(job(steady={"velocities": [SPEED], "direction": list(DIRECTION)})))
    assert main("steady", "job.yaml", "--out", "out", "--quiet", "--pressures", f"{PRESSURE:g}")[0] == 0
    with (tmp_path / "out" / "steady.csv").open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert float(row["friction"]) == pytest.approx(friction, rel=1e-6)
    assert float(row["friction_x"]) == pytest.approx(along_x, rel=1e-6)
    assert float(row["friction_x"]) == pytest.approx(-float(row["force_x"]) / (PRESSURE * 1e-6), rel=1e-6)
