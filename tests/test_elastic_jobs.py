"""The worked examples of jobs/ against closed forms, and elastic jobs whichever way the load is given.

Tolerances are what the examples promise: Hertz's approach and peak pressure to 0.5 %, Westergaard's contact to one cell
and pressures to 1 % of the highest, Johnson's mean gap to 1e-3 of the amplitude and peak pressure to 0.2 %. What is
measured is given where it is far better.
"""

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marching import JOBS, load_script, marched
from mpi4py import MPI
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from parcontact import job, scene
from parcontact.errors import RunError
from parcontact.march.loop import run as run_march
from parcontact.march.step import March
from parcontact.parallel.slab import Slab
from parcontact.record.row import Row
from parcontact.solve import cold
from parcontact.theory import hertz, jgh, westergaard

SPHERE = (0.15, 1e-2, 2.75e6)  # force [N], radius [m], shear modulus [Pa] of jobs/hertz.yaml
WAVE = (5e-7, 2.5e-4, 1e6)  # amplitude [m], wavelength [m], shear modulus [Pa] of jobs/westergaard.yaml and waves.yaml
X = WAVE[1] / 1024 * np.arange(1024.0)  # where the points of jobs/westergaard.yaml are [m]
BUMPS = """
grid: {points: [48, 40], size: [1.0e-3, 8.0e-4]}
surface: {shape: rough, hurst: 0.8, long_wavelength: 5.0e-4, short_wavelength: 1.0e-4, rms_height: 1.0e-6, seed: 4}
material: {model: elastic, poisson: 0.5, shear_modulus: 1.0e6}
history: [{pressure: 5.0e3}]
numerics: {tolerance: 1.0e-10}
"""

Fields = dict[str, NDArray[Any]]


def run(path: Path, *overrides: str) -> list[tuple[Row, Fields]]:
    """What each step of a job gave: its row and fields. The steps of these jobs are static solves."""
    loaded = job.load(path, overrides)
    ready = March(scene.build(loaded, Slab(MPI.COMM_SELF, *loaded.grid.points)))
    steps = []

    def note(state: March) -> None:
        if state.row.step > 0:
            fields = {name: state.field(name).copy() for name in ("pressure", "displacement", "gap")}
            steps.append((state.row, fields))

    run_march(ready, [note])
    return steps


@pytest.fixture
def bumps(tmp_path: Path) -> Path:
    """A small rough periodic job in a file."""
    path = tmp_path / "bumps.yaml"
    path.write_text(BUMPS)
    return path


# -- worked examples ---------------------------------------------------------------------------------------------------


def test_hertz() -> None:
    """Measured: approach 5e-6, peak pressure 8e-6; the displacement 1e-4 of the approach everywhere."""
    [(row, fields)] = run(JOBS / "hertz.yaml")
    assert_allclose(row.measures.approach, hertz.approach(*SPHERE), rtol=5e-3)
    assert_allclose(row.measures.max_pressure, hertz.peak_pressure(*SPHERE), rtol=5e-3)
    x = np.linspace(-0.75e-3, 0.75e-3, 256, endpoint=False)
    r = np.hypot(x[None, :], x[:, None])
    wrong = np.abs(fields["displacement"] - hertz.displacement(r, *SPHERE))
    assert wrong.max() < 1e-3 * hertz.approach(*SPHERE)
    wrong = np.abs(fields["pressure"] - hertz.pressure(r, *SPHERE))
    assert wrong[r < 0.95 * hertz.contact_radius(*SPHERE)].max() < 1e-3 * hertz.peak_pressure(*SPHERE)
    assert_allclose(row.measures.pressure * 1.5e-3**2, 0.15, rtol=1e-13)


def test_hertz_converges() -> None:
    """Orders over 64, 128, 256 points; measured: approach 1.8, peak 2.1, pressures 1.55, where the edge allows 1.5."""
    script = load_script("convergence")
    points = [64, 128, 256]
    table = [script.errors(count) for count in points]
    for name, least, wrong in zip(script.NAMES, (1.5, 1.8, 1.4), zip(*table, strict=True), strict=True):
        observed = script.order(points, list(wrong))
        print(f"{name}: errors {', '.join(f'{error:.2e}' for error in wrong)}, order {observed:.2f}")
        assert observed > least


