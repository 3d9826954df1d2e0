"""A surface that slides on a viscoelastic body: order in time, energies, directions."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from closed_forms import step_responses
from conftest import Main
from marched_jobs import JOBS, PRONY, SLS, column, example, marched
from mpi4py import MPI
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from sliding import CELL, FAST, HEIGHT, MEAN, PRESS, WAVELENGTH, Json, K, rough, slide, wave

import parcontact as pc
from parcontact.files import tables
from parcontact.files.recorder import StepRow
from parcontact.march.loop import March
from parcontact.physics.prony import Integrator
from parcontact.theory import wavy


def moving(kind: str, steps: int, jump: bool, integrator: Integrator) -> StepRow:
    """A sphere, or crossed waves, in partial contact for 4 ms, with half the load from the middle on if `jump`."""
    halves = [(2e-3, 1.0), (2e-3, 0.5 if jump else 1.0)]
    step = {"time_step": 4e-3 / steps, "velocity": 0.04}
    data: Json = {
        "material": SLS,
        "numerics": {"tolerance": 1e-9, "integrator": integrator},
        "output": {"energy": True},
    }
    if kind == "sphere":
        data["grid"] = {"points": 64, "size": 3e-3, "boundary": "free"}
        data["surface"] = {"shape": "sphere", "radius": 1e-2}
        data["history"] = [{"force": 0.15 * share, "duration": t, **step} for t, share in halves]
    else:
        data["grid"] = {"points": 32, "size": WAVELENGTH}
        crossed = [(5e-7, [1, 0]), (3e-7, [0, 1])]
        data["surface"] = [{"shape": "wave", "amplitude": a, "waves": w} for a, w in crossed]
        data["history"] = [{"pressure": 2e4 * share, "duration": t, **step} for t, share in halves]
    return marched(data)[1][-1]


@pytest.mark.parametrize(("integrator", "order"), [("exponential-linear", 2.0), ("backward-euler", 1.0)])
@pytest.mark.parametrize(("kind", "jump"), [("sphere", True), ("waves", False)])
def test_order_in_a_moving_contact(kind: str, jump: bool, integrator: Integrator, order: float) -> None:
    """Friction and dissipation from differences of three step lengths, though points come and go: order to 0.2."""
    fewest = 40 if order > 1.0 else 80
    rows = [moving(kind, times * fewest, jump, integrator) for times in (1, 2, 4)]
    for name in ("friction", "dissipated"):
        coarse, middle, fine = column(rows, name)
        assert np.log2((middle - coarse) / (fine - middle)) == pytest.approx(order, abs=0.2)
        assert fine == pytest.approx(middle, rel=5e-3)


@pytest.mark.parametrize(("kind", "jump"), [("sphere", True), ("waves", False)])
def test_quadratic_steps_in_a_moving_contact(kind: str, jump: bool) -> None:
    """Order 3 of the dissipation, in the mean over three halvings from twenty steps on: to 0.3, as points come and go.
    Friction changes by less than 2e-4, where linear steps change it by 1e-3."""
    rows = [moving(kind, times * 20, jump, "exponential") for times in (1, 2, 4, 8)]
    changes = np.abs(np.diff(column(rows, "dissipated")))
    assert np.log2(changes[0] / changes[2]) / 2.0 == pytest.approx(3.0, abs=0.3)
    assert np.abs(np.diff(column(rows, "friction"))).max() < 2e-4 * rows[-1].measures.friction
    for row in rows:
        assert row.stored + row.dissipated == pytest.approx(row.work, rel=1e-13, abs=0.0)


# V tau/a*: rows of time over the creep time, mu R/a*, its error, d R/a*^2. A load step and the start of sliding, both
# at t = 0, computed by an independent code with exponential steps and extrapolated
STARTED = {
    0.1: [
        (0.2, 0.009198, 7e-4, 1.9046),
        (0.6, 0.03513, 4e-4, 2.9454),
        (1.0, 0.05318, 4e-4, 3.5478),
        (1.4, 0.06489, 9e-4, 3.9245),
        (1.8, 0.07347, 6e-4, 4.1673),
    ],
    1.0: [
        (0.2, 0.09484, 5e-4, 1.9046),
        (0.6, 0.3435, 6e-4, 2.9439),
        (1.0, 0.474, 8e-4, 3.5315),
        (1.4, 0.5394, 5e-4, 3.8828),
        (1.8, 0.5746, 7e-4, 4.0975),
        (2.2, 0.5953, 8e-4, 4.2302),
    ],
}


@pytest.mark.parametrize("speed", [0.1, 1.0])
def test_sphere_that_starts_to_slide(speed: float) -> None:
    """Friction and approach within 1 % and the reference's error, at 15 cells per a* and 40 steps per creep time."""
    creep_time, radius, force = 1e-2, 1e-2, 0.15
    hertz = np.cbrt(3 * force * radius / (16 * 2.75e6))
    end = STARTED[speed][-1][0] * creep_time
    stage = {"force": force, "velocity": speed * hertz / creep_time, "duration": end, "time_step": creep_time / 40}
    data = {
        "grid": {"points": 128, "size": 4e-3, "boundary": "free"},
        "surface": {"shape": "sphere", "radius": radius},
        "material": SLS,
        "history": [stage],
        "numerics": {"tolerance": 1e-5},
        "output": {"energy": True},
    }
    _, rows = marched(data)
    for t, friction, error, approach in STARTED[speed]:
        row = min(rows, key=lambda row: abs(row.time - t * creep_time))
        assert row.measures.friction * radius / hertz == pytest.approx(friction, abs=1e-2 * friction + error)
        assert row.measures.approach * radius / hertz**2 == pytest.approx(approach, rel=1e-2)
        assert row.stored + row.dissipated == pytest.approx(row.work, rel=1e-12, abs=0.0)


