"""Any units, any datum of heights: everything inside a run is dimensionless and counted from the surface's mean."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marching import column, marched
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from parcontact.march import March
from parcontact.parallel.slab import Array
from parcontact.record.row import Row

Json = dict[str, Any]
NUMBERS = ("pressure", "force_x", "force_y", "friction", "contact_area", "mean_gap", "max_pressure")


def job(
    heights: NDArray[np.float64], where: Path, load: Json, size: float = 1e-3, modulus: float = 1e6, **numerics: Any
) -> Json:
    """A ramp, a jump and sliding, oblique and by fractions of cells, on a file of heights [m]."""
    np.save(where / "heights.npy", heights)
    ny, nx = heights.shape
    branches = [{"modulus": 3 * modulus, "relaxation_time": 1e-3}, {"modulus": modulus, "relaxation_time": 1e2}]
    (name, value), *_ = load.items()
    return {
        "grid": {"points": [nx, ny], "size": [size, size * ny / nx]},
        "surface": [{"shape": "file", "path": str(where / "heights.npy")}],
        "material": {"model": "zener", "modulus_inf": modulus, "branches": branches},
        "history": [
            load,
            {**load, "duration": 1e-2, "time_step": {"first": 1e-5, "growth": 5.0}},
            {name: 0.7 * value, "duration": 1e-3, "velocity": [20 * size, 7 * size], "time_step": 2.5e-4},
        ],
        "numerics": {"accuracy": 0.0, **numerics},
        "output": {"energy": True},
    }


def noise(height: float, shape: tuple[int, int] = (12, 20)) -> NDArray[np.float64]:
    """Heights that are multiples of a power of two far below them, so that adding a constant rounds nothing away."""
    raw = np.random.default_rng(3).standard_normal(shape) * height
    unit = 2.0 ** np.floor(np.log2(height) - 20)
    return np.round((raw - raw.mean()) / unit) * unit


def pressures(data: Json) -> tuple[list[Array], list[Row]]:
    """Maps and rows of every step."""
    maps: list[Array] = []

    def keep(march: March) -> None:
        maps.append(march.field("pressure"))

    _, rows = marched(data, [keep])
    return maps, rows


# -- the datum of heights ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("precision", ["double", "mixed", "single"])
@pytest.mark.parametrize("offset", [1.0, -1.0])
def test_a_constant_of_a_million_times_the_roughness(precision: str, offset: float, tmp_path: Path) -> None:
    """In the file itself: the same pressures as without, to 1e-9 of the highest in double precision and to 1e-3 in
    single precision, whose own 7 digits could not even hold both."""
    numerics: Json = {"precision": precision, "tolerance": 1e-10 if precision == "double" else 1e-4}
    heights = noise(2.0**-20)
    constant = offset * 1e6 * 2.0**-20
    expected, rows = pressures(job(heights, tmp_path, {"pressure": 3e4}, **numerics))
    found, shifted = pressures(job(heights + constant, tmp_path, {"pressure": 3e4}, **numerics))
    for p, q in zip(expected, found, strict=True):
        assert_allclose(q, p, rtol=0, atol=(1e-9 if precision == "double" else 1e-3) * p.max())
    assert_allclose(column(shifted, "approach")[1:], column(rows, "approach")[1:] - constant, rtol=1e-9)


def test_an_approach_counts_from_the_heights_as_they_are_given(tmp_path: Path) -> None:
    """With the constant in another shape: the same pressures at an approach that is lower by it, to rounding."""
    heights, constant = noise(2.0**-20), 2.0**-10
    plain = job(heights, tmp_path, {"approach": -0.5 * float(heights.max())}, tolerance=1e-8)
    plain["history"] = plain["history"][:2]
    raised = {**plain, "surface": [*plain["surface"], {"shape": "wave", "amplitude": constant, "waves": [0, 0]}]}
    raised["history"] = [{**stage, "approach": stage["approach"] - constant} for stage in plain["history"]]
    expected, rows = pressures(plain)
    found, shifted = pressures(raised)
    for p, q in zip(expected, found, strict=True):
        assert_allclose(q, p, rtol=0, atol=1e-9 * p.max())
    assert_allclose(column(shifted, "approach")[1:], column(rows, "approach")[1:] - constant, rtol=1e-12)


@pytest.mark.parametrize("constant", [-5.456776130597596e-06, 1e3, 3e-30])
def test_a_flat_file_is_flat(constant: float, tmp_path: Path) -> None:
    """Whatever its height: what rounding leaves of it is no roughness to be resolved."""
    heights = np.full((31, 2), constant)
    data = job(heights, tmp_path, {"pressure": 2e-8}, modulus=1e13)
    data["grid"]["size"] = [1e-3, 2e-4]
    march, rows = marched(data)
    assert march.scene.frame.height == march.scene.job.grid.dy  # the shorter side of a cell, whichever that is
    assert all(row.iterations == 0 for row in rows)
    assert_allclose(march.field("pressure"), 1.4e-8, rtol=1e-9)
    # an approach that just touches is full contact, but for rounding, and not beyond it
    march, rows = marched({**data, "history": [{"approach": -constant}, {"pressure": 1.0}]})
    assert_allclose(march.field("pressure"), 1.0, rtol=1e-9)


# -- the datum of time -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("step", [2.5e-12, {"first": 1e-15, "growth": 10.0}])
def test_a_short_stage_late_in_a_history(step: Any, tmp_path: Path) -> None:
    """After 300 years an instant has no digits for picoseconds, a step must have them all: the body then does what it
    does after a day, its memory being of 10 ps. To 1e-6 of the work, with solves to 1e-10."""

    def work(rest: float) -> NDArray[np.float64]:
        data = job(noise(2.0**-20), tmp_path, {"pressure": 3e4}, tolerance=1e-10)
        data["material"]["branches"] = [{"modulus": 3e6, "relaxation_time": 1e-11}]
        short = {"pressure": {"from": 3e4, "to": 5e4}, "duration": 1e-11, "time_step": step}
        data["history"] = [{"pressure": 3e4, "duration": rest, "time_step": rest}, short]
        _, rows = marched(data)
        return column(rows, "work")[3:] - rows[2].work

    assert_allclose(work(1e10), work(1e5), rtol=1e-6)