def test_hertz_area_corrected() -> None:
    """Counted areas are 1.4 % too large in the mean at 17 cells per radius; corrected by their edges 0.4 % too small.

    Five loads, each with the sphere over a point and beside one; a circle of the right size that falls badly between
    points stays wrong by 1 %, measured 0.9 %.
    """
    counted, corrected = [], []
    cell = 1.5e-3 / 64
    for force, beside in itertools.product((0.05, 0.07, 0.1, 0.15, 0.2), ([0.0, 0.0], [0.31, 0.17])):
        centre = [0.75e-3 + share * cell for share in beside]
        sphere = {"shape": "sphere", "radius": SPHERE[1], "center": centre}
        _, rows = marched(
            {
                "grid": {"points": 64, "size": 1.5e-3, "boundary": "free"},
                "surface": sphere,
                "material": {"model": "elastic", "poisson": 0.5, "shear_modulus": SPHERE[2]},
                "history": [{"force": force}],
                "numerics": {"tolerance": 1e-6},
            }
        )
        area = math.pi * float(hertz.contact_radius(force, *SPHERE[1:])) ** 2 / 1.5e-3**2
        counted.append(rows[-1].measures.contact_area / area - 1)
        corrected.append(rows[-1].measures.contact_area_corrected / area - 1)
    print(f"counted {np.mean(counted):.4f}, corrected {np.mean(corrected):.4f}, at most {np.abs(corrected).max():.4f}")
    assert 0.01 < np.mean(counted) < 0.018
    assert -0.006 < np.mean(corrected) < 0.0
    assert np.abs(corrected).max() < 0.01


def test_johnson_area_corrected() -> None:
    """The surface wavy in two directions, mean over 16 loads from 11 to 90 % of contact, of waves between the points.

    The reference is the counted area at 128 and 256 cells per wave, extrapolated to the first order: in this mean it is
    good to 1e-3. At 64 cells counted areas are then 1.3 % too large, corrected ones right to 2e-4.
    """
    full = float(jgh.full_contact_pressure(*WAVE))
    areas = {}
    for points in (64, 128, 256):
        waves = [
            {"shape": "wave", "amplitude": WAVE[0] / 2, "waves": [1, sign], "phase": phase}
            for sign, phase in ((1, 0.48), (-1, 0.14))
        ]
        _, rows = marched(
            {
                "grid": {"points": points, "size": WAVE[1]},
                "surface": waves,
                "material": {"model": "elastic", "poisson": 0.5, "shear_modulus": WAVE[2]},
                "history": [{"pressure": share * full} for share in np.linspace(0.05, 0.8, 16).tolist()],
                "numerics": {"tolerance": 1e-6},
            }
        )
        both = [(row.measures.contact_area, row.measures.contact_area_corrected) for row in rows[1:]]
        areas[points] = np.array(both)
    reference = 2 * areas[256][:, 0] - areas[128][:, 0]
    counted, corrected = (areas[64] / reference[:, None] - 1).mean(axis=0)
    print(f"counted {counted:.4f}, corrected {corrected:.4f}")
    assert 0.01 < counted < 0.02
    assert abs(corrected) < 2e-3


def check_westergaard(row: Row, pressures: NDArray[Any], edge: float, wrong: float) -> None:
    """Each of the two edges of the contact to `edge` cells, and the pressures to `wrong` of the highest."""
    mean = row.measures.pressure
    cells = X.size * (row.measures.contact_area - float(westergaard.contact_fraction(mean, *WAVE)))
    assert abs(cells) <= 2 * edge
    expected = westergaard.pressure(X, mean, *WAVE)
    assert np.abs(pressures - expected).max() <= wrong * expected.max()
    assert_allclose(row.measures.max_pressure, expected.max(), rtol=1e-3)
    assert_allclose(row.measures.mean_gap, westergaard.mean_gap(mean, *WAVE), atol=1e-5 * WAVE[0])


def test_westergaard() -> None:
    """The contact to one cell. Measured: pressures 0.8 % of the highest, in the last cell of the contact."""
    steps = run(JOBS / "westergaard.yaml")
    assert len(steps) == 5
    for row, fields in steps:
        check_westergaard(row, fields["pressure"], 0.5, 0.01)
        expected = westergaard.gap(X, row.measures.pressure, *WAVE)
        assert np.abs(fields["gap"] - expected).max() <= 1e-4 * WAVE[0]
    closed = westergaard.pressure(X, steps[-1][0].measures.pressure, *WAVE)
    assert np.abs(steps[-1][1]["pressure"] - closed).max() <= 1e-9 * closed.max()