def power(rows: list[StepRow], area: float) -> NDArray[np.float64]:
    """The work of the forces on the surface since the first row: the integral of W dd - F ds, by trapezoids."""
    mean = [0.5 * (column(rows, name)[1:] + column(rows, name)[:-1]) for name in ("pressure", "force_x")]
    steps = [np.diff(column(rows, name)) for name in ("approach", "distance")]
    return np.concatenate([[0.0], np.cumsum(area * mean[0] * steps[0] - mean[1] * steps[1])])


def test_energy_of_a_rough_contact() -> None:
    """Balance: 1e-3 of the work is asked for, 1e-12 is reached. Work of the forces on the surface, by trapezoids: 2e-2
    at one cell per step, and then less with each halving by at least 2^1.5, a little less than the order of the rule.
    """
    differences = []
    for cells in (1.0, 0.5, 0.25):
        history = [PRESS, slide(128, 40, cells_per_step=cells)]
        _, rows = marched(rough(128, history, numerics={"tolerance": 1e-6}, output={"energy": True}))
        for row in rows:
            assert row.stored + row.dissipated == pytest.approx(row.work, rel=1e-12, abs=0.0)
        start = next(n for n, row in enumerate(rows) if row.distance > 0.0) - 1
        sliding = rows[start:]
        by_forces = power(sliding, 1e-6)[-1]
        differences.append(abs(sliding[-1].work - sliding[0].work - by_forces) / by_forces)
    assert differences[0] < 2e-2
    assert np.all(np.array(differences[:-1]) > 2**1.5 * np.array(differences[1:]))


def test_friction_is_what_is_dissipated() -> None:
    """Steady sliding of a wave in partial contact: over a period the surface's forces work as much as is lost. 1e-3."""
    period = WAVELENGTH / FAST
    stage = {"pressure": 2e4, "velocity": FAST, "duration": 5 * period, "time_step": period / 128}
    data = wave([stage], points=(128, 1), tolerance=1e-9)
    data["output"] = {"energy": True}
    _, rows = marched(data)
    last = rows[-129:]
    lost = last[-1].dissipated - last[0].dissipated
    assert rows[-1].measures.contact_area < 0.9
    assert_allclose(last[-1].stored, last[0].stored, rtol=1e-4)
    assert_allclose(power(last, WAVELENGTH**2)[-1], lost, rtol=1e-3)


