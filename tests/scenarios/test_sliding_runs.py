"""A surface that slides on a viscoelastic body: order in time, energies, directions."""

from pathlib import Path

import numpy as np
import pytest
from marching import SLS, column, marched
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from sliding import FAST, PRESS, WAVELENGTH, Json, rough, slide, wave

from parcontact.march.loop import March
from parcontact.physics.prony import Integrator
from parcontact.storage.row import StepRow


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
@pytest.mark.parametrize("kind", ["sphere", "waves"])
@pytest.mark.parametrize("jump", [False, True])
def test_order_in_a_moving_contact(kind: str, jump: bool, integrator: Integrator, order: float) -> None:
    """Friction and dissipation from differences of three step lengths, though points come and go: order to 0.2."""
    fewest = 40 if order > 1.0 else 80
    rows = [moving(kind, times * fewest, jump, integrator) for times in (1, 2, 4)]
    for name in ("friction", "dissipated"):
        coarse, middle, fine = column(rows, name)
        assert np.log2((middle - coarse) / (fine - middle)) == pytest.approx(order, abs=0.2)
        assert fine == pytest.approx(middle, rel=5e-3)


@pytest.mark.parametrize("kind", ["sphere", "waves"])
@pytest.mark.parametrize("jump", [False, True])
def test_quadratic_steps_in_a_moving_contact(kind: str, jump: bool) -> None:
    """Order 3 of the dissipation, in the mean over three halvings from twenty steps on: to 0.3, as points come and go.
    Friction changes by less than 2e-4, where linear steps change it by 1e-3."""
    rows = [moving(kind, times * 20, jump, "exponential") for times in (1, 2, 4, 8)]
    changes = np.abs(np.diff(column(rows, "dissipated")))
    assert np.log2(changes[0] / changes[2]) / 2.0 == pytest.approx(3.0, abs=0.3)
    assert np.abs(np.diff(column(rows, "friction"))).max() < 2e-4 * rows[-1].measures.friction
    for row in rows:
        assert row.stored + row.dissipated == pytest.approx(row.work, rel=1e-13)


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
        assert row.stored + row.dissipated == pytest.approx(row.work, rel=1e-12)


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
            assert row.stored + row.dissipated == pytest.approx(row.work, rel=1e-12)
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


def test_quarters_of_cells() -> None:
    """64 quarters of a cell and 16 cells: the same heights to 1e-9; friction to 1e-3, as both resolve the time."""
    waves = [([1, 0], 5e-7), ([1, 1], 3e-7), ([2, -1], 5e-8)]
    found = []
    for cells in (1, 0.25):
        stage = {"velocity": 0.02, "distance": 16 * WAVELENGTH / 256, "cells_per_step": cells}
        data = wave([{"duration": 5e-3, "time_step": 5e-3}, stage], points=(256, 32), tolerance=1e-8)
        data["history"][0]["pressure"] = data["history"][1]["pressure"] = 3e4
        data["surface"] = [{"shape": "wave", "amplitude": a, "waves": w} for w, a in waves]
        march, rows = marched(data)
        base, offset = march.scene.motion.at(march.state.contact.last.position).parts
        found.append((np.roll(base, offset, axis=1), rows[-1].measures, len(rows)))
    (heights, whole, steps), (same, quarters, more) = found
    assert (steps, more) == (19, 67)
    assert_allclose(same, heights, rtol=0, atol=1e-9 * float(np.ptp(heights)))
    assert whole.contact_area < 0.95
    assert_allclose(quarters.friction, whole.friction, rtol=1e-3)


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