def test_westergaard_at_all_loads() -> None:
    """Each edge to one cell (measured 0.7). Where an edge falls just so, the pressure next to it misses 1.8 %."""
    full = float(westergaard.full_contact_pressure(*WAVE))
    history = ", ".join(f"{{pressure: {share * full / 50}}}" for share in range(1, 50))
    for row, fields in run(JOBS / "westergaard.yaml", "grid.points=[1024, 1]", f"history=[{history}]"):
        check_westergaard(row, fields["pressure"], 1.0, 0.02)


def test_product_of_cosines() -> None:
    """Against boundary elements good to 1e-4. Measured: mean gaps 5e-6, peak pressures 3e-5."""
    full = float(jgh.full_contact_pressure(*WAVE))
    references = {reference.load: reference for reference in jgh.REFERENCE}
    for row, _ in run(JOBS / "waves.yaml"):
        reference = references[round(row.measures.pressure / full, 4)]
        assert_allclose(row.measures.mean_gap / WAVE[0], reference.mean_gap, atol=1e-3)
        assert_allclose(row.measures.max_pressure / full, reference.peak_pressure, rtol=2e-3)


@pytest.mark.parametrize("reference", jgh.REFERENCE, ids=lambda reference: str(reference.load))
def test_product_of_cosines_at_all_loads(reference: jgh.Reference) -> None:
    full = float(jgh.full_contact_pressure(*WAVE))
    [(row, _)] = run(JOBS / "waves.yaml", f"history=[{{pressure: {reference.load * full}}}]")
    assert_allclose(row.measures.mean_gap / WAVE[0], reference.mean_gap, atol=1e-3)
    assert_allclose(row.measures.max_pressure / full, reference.peak_pressure, rtol=2e-3)
    assert abs(row.measures.contact_area - reference.contact_fraction) < reference.contact_fraction_error + 0.002


def test_rough() -> None:
    """On a coarser grid. Contact grows with the load, and at the lightest is 2 to 2.5 times p/(E* slope).

    The tolerance is 1e-4 of the surface's height.
    """
    steps = run(JOBS / "rough.yaml", "grid.points=256", "numerics.tolerance=1e-3")
    areas = [row.measures.contact_area for row, _ in steps]
    assert areas == sorted(areas)
    assert 2.0 < areas[0] / (2e4 / (4e6 * 0.25)) < 2.6
    assert areas[-1] < 2.0 * 2.5e5 / (4e6 * 0.25)
    for row, fields in steps:
        assert row.certificate.worst <= 1e-3
        assert fields["pressure"].min() >= 0.0
        assert_allclose(fields["gap"].mean(), row.measures.mean_gap, rtol=1e-9)


# -- the same contact, given in other ways -----------------------------------------------------------------------------


@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_pressure_force_and_approach_agree(bumps: Path, boundary: str) -> None:
    """Tolerance 1e-10 on gaps: pressures to 1e-8 of the highest."""
    body = f"grid.boundary={boundary}"
    [(pressed, expected)] = run(bumps, body)
    force = 5e3 * 1e-3 * 8e-4
    [(forced, by_force)] = run(bumps, body, f"history=[{{force: {force!r}}}]")
    [(moved, by_approach)] = run(bumps, body, f"history=[{{approach: {pressed.measures.approach!r}}}]")
    highest = pressed.measures.max_pressure
    assert_allclose(by_force["pressure"], expected["pressure"], atol=1e-8 * highest)
    assert_allclose(by_approach["pressure"], expected["pressure"], atol=1e-8 * highest)
    assert_allclose(forced.measures.pressure, 5e3, rtol=1e-13)
    assert_allclose(moved.measures.pressure, 5e3, rtol=1e-7)


def test_approach_out_of_reach_leaves_no_contact(bumps: Path) -> None:
    """Pressed, then lifted by more than the surface is high."""
    pressed, lifted = run(bumps, "history=[{pressure: 5.0e3}, {approach: -1.0e-5}]")
    assert pressed[0].measures.contact_area > 0.1
    assert lifted[0].measures.contact_area == 0.0
    assert lifted[0].measures.pressure == 0.0
    assert lifted[0].measures.friction == 0.0
    assert lifted[1]["gap"].min() > 0.0