def test_along_y_as_along_x(tmp_path: Path) -> None:
    """A surface that slides along y is the transposed one along x: the same to 1e-7 of solves at 1e-10, at the cost."""
    rng = np.random.default_rng(3)
    x, y = np.arange(48) / 48, np.arange(32)[:, None] / 32
    terms = [(m, n, rng.uniform(0, 2 * np.pi)) for m in range(-3, 4) for n in range(4) if (m, n) != (0, 0)]
    heights = sum(1e-7 * np.cos(2 * np.pi * (m * x + n * y) + phase) / np.hypot(m, n) for m, n, phase in terms)

    def slid(heights: NDArray[np.float64], size: list[float], velocity: list[float]) -> tuple[March, list[StepRow]]:
        path = tmp_path / f"{velocity[0]}.npy"
        np.save(path, heights)
        ny, nx = heights.shape
        data = {
            "grid": {"points": [nx, ny], "size": size},
            "surface": {"shape": "file", "path": str(path)},
            "material": SLS,
            "history": [{"pressure": 2e3, "velocity": velocity, "distance": 1.25e-4, "cells_per_step": 1}],
            "numerics": {"tolerance": 1e-10},
        }
        return marched(data)

    along_x, rows = slid(heights, [3e-4, 2e-4], [0.05, 0.0])
    along_y, same = slid(heights.T, [2e-4, 3e-4], [0.0, 0.05])
    assert rows[-1].measures.contact_area < 0.9
    expected = along_x.field("pressure")
    assert_allclose(along_y.field("pressure").T, expected, rtol=0, atol=1e-7 * expected.max())
    names = {"force_x": "force_y", "force_y": "force_x", "friction": "friction", "approach": "approach"}
    for name, swapped in names.items():
        found, wanted = column(same, swapped), column(rows, name)
        assert_allclose(found, wanted, rtol=0, atol=1e-7 * np.abs(wanted).max())
    calls = [np.mean(column(each[5:], "operator_calls")) for each in (rows, same)]
    assert calls[1] < 1.1 * calls[0]


# -- a wave that slides in full contact: friction against its closed form, and its order in time ----------------------

INTEGRATORS: tuple[Integrator, ...] = ("exponential", "exponential-linear", "backward-euler")

# velocity and the friction of steady sliding at one cell per step, of exponential and of backward Euler steps
STEADY = [
    (0.001, 4.902519e-05, 4.888371e-05),
    (0.004, 0.0001943267, 0.000192302),
    (0.01, 0.0004615856, 0.0004507858),
    (FAST, 0.0009763055, 0.0009302677),
    (0.1, 0.0006707329, 0.0006487824),
]


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize(("velocity", "exponential", "euler"), STEADY)
def test_steady_friction(integrator: Integrator, velocity: float, exponential: float, euler: float) -> None:
    """After 25 relaxation times the friction that these steps must give: computed to 1e-9, and printed to 7 digits but
    for the quadratic steps."""
    cells = max(60, np.ceil(25e-3 * velocity / CELL))
    data = wave([{"velocity": velocity, "distance": cells * CELL, "cells_per_step": 1}], integrator=integrator)
    data["grid"]["size"][1] = 1e-4 * WAVELENGTH  # a very long and narrow box is all right
    _, rows = marched(data)
    found = rows[-1].measures.friction
    if integrator != "exponential":
        assert found == pytest.approx(exponential if integrator == "exponential-linear" else euler, rel=3e-7)
    waves = (MEAN, HEIGHT, np.array([K]), np.array([0.0]), velocity, 0.0)
    exact = step_responses.discrete_friction_coefficient(*waves, CELL / velocity, *PRONY, integrator=integrator)
    assert found == pytest.approx(float(exact), rel=1e-9)
    assert rows[-1].measures.force_x < 0.0
    assert rows[-1].operator_calls <= 4


def test_error_of_a_step_in_full_contact() -> None:
    """The estimate is one to three times the error of the loss of these steps, here at z = dt/tau of 0.1."""
    stage = {"velocity": FAST, "distance": 60 * CELL, "cells_per_step": 1, "pressure": 1e2 * MEAN}
    _, rows = marched(wave([stage], tolerance=1e-10))
    errors, waves = rows[-1].errors, (MEAN, HEIGHT, np.array([K]), np.array([0.0]), FAST, 0.0)
    assert errors is not None
    assert errors.friction is not None
    stepped = step_responses.discrete_friction_coefficient(*waves, CELL / FAST, *PRONY)
    true = abs(float(stepped / wavy.friction_coefficient(*waves, *PRONY)) - 1.0)
    assert true < errors.friction.time < 3.0 * true


