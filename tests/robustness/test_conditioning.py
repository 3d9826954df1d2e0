"""Any units, any datum of heights: everything inside a run is dimensionless and counted from the surface's mean."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marched_jobs import column, marched
from mpi4py import MPI
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from parcontact.contact import kernels
from parcontact.files.recorder import StepRow
from parcontact.march.laws import StepError
from parcontact.march.loop import March
from parcontact.parallel.slab import Array, Slab
from parcontact.physics import loops

from . import twins
from .scenes import Sketch
from .witness import witness

Json = dict[str, Any]


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
        "numerics": {"branch_error": 0.0, **numerics},
        "output": {"energy": True},
    }


def noise(height: float, shape: tuple[int, int] = (12, 20)) -> NDArray[np.float64]:
    """Heights that are multiples of a power of two far below them, so that adding a constant rounds nothing away."""
    raw = np.random.default_rng(3).standard_normal(shape) * height
    unit = 2.0 ** np.floor(np.log2(height) - 20)
    return np.round((raw - raw.mean()) / unit) * unit


def pressures(data: Json) -> tuple[list[Array], list[StepRow]]:
    """Maps and rows of every step."""
    maps: list[Array] = []

    def keep(march: March) -> None:
        maps.append(march.field("pressure"))

    _, rows = marched(data, [keep])
    return maps, rows


# -- units -------------------------------------------------------------------------------------------------------------

SCENE = Sketch(
    heights=noise(2.0**-20),
    size=(1e-3, 6e-4),
    boundary="periodic",
    material={
        "model": "zener",
        "modulus_inf": 1e6,
        "branches": [{"G0": 3e6, "G1": 0.5e6, "eta1": 3e3}, {"modulus": 1e6, "relaxation_time": 10.0}],
    },
    history=(
        {"pressure": 3e4},
        {"pressure": {"from": 3e4, "to": 9e4}, "duration": 1e-2, "time_step": {"first": 1e-5, "growth": 5.0}},
        {"force": 2e-2, "velocity": [2e-2, -7e-3], "duration": 1e-3, "time_step": 2.5e-4},
        {"pressure": 0.0, "duration": 1.0, "time_step": 0.5},
        {"approach": -1e-6},
    ),
    numerics={"tolerance": 1e-10, "branch_error": 0.0},
)


@pytest.mark.parametrize(
    ("length", "modulus", "time"),
    [
        (1e-6, 1e3, 1e-12),  # nanometres, gigapascals, femtoseconds
        (1e6, 1e-6, 1e12),  # kilometres, pascals, ages of the earth
        (1e-6, 1e-6, 1.0),
        (1e6, 1e3, 1e-9),
        (3.0, 7.0, 1 / 3),  # no powers of two or ten
    ],
)
@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_extreme_units(length: float, modulus: float, time: float, boundary: str, tmp_path: Path) -> None:
    """Nanometres and gigapascals, kilometres and pascals: as many iterations, and the same digits. The inner numbers
    differ by less than a factor of two and by rounding; solves to 1e-10 make pressures agree to 1e-9 of the highest."""
    plain = replace(SCENE, boundary=boundary)
    other, stated = twins.rescaled(plain, length, modulus, time)
    one, two = witness(plain, tmp_path), witness(other, tmp_path)
    assert one.violations == two.violations == []
    assert one.failure == two.failure == ""
    assert one.pressures.keys() == two.pressures.keys()
    for step, p in one.pressures.items():
        assert_allclose(stated(two.pressures[step]), p, rtol=0, atol=1e-9 * max(p.max(), 1e-300))
    energy = modulus * length**3
    for name in ("work", "stored", "dissipated"):
        assert_allclose(getattr(two.last, name) / energy, getattr(one.last, name), rtol=1e-9)
    assert two.iterations == pytest.approx(one.iterations, abs=1)


# -- the datum of heights ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("constant", [-5.456776130597596e-06, 1e3, 3e-30])
def test_a_flat_file_is_flat(constant: float, tmp_path: Path) -> None:
    """Whatever its height: what rounding leaves of it is no roughness to be resolved."""
    heights = np.full((31, 2), constant)
    data = job(heights, tmp_path, {"pressure": 2e-8}, modulus=1e13)
    data["grid"]["size"] = [1e-3, 2e-4]
    march, rows = marched(data)
    assert march.scene.setup.height == march.scene.job.grid.dy  # the shorter side of a cell, whichever that is
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


# -- sums over all points ----------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize(("nx", "ny"), [(2048, 512), (3, 400_000), (400_000, 3)])
def test_sums_over_large_maps(communicators: list[MPI.Intracomm], nx: int, ny: int) -> None:
    """Of a million positive numbers over 12 decades, against extended precision, on any number of ranks: to a rounding
    for each number of a row and each row, at most, and to the last bit the same on all of them."""
    whole = 10.0 ** np.random.default_rng(1).uniform(-12.0, 0.0, (ny, nx))
    exact = float(np.sum(whole, dtype=np.longdouble))
    squares = float(np.sum(whole.astype(np.longdouble) ** 2))
    for comm in communicators:
        slab = Slab(comm, nx, ny)
        own = np.ascontiguousarray(whole[slab.rows])
        found = slab.sum(
            kernels.sum_of(own), loops.dot(own, own), *kernels.contact_sums(own, own, own, -1.0, 0.0, np.inf)
        )
        assert_allclose(found[:5], [exact, squares, exact, squares, exact], rtol=(nx + ny) * np.finfo(float).eps)
        assert {tuple(other) for other in comm.allgather(found)} == {tuple(found)}


# -- what no digits are left for ---------------------------------------------------------------------------------------


def test_a_fluid_under_a_load_for_ages_says_why_it_fails(tmp_path: Path) -> None:
    """The modulus of the step falls to 1e-16 of its first value: the load is then so far beyond full contact that the
    last digit of a pressure outweighs all differences between points."""
    data = job(noise(2.0**-20), tmp_path, {"pressure": 1e3}, tolerance=1e-6)
    data["material"] = {"model": "zener", "modulus_inf": 0.0, "branches": [{"modulus": 1e6, "relaxation_time": 1e-6}]}
    data["history"] = [{"pressure": 1e3}, {"pressure": 1e3, "duration": 1e10, "time_step": 1e10}]
    with pytest.raises(StepError, match=r"double precision reaches only about .* here: look for heights, loads or"):
        marched(data)