def test_zero_load_after_contact(bumps: Path) -> None:
    """The surface just touches: no pressure, and the smallest gap is 0."""
    steps = run(bumps, "history=[{pressure: 5.0e3}, {pressure: 0.0}]")
    row, fields = steps[-1]
    assert not fields["pressure"].any()
    assert not fields["displacement"].any()
    assert fields["gap"].min() == 0.0
    assert row.measures.friction == 0.0


def test_flat_surface(bumps: Path) -> None:
    [(row, fields)] = run(bumps, "surface={shape: flat}")
    assert_allclose(fields["pressure"], 5e3, rtol=1e-14)
    assert row.measures.contact_area == 1.0
    assert row.iterations == 0
    assert not fields["gap"].any()


def test_periodic_approach_beyond_full_contact_is_refused(bumps: Path) -> None:
    """With the approach that would be just full contact; below it all is well."""
    closed = 0.0  # a surface of mean height 0 is closed when its mean is where the body's was
    run(bumps, f"history=[{{approach: {closed - 1e-9}}}]")
    with pytest.raises(RunError, match=r"approach of 1e-07 m is beyond full contact.*prescribe a pressure") as refusal:
        run(bumps, "history=[{approach: 1.0e-7}]")
    assert "step 1" in str(refusal.value)


def test_running_out_of_iterations_ends_the_run(bumps: Path) -> None:
    with pytest.raises(RunError, match="did not converge in max_iterations = 2"):
        run(bumps, "numerics.max_iterations=2")
    [(row, _)] = run(bumps, "numerics.max_iterations=2", "numerics.accept_unconverged=true")
    assert row.iterations == 2
    assert row.certificate.worst > 1e-10


# -- invariance --------------------------------------------------------------------------------------------------------


def test_units(bumps: Path) -> None:
    """Lengths times 1e6, heights and moduli times other factors: the same contact, to the tolerance of the solves."""
    [(small, expected)] = run(bumps)
    surface = "hurst: 0.8, long_wavelength: 500.0, short_wavelength: 100.0, rms_height: 1.0e-3, seed: 4"
    [(large, found)] = run(
        bumps,
        "grid.size=[1000.0, 800.0]",
        f"surface={{shape: rough, {surface}}}",
        "material.shear_modulus=1.0e9",
        "history=[{pressure: 5.0e3}]",
    )
    scale = 1e3 * 1e3 / 1e6  # moduli times heights over lengths
    assert_allclose(found["pressure"], scale * expected["pressure"], atol=1e-8 * large.measures.max_pressure)
    assert large.measures.contact_area == small.measures.contact_area
    assert_allclose(large.measures.mean_gap, 1e3 * small.measures.mean_gap, rtol=1e-8)


def test_poisson_ratio(bumps: Path) -> None:
    """Only (1 - nu)/G enters."""
    [(_, expected)] = run(bumps)
    [(row, found)] = run(bumps, "material.poisson=0.2", "material.shear_modulus=1.6e6")
    assert_allclose(found["pressure"], expected["pressure"], atol=1e-8 * row.measures.max_pressure)


def test_coming_from_another_load_changes_nothing(bumps: Path) -> None:
    """An elastic body has no memory: to the tolerance of the solves."""
    direct, detour = run(bumps)[-1], run(bumps, "history=[{pressure: 5.0e4}, {pressure: 1.0}, {pressure: 5.0e3}]")[-1]
    assert_allclose(detour[1]["pressure"], direct[1]["pressure"], atol=1e-8 * direct[0].measures.max_pressure)


# -- starts ------------------------------------------------------------------------------------------------------------


def test_only_the_first_solve_of_a_large_job_starts_on_coarser_grids(
    bumps: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the limit lowered: its pressure is the same to the tolerance, at fewer calls; later steps start as ever."""
    words = ("grid.points=64", "surface.short_wavelength=1.25e-4", "history=[{pressure: 5.0e3}, {pressure: 6.0e3}]")
    (small, fields), (small_after, _) = run(bumps, *words)
    monkeypatch.setattr(cold, "WORTHWHILE", 64 * 64)
    grids = list[int]()
    start = cold.start_on_coarse_grids
    monkeypatch.setattr(cold, "start_on_coarse_grids", lambda *all: grids.append(start(*all)))
    (large, expected), (large_after, _) = run(bumps, *words)
    assert grids == [2]
    assert_allclose(fields["pressure"], expected["pressure"], rtol=0, atol=1e-7 * expected["pressure"].max())
    assert large.operator_calls < small.operator_calls
    assert abs(large_after.operator_calls - small_after.operator_calls) <= 3  # an iteration