@pytest.mark.parametrize("waves", [(1, 1), (2, 1), (1, -2)])
def test_oblique_waves(waves: tuple[int, int]) -> None:
    """Sliding along x: mu = |q| kx h0^2 G''(kx v)/P0 of these steps; and a force across. To 1e-9."""
    velocity = 0.4 * FAST
    cell = WAVELENGTH / 32
    stage = {"velocity": velocity, "distance": 50 * cell, "cells_per_step": 1}
    _, rows = marched(wave([{"duration": 20e-3, "time_step": 20e-3}, stage], waves, (32, 32)))
    kx, ky = K * waves[0], K * waves[1]
    data = rows[-1].measures
    dt = cell / velocity
    moment = (MEAN, HEIGHT, np.array([kx]), np.array([ky]), velocity, 0.0, dt, *PRONY)
    mu = float(step_responses.discrete_friction_coefficient(*moment))
    settled = np.exp(-50 * dt / 1e-3)
    load = MEAN * WAVELENGTH**2
    assert_allclose([-data.force_x / load, -data.force_y / load], [mu, mu * ky / kx], rtol=1e-9 + 3 * settled)
    assert_allclose(data.friction, mu * np.hypot(kx, ky) / kx, rtol=1e-9 + 3 * settled)


@pytest.mark.parametrize(("cells", "boundary"), [(3.0, "periodic"), (2.25, "periodic"), (2.25, "free")])
def test_height_is_where_the_surface_is(tmp_path: Path, cells: float, boundary: str) -> None:
    """`h0(x - s)` with its mean, to 1e-12 of it, which the gap is counted from; 10 roundings of each length."""
    x = np.arange(64) * CELL
    np.save(tmp_path / "wave.npy", 3.0 * HEIGHT + HEIGHT * np.cos(K * x)[None, :])
    data = wave([{"velocity": FAST, "distance": cells * CELL, "cells_per_step": cells}], tolerance=1e-6)
    data["grid"]["boundary"] = boundary
    data["surface"] = {"shape": "file", "path": str(tmp_path / "wave.npy")}
    march, _ = marched(data)
    height, gap, displacement = (march.field(name) for name in ("height", "gap", "displacement"))
    assert_allclose(height[0], 3.0 * HEIGHT + HEIGHT * np.cos(K * (x - cells * CELL)), rtol=1e-12)
    approach = march.row.measures.approach
    assert_allclose(gap, displacement - height - approach, rtol=0.0, atol=4e-15 * (3 * HEIGHT + abs(approach)))


# -- the examples of jobs/ that slide, as they promise ----------------------------------------------------------------


def test_example_of_a_sphere() -> None:
    """What jobs/sphere_sliding.yaml promises for V* = 1, within 3 % with 8 cells per a* and steps twice as long."""
    _, rows = marched(example("sphere_sliding", "grid.points=176", "history.0.time_step=2.5e-4"))
    t, friction = column(rows, "time") / 1e-2, column(rows, "friction") * 1e-2 / 0.46765e-3
    promised = np.array([0.0948, 0.3435, 0.4740, 0.5394, 0.5746, 0.5953])
    assert_allclose(np.interp([0.2, 0.6, 1.0, 1.4, 1.8, 2.2], t, friction), promised, rtol=3e-2)


@pytest.mark.rendered
def test_example_of_a_velocity_step(main: "Main", tmp_path: Path) -> None:
    """At an eighth of the waves and points: friction peaks and settles, the area falls; a picture."""
    job = JOBS / "velocity_step.yaml"
    smaller = ["--set", "grid.points=128", "--set", "surface.0.short_wavelength=1.25e-4", "--quiet"]
    assert main("run", job, "--out", tmp_path / "out", *smaller)[0] == 0
    table = tables.read_columns(tmp_path / "out/measures.csv")
    distance, friction, area = (np.array(table[name]) for name in ("distance", "friction", "contact_area"))
    slow, late = distance < 2.01e-5, distance > 2e-4
    peak = int(friction.argmax())
    assert 2e-5 < distance[peak] < 5e-5
    assert friction[peak] > 1.4 * friction[late].max()
    assert friction[peak] > 1.4 * friction[slow].max()
    assert area[late].max() < 0.3 * area[slow].min()
    assert main("plot", tmp_path / "out")[0] == 0
    assert (tmp_path / "out/picture.png").stat().st_size > 10_000


# -- what a sliding step costs: operator calls, memory, and the same on any number of ranks ---------------------------


def calls_per_step(points: int, history: list[Json], tolerance: float = 5e-3) -> tuple[float, float]:
    """Operator applications per step after the tenth, and the last friction."""
    _, rows = marched(rough(points, history, numerics={"tolerance": tolerance}))
    return float(np.mean(column(rows[11:], "operator_calls"))), rows[-1].measures.friction


def test_tolerance_of_friction() -> None:
    """At the default tolerance, 5e-3, friction is good to 1e-3."""
    stages = [slide(256, 30)]
    assert calls_per_step(256, stages)[1] == pytest.approx(calls_per_step(256, stages, 1e-7)[1], rel=1e-3)


@pytest.mark.mpi(3)
@pytest.mark.parametrize(
    ("velocity", "tolerance", "agreement"), [(0.3, 1e-11, 1e-8), ([0.2, -0.1], 1e-11, 1e-8), ([0.2, -0.1], 1e-4, 1e-3)]
)
def test_any_number_of_ranks(comm: MPI.Intracomm, tolerance: float, agreement: float, velocity: Any) -> None:
    """After 80 steps of a rough contact: as one rank, to 1e-8 of solves at 1e-11 and 1e-3 of solves at 1e-4."""
    steps = {"velocity": velocity, "duration": 80 * 1e-3 / 32 / 0.3, "time_step": 1e-3 / 32 / 0.3}
    data = rough(32, [steps], numerics={"tolerance": tolerance}, output={"energy": True})
    data["surface"]["short_wavelength"] = 1.25e-4
    names = ("pressure", "force_x", "force_y", "friction", "contact_area", "approach", "max_pressure", "dissipated")
    alone, rows = marched(data)
    assert len(rows) == 82
    march, same = marched(data, comm=comm)
    for name in names:
        found, expected = column(same, name), column(rows, name)
        points = 3 / 32**2 if name == "contact_area" and tolerance > 1e-6 else 0.0
        assert_allclose(found, expected, rtol=0, atol=agreement * np.abs(expected).max() + points, err_msg=name)
    for name in ("pressure", "displacement"):
        whole, field = np.concatenate(march.scene.slab.from_all(march.field(name))), alone.field(name)
        share = agreement if tolerance < 1e-6 else 0.03
        assert_allclose(whole, field, rtol=0, atol=share * np.abs(field).max(), err_msg=name)


# -- errors of friction where a body relaxes before the surface has slid by a cell: edges of contact are not ----------

ROUGH = {"shape": "rough", "hurst": 0.9, "rms_slope": 0.05, "long_wavelength": 2.5e-4, "short_wavelength": 1.25e-4}
SPHERE = {"shape": "sphere", "radius": 5e-3}
ZENER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]}
SYNTHETIC = {"include": "synthetic_tyre"}


def friction(points: int, surface: Any, body: Any, speed: float, boundary: str = "periodic") -> tuple[float, float]:
    """Return friction of steady sliding under 10 kPa, and its stated error."""
    grid = {"points": points, "size": 1e-3, "boundary": boundary}
    job = {"grid": grid, "surface": surface, "material": body, "numerics": {"accuracy": 0.003}}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # coarse meshes are stated
        curve = pc.steady(job, velocities=[speed], pressures=[1e4])
    return curve.friction[0], curve.error_friction[0]


@pytest.mark.parametrize(
    ("surface", "body", "speed", "boundary"),
    [
        ({**ROUGH, "seed": 5}, ZENER, 1e-4, "periodic"),  # 1 % of a cell in a relaxation time
        ({**ROUGH, "seed": 5}, ZENER, 1e-3, "periodic"),
        ({**ROUGH, "seed": 6}, SYNTHETIC, 1e-8, "periodic"),
        (SPHERE, ZENER, 1e-3, "periodic"),
        (SPHERE, ZENER, 1e-3, "free"),
    ],
)
def test_stated_errors_cover_what_edges_lose(surface: Any, body: Any, speed: float, boundary: str) -> None:
    """The true error is that against meshes of 192 and 384 points in a periodic box, from both of which the first order
    of the cell is taken off. It is 0.4 to 8 % here. The ten estimates are 1.3 to 4.8 times as large, near the
    median of all scenes of the page `coverage` (3.3)."""
    coarse, fine = (friction(points, surface, body, speed)[0] for points in (192, 384))
    exact = 2.0 * fine - coarse
    for points in (64, 96):
        found, error = friction(points, surface, body, speed, boundary)
        true = abs(found / exact - 1.0)
        assert true < error < 5.0 * true
