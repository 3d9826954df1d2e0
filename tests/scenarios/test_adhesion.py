"""Elastic bodies that stick, against closed forms of every length of the attraction."""

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from adhesive_jobs import (
    ELASTIC,
    FORCE,
    LENGTH,
    MODULUS,
    RADIUS,
    UNLOADED,
    WORK,
    Job,
    Map,
    cells_per_zone,
    gathered,
    last_row,
    nominal_area,
    pull_off,
    ramp,
    sphere,
    steps,
    zone,
)
from closed_forms import adhesion, viscoelastic_adhesion
from marched_jobs import begun, column, marched
from mpi4py import MPI
from numpy.testing import assert_allclose
from numpy.typing import NDArray

import parcontact as pc
from parcontact.door.simulation import Row
from parcontact.effects.adhesion.results import PullOff, find, swept

ALPHA, AMPLITUDE, WAVELENGTH = 0.3, 5e-6, 1e-3  # of Johnson's wave


@pytest.mark.parametrize(("tabor", "points", "box", "exact"), [(1, 48, 6, 1.664), (3, 128, 3, 1.54)])
def test_pull_off_of_a_sphere(tabor: float, points: int, box: float, exact: float) -> None:
    """An independent axisymmetric program's numbers, in pi w R, whose error is 0.3 %: 1 % with two cells per zone."""
    job = sphere(points, box, tabor, {"approach": 0.2 * LENGTH}, ramp(0.2 * LENGTH, -1.2 * LENGTH, 14))
    assert cells_per_zone(job) > 1.9
    assert_allclose(pull_off(job), -exact * np.pi * WORK * RADIUS, rtol=0.01)


@pytest.mark.filterwarnings("ignore:adhesion")  # of cells longer than the process zone
@pytest.mark.parametrize(
    ("tabor", "points", "box", "most"),
    [(3, 28, 2.6, 5), (3, 40, 2.6, 5), (3, 64, 2.6, 8), (1, 14, 4, 5), (1, 24, 6, 5)],
)
def test_the_error_of_a_pull_off_contains_the_range(tabor: int, points: int, box: float, most: float) -> None:
    """Cells of 2, 1.4, 0.9, 0.7 and 0.6 process zones hold the edge of contact, which the area does not show: pull-offs
    are up to 30 % too large, as the grid is symmetric to the sphere. The stated error covers it, and is at most some
    times as large."""
    deep = -2.2 if tabor == 3 else -3.0
    job = sphere(points, box, tabor, {"approach": 0.1 * LENGTH}, ramp(0.1 * LENGTH, deep * LENGTH, 60))
    run = pc.Simulation(job)
    rows, names = list(run.steps()), ("time", "pressure", "max_pressure", "approach", "contact_area", "error_area")
    table = {name: [getattr(row, name) for row in rows] for name in names}
    ended: Any = SimpleNamespace(job=run.job, table=table, detached="")
    found = dict(swept(ended))
    true = abs(found["pull_off"] - {1: 1.664, 3: 1.54}[tabor] * np.pi * WORK * RADIUS)
    assert true < found["pull_off_error"] < most * true


@pytest.mark.parametrize("size", [1.0, 1.3])
def test_load_over_approach_tends_to_jkr(size: float) -> None:
    """Attraction beyond the contact adds tension, which falls with the range: with Tabor's parameter 3 it is 1.6 % of
    the pull-off. The radius is that of JKR to a cell and a zone."""
    radius, wrong = size * UNLOADED, []
    for tabor, points in ((1.5, 64), (3, 128)):
        job = sphere(points, 4, tabor, {"approach": float(adhesion.sphere_approach(radius, RADIUS, WORK, MODULUS))})
        row = last_row(job)
        exact = float(adhesion.sphere_force(radius, RADIUS, WORK, MODULUS))
        wrong.append((row.pressure * nominal_area(job) - exact) / FORCE)
        found = np.sqrt(row.contact_area * nominal_area(job) / np.pi)
        assert_allclose(found, radius, atol=job["grid"]["size"] / points + 0.5 * zone(job))
    assert 0.6 * wrong[0] < wrong[1] < 0
    assert wrong[1] > -0.016


UNIT_FORCE = np.pi * WORK * RADIUS  # of Maugis' theory


def dugdale_sphere(parameter: float, points: int, box: float, *history: dict[str, Any]) -> dict[str, Any]:
    stress = parameter / 2 * np.cbrt(np.pi * WORK * (4 / 3 * MODULUS) ** 2 / RADIUS)
    return sphere(points, box, LENGTH * stress / WORK, *history, law="dugdale")


@pytest.mark.parametrize(
    ("parameter", "points", "box", "way"),
    [(0.2, 96, 6, (1.0, -5.0)), (0.5, 128, 4, (0.3, -1.5)), (1.0, 192, 3, (0.3, -1.5))],
)
def test_pull_off_with_dugdales_law(parameter: float, points: int, box: float, way: tuple[float, float]) -> None:
    """Maugis' theory to 1 %, where the contact has at least some thirty cells across."""
    path = {"approach": way[0] * LENGTH}, ramp(way[0] * LENGTH, way[1] * LENGTH, 24)
    job = dugdale_sphere(parameter, points, box, *path)
    assert_allclose(pull_off(job), adhesion.maugis_pull_off(parameter) * UNIT_FORCE, rtol=0.01)


def test_load_over_approach_with_dugdales_law() -> None:
    """Maugis' theory for the parameter 2.5, with its loads to 1 % of the pull-off where their slope is finite, and with
    the approach at which contact ends. The place of the sphere between the nodes moves loads by some 0.5 %."""
    path = ramp(0.0, -1.4 * LENGTH, 9), ramp(-1.59 * LENGTH, -1.68 * LENGTH, 10)
    job = dugdale_sphere(2.5, 144, 2.1, {"approach": 0.0}, *path)
    stable = adhesion.maugis_sphere(2.5, np.hypot(1, np.geomspace(1e-3, 2.0, 2000)))
    end = int(np.argmin(stable.approach))
    unit = float(np.cbrt((np.pi * WORK / (4 / 3 * MODULUS)) ** 2 * RADIUS))
    approaches, exact = stable.approach[end::-1] * unit, stable.force[end::-1]
    rows = [row for row in steps(job) if row.pressure != 0]
    found = np.array([(row.approach, row.pressure * nominal_area(job) / UNIT_FORCE) for row in rows])
    smooth = found[:, 0] > -1.45 * LENGTH
    theory = np.interp(found[smooth, 0], approaches, exact)
    assert_allclose(found[smooth, 1], theory, atol=0.01 * 1.5)
    assert_allclose(found[-1, 0], approaches[0], rtol=0.01)


def test_highest_load_with_dugdales_law() -> None:
    """Under a load that pulls more and more, contact ends at the pull-off of Maugis' theory: 1 %, of which 0.4 % are a
    step."""
    highest = adhesion.maugis_pull_off(2.5) * UNIT_FORCE
    pull = {"force": {"from": 0.95 * highest, "to": 1.05 * highest}, "duration": 1.0, "time_step": 1 / 24}
    job = dugdale_sphere(2.5, 144, 2.1, {"approach": 0.0}, ramp(0.0, -0.25 * LENGTH, 3), pull)
    last = last_row(job)
    assert 1.0 < last.time < 2.0
    assert_allclose(last.pressure * nominal_area(job), highest, rtol=0.01)


# -- lines -----------------------------------------------------------------------------------------------------------


def line(points: int, length: float, surface: dict[str, Any], work: float, *history: dict[str, Any]) -> dict[str, Any]:
    """A surface that is the same all along y; a process zone is four cells long."""
    return {
        "grid": {"points": [points, 4], "size": [length, 4 * length / points]},
        "surface": surface,
        "material": ELASTIC,
        "adhesion": {"work": work, "range": float(np.sqrt(4 * length / points * work / MODULUS))},
        "history": list(history),
        "numerics": {"tolerance": 1e-3},
    }


def wave(points: int, *history: dict[str, Any], alpha: float = ALPHA) -> dict[str, Any]:
    shape = {"shape": "wave", "amplitude": AMPLITUDE, "waves": [1, 0]}
    return line(points, WAVELENGTH, shape, alpha**2 * np.pi**2 * MODULUS * AMPLITUDE**2 / (2 * WAVELENGTH), *history)


UNIT = np.pi * MODULUS * AMPLITUDE / WAVELENGTH  # of mean pressures on Johnson's wave


def rise(start: float, end: float, count: int) -> dict[str, Any]:
    """A mean pressure that rises, in these units."""
    return {"pressure": {"from": start * UNIT, "to": end * UNIT}, "duration": 1.0, "time_step": 1 / count}


def test_pull_off_of_johnsons_wave() -> None:
    """Four cells per zone, which is a fifteenth of the contact: 0.5 %."""
    path = [
        ramp(start * AMPLITUDE, end * AMPLITUDE, count) for start, end, count in [(-0.4, -1.0, 6), (-1.0, -1.5, 25)]
    ]
    lowest = min(row.pressure for row in steps(wave(512, *path)))
    assert_allclose(lowest / UNIT, adhesion.wave_limits(ALPHA).pull_off, rtol=5e-3)


def test_johnsons_wave_jumps_to_full_contact() -> None:
    """Under a load that rises contact follows the closed form, to a zone at each edge, up to the jump: 0.5 %."""
    job = wave(512, {"approach": -0.5 * AMPLITUDE}, {"pressure": 0.1 * UNIT}, rise(0.1, 0.37, 27), rise(0.37, 0.4, 60))
    rows = [row for row in steps(job) if row.time > 0]
    limits = adhesion.wave_limits(ALPHA)
    full = next(row.pressure for row in rows if row.contact_area == 1)
    assert_allclose(full / UNIT, limits.jump, rtol=5e-3)
    for row in rows:
        if row.pressure < 0.36 * UNIT:
            edge = zone(job) / WAVELENGTH
            exact = [float(adhesion.wave_pressure(row.contact_area + 2 * sign * edge, ALPHA)) for sign in (-1, 1)]
            assert exact[0] < row.pressure / UNIT < exact[1]


def test_johnsons_wave_without_load() -> None:
    """2a/lambda is 0.3092. What contact lacks is of the order of the zone: it is extrapolated from two of them, to
    0.5 %, of which 0.16 % is a cell on each side of the finer mesh."""
    history = {"approach": -0.5 * AMPLITUDE}, {"pressure": 0.0}
    coarse, fine = (last_row(wave(points, *history)).contact_area for points in (2048, 4096))
    assert_allclose(2 * fine - coarse, 0.3092, rtol=5e-3)


@pytest.mark.parametrize(("alpha", "full"), [(0.995 * 0.56988, False), (1.005 * 0.56988, True)])
def test_full_contact_of_johnsons_wave_without_load(alpha: float, full: bool) -> None:
    """From alpha = 0.56988 on, to 0.5 %; from partial contact, whose load rises to none."""
    job = wave(1024, {"approach": -0.8 * AMPLITUDE}, {"pressure": -0.05 * UNIT}, rise(-0.05, 0.0, 25), alpha=alpha)
    assert (last_row(job).contact_area == 1) == full


def test_pull_off_of_a_cylinder() -> None:
    """In a box of 32 half widths, with four cells per zone: 0.5 %."""
    half_width = (RADIUS * np.sqrt(2 * WORK / (np.pi * MODULUS))) ** (2 / 3)
    unit, shape = half_width**2 / RADIUS, {"shape": "cylinder", "radius": RADIUS, "axis": "y"}
    exact = float(adhesion.cylinder_pull_off(RADIUS, WORK, MODULUS)) / (32 * half_width)
    first = last_row(line(1024, 32 * half_width, shape, WORK, {"pressure": -0.3 * exact})).approach
    job = line(1024, 32 * half_width, shape, WORK, {"approach": first}, ramp(first, first - 9 * unit, 60))
    assert_allclose(min(row.pressure for row in steps(job)), exact, rtol=5e-3)


@pytest.mark.filterwarnings("ignore:surface")  # of cells per wave: it is a step
def test_pull_off_of_a_punch() -> None:
    """A zone of two cells and a step of at least eight ranges. What a range leaves is of the order of its size and of
    its square: it is extrapolated from three of them, on meshes that follow, and 1 % is left."""
    radius, forces, ranges = 1e-4, [], np.array([2.0, np.sqrt(2), 1.0])
    for cells in (10, 20, 40):
        points, size = 3 * cells, 3 * radius
        x = (np.arange(points) + 0.5) / points * size - size / 2
        job = sphere(points, size / UNLOADED, 1, {"approach": 2e-7}, {"approach": -1.9e-6}, ramp(-1.9e-6, -2.7e-6, 40))
        heights = np.where(x[:, None] ** 2 + x**2 <= radius**2, 0.0, -4e-6)
        job |= {"surface": {"shape": "array", "heights": heights}}
        job["adhesion"]["range"] = float(np.sqrt(2 * size / points * WORK / MODULUS))
        forces.append(pull_off(job))
    _, _, limit = np.polyfit(ranges, forces, 2)
    assert_allclose(limit, adhesion.punch_pull_off(radius, WORK, MODULUS), rtol=0.01)


# -- energies --------------------------------------------------------------------------------------------------------


def test_work_is_what_is_stored_gained_and_lost() -> None:
    """Work = stored + dissipated + surface + snaps, in a whole loop from out of contact, to 1e-6 of the largest."""
    ramps = ramp(-4 * LENGTH, 2 * LENGTH, 30), ramp(2 * LENGTH, -4 * LENGTH, 30)
    job = sphere(32, 4, 1, *ramps, output={"energy": True})
    _, *rows = steps(job)
    largest = max(row.stored for row in rows)
    for row in rows:
        parts = row.stored + row.dissipated + row.surface_energy + row.snap_loss
        assert_allclose(row.work, parts, atol=1e-6 * largest)


@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_the_gap_is_between_body_and_surface(boundary: str) -> None:
    """Everywhere, to 1e-5 of the unit of length at a tolerance of 1e-5; and open points are pulled by the law."""
    job = sphere(32, 4, 1, {"approach": -0.5 * LENGTH}, numerics={"tolerance": 1e-5})
    job["grid"]["boundary"] = boundary
    run = pc.Simulation(job, comm=MPI.COMM_SELF)
    *_, row = run.steps()
    p, u, gap, heights = (gathered(run, name) for name in ("pressure", "displacement", "gap", "height"))
    assert_allclose(u - heights - row.approach, gap, atol=1e-5 * LENGTH)
    attraction = WORK / job["adhesion"]["range"] * np.exp(-gap / job["adhesion"]["range"])
    assert_allclose(p[gap > 0], -attraction[gap > 0], atol=1e-4 * attraction.max())
    assert (p + attraction)[gap == 0].min() > 0


# -- viscoelastic bodies that stick: rates, and the limits in which they are elastic ----------------------------------

RATIO, TIME = 10.0, 1e-2  # k = E_inf/E_0, relaxation time [s]


def zener(ratio: float = RATIO) -> Job:
    branch = {"modulus": MODULUS / 4 * (ratio - 1), "relaxation_time": TIME}
    return {"model": "zener", "modulus_inf": MODULUS / 4, "branches": [branch]}


def relaxed(approach: float) -> Job:
    """A stage of a thousand relaxation times, in steps that grow."""
    return {"approach": approach, "duration": 1000 * TIME, "time_step": {"first": TIME / 2, "growth": 3}}


@pytest.mark.parametrize(("rate", "fall", "exact"), [(0.03, 20, 1.365), (0.3, 20, 2.481), (3, 8, 7.38)])
def test_pull_off_over_rate(rate: float, fall: float, exact: float) -> None:
    """V tau over the unit of length is `rate`; an independent axisymmetric program's numbers, to 1 % on cells of 0.4
    process zones."""
    start, duration = 17.875 * LENGTH, fall * TIME / rate
    job = sphere(48, 8, 1, relaxed(start), ramp(start, start - fall * LENGTH, 160, duration), material=zener())
    assert_allclose(pull_off(job), -exact * FORCE, rtol=0.01)


@pytest.mark.parametrize(("radius", "exact"), [(2, 8.61), (3, 11.21), (4, 11.84)])
def test_instant_retraction(radius: int, exact: float) -> None:
    """Relaxed with a contact of two to four radii of the unloaded one, then pulled off within 1e-6 relaxation times:
    the program of the other test, 1 % on cells of at most half a process zone."""
    start = (radius * UNLOADED) ** 2 / 1e-3 - np.sqrt(2 * np.pi * WORK * radius * UNLOADED / MODULUS)
    fall = (radius**2 + 4) * LENGTH
    job = sphere(
        16 * max(radius, 3), 3 * radius, 1, relaxed(start), ramp(start, start - fall, 80, 1e-6 * TIME), material=zener()
    )
    assert cells_per_zone(job) > 2.0
    assert_allclose(pull_off(job), -exact * FORCE, rtol=0.01)


# -- elastic limits --------------------------------------------------------------------------------------------------


def forces(job: Job) -> Any:
    return np.array([row.pressure * nominal_area(job) for row in steps(job)])


@pytest.mark.parametrize(
    ("duration", "ratio", "modulus"),
    [(1e6 * TIME, RATIO, MODULUS), (1e-6 * TIME, RATIO, RATIO * MODULUS), (TIME, 1 + 1e-6, MODULUS)],
    ids=["slow", "fast", "without relaxation"],
)
def test_elastic_limits(duration: float, ratio: float, modulus: float) -> None:
    """Pressed from out of contact and pulled off, the force is at each step that of an elastic body; the solver's
    tolerance, which moves it by 1e-3 of the pull-off. Where the contact snaps in a slow step, the force is off by
    some ten relaxation times over the step, here 1e-4 of the snap."""
    path = ramp(-4 * LENGTH, 2 * LENGTH, 15, duration), ramp(2 * LENGTH, -4 * LENGTH, 30, duration)
    elastic = {"model": "elastic", "shear_modulus": modulus / 4}
    found, exact = (forces(sphere(32, 5, 1, *path, material=body)) for body in (zener(ratio), elastic))
    assert_allclose(found, exact, atol=2e-3 * FORCE)
    assert exact.min() < -FORCE


def rough(material: Job, surface: Any, *history: Job) -> Job:
    size = 1e-4
    return {
        "grid": {"points": 48, "size": size},
        "surface": surface,
        "material": material,
        "adhesion": {"work": WORK, "range": float(np.sqrt(2 * size / 48 * WORK / MODULUS))},
        "history": list(history),
        "numerics": {"tolerance": 1e-5},
    }


@pytest.mark.filterwarnings("ignore:surface")  # of cells per wave, of the second one
def test_instant_retraction_of_a_rough_surface() -> None:
    """From a relaxed state (p_i, g_i) the body is at once an elastic one of E_inf under the heights `u_i/k - g_i`: in
    g' = k g - (k - 1) g_i the theorem of instant retraction. Pressures of two runs, to the tolerance of the solves."""
    surface = {"shape": "rough", "hurst": 0.8, "rms_slope": 0.1, "seed": 2}
    surface |= {"long_wavelength": 2.5e-5, "short_wavelength": 1.7e-5}
    start, fall, count = -1e-7, 6e-8, 8
    retraction = ramp(start, start - fall, count, 1e-7 * TIME)
    run = pc.Simulation(rough(zener(), surface, relaxed(start), retraction), comm=MPI.COMM_SELF)
    found = [(row, {name: gathered(run, name) for name in ("pressure", "displacement", "gap")}) for row in run.steps()]
    _, rest = found[-count - 1]
    heights = rest["displacement"] / RATIO - rest["gap"]
    stiff = {"model": "elastic", "shear_modulus": RATIO * MODULUS / 4}
    second = rough(stiff, {"shape": "array", "heights": heights}, {"approach": 0.0}, ramp(0.0, -fall, count))
    elastic = pc.Simulation(second, comm=MPI.COMM_SELF)
    exact = [(row, gathered(elastic, "pressure")) for row in elastic.steps()]
    for (row, maps), (other, p) in zip(found[-count - 1 :], exact[-count - 1 :], strict=True):
        assert_allclose(maps["pressure"], p, atol=2e-4 * np.abs(p).max())  # 1e-4 of each of the two runs
        assert row.contact_area == other.contact_area
    areas = [row.contact_area for row, _ in found[-count - 1 :]]
    assert np.all(np.diff(areas) < 0)
    assert 0 < areas[-1] < 0.1 * areas[0]


@pytest.mark.parametrize(("accuracy", "within"), [(0.05, 0.05), (0.005, 0.02)])
def test_energies_of_a_contact_that_comes_about_follow_the_accuracy(accuracy: float, within: float) -> None:
    """A ball comes into contact within 100 s, in a second of which it snaps in, and its rubber relaxes in 0.1 s.

    6400 given steps dissipate 27.8 pJ; with a rest, which adds 0.2, an independent program 27.6 on this mesh. With
    steps that pass over the snap it was 21.1 at any accuracy. `error_energy` covers what is missing, and is less than
    a sixth of it all: 15 % and 8 % at the two accuracies.
    """
    branches = [{"modulus": 4e6, "relaxation_time": 0.01}, {"modulus": 5e6, "relaxation_time": 0.1}]
    ball = {
        "grid": {"points": 64, "size": 3e-4, "boundary": "free"},
        "surface": {"shape": "sphere", "radius": 1e-3},
        "material": {"model": "zener", "modulus_inf": 1e6, "branches": branches},
        "adhesion": {"work": 0.05, "range": 5.4e-7},
        "history": [{"approach": {"from": -4e-6, "to": 5e-7}, "duration": 100.0}],
        "numerics": {"accuracy": accuracy},
        "output": {"energy": True},
    }
    _, rows = marched(ball)
    wanted, error = 27.8e-12, rows[-1].error_energy
    assert abs(rows[-1].dissipated - wanted) < within * wanted
    assert abs(rows[-1].dissipated - wanted) < error < wanted / 6.0
    begins = next(number for number, row in enumerate(rows) if row.measures.contact_area > 0.0)
    assert rows[begins].time - rows[begins - 1].time < 0.0011


# -- what adhesion costs: operator calls of steps with it, over those of the same steps without -----------------------

SIZE, POINTS, SLOPE = 1e-4, 128, 0.1
RUBBER: Job = {"model": "zener", "modulus_inf": MODULUS / 4, "branches": [{"modulus": 9e6, "relaxation_time": 1.0}]}


def counted(job: Job) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Operator calls of each step but the first two, and how far edges of contact moved in it: the points that come
    into contact or leave it over the points in contact."""
    march, calls, contacts = begun(job), [], []
    for step in march.steps():
        march.advance(step)
        calls.append(march.row.operator_calls)
        contacts.append(march.field("gap") == 0.0)
    moved = [np.sum(one != other) / max(other.sum(), 1) for one, other in pairwise(contacts)]
    return np.array(calls[2:]), np.array(moved[1:])


@pytest.mark.parametrize(("body", "strength"), [(ELASTIC, 0.01), (ELASTIC, 0.05), (RUBBER, 0.01)])
def test_a_resolved_step_with_adhesion(body: Job, strength: float) -> None:
    """Pressed and let go, with a work of adhesion over E* slope^2 and the shortest wave: at most four times the calls
    of the same steps without, to the same tolerance, where edges of contact move little."""
    cell = SIZE / POINTS
    waves = {"hurst": 0.8, "long_wavelength": SIZE / 4, "short_wavelength": 8 * cell, "rms_slope": SLOPE, "seed": 1}
    job: Job = {
        "grid": {"points": POINTS, "size": SIZE},
        "surface": {"shape": "rough", **waves},
        "material": body,
        "history": [{"pressure": 1.0}],
        "numerics": {"tolerance": 5e-3},
    }
    height = float(begun(job).field("height").std())
    low, high = -2.5 * height, -height
    count = 4 * int(np.ceil((high - low) / (SLOPE * cell)))
    job["history"] = [ramp(low, high, count), ramp(high, low, count)]
    sticks = {"work": strength * MODULUS * SLOPE**2 * 8 * cell, "range": "auto"}
    (calls, moved), (without, _) = counted({**job, "adhesion": sticks}), counted(job)
    resolved = moved < 0.2
    assert resolved.sum() >= 5
    assert 0.5 < calls[resolved].sum() / without[resolved].sum() < 4.0


# -- edges of contact that open and close steadily on a relaxing body, against the theory of the steady crack ---------

CREEP = RATIO * TIME  # [s]
SHEAR = MODULUS / 2  # of the relaxed layer [Pa]
BRANCH = SHEAR * (RATIO - 1)
CELL, BOX, DEPTH = (
    1e-6,
    9,
    10.0,
)  # [m]; length of the box, half of which is the punch, in T; depth next to it, in ranges
THEORIES = viscoelastic_adhesion.opening_crack, viscoelastic_adhesion.closing_crack


def strengths(velocity: float) -> Map:
    """G/w by theory of an edge that opens and of one that closes, at V over (c0/CREEP)."""
    return np.array([theory(velocity / CREEP, SHEAR, [BRANCH], [TIME]) for theory in THEORIES])


def layer(cells: int, thickness: int, *history: Job) -> Job:
    """A layer of a given number of process zones, each of which has a given number of cells."""
    zone, points = cells * CELL, BOX * thickness * cells
    reach = float(np.sqrt(zone * WORK / MODULUS))
    branch = {"modulus": BRANCH, "relaxation_time": TIME}
    return {
        "grid": {"points": [points, 1], "size": [points * CELL, CELL]},
        "surface": {"shape": "array", "heights": np.where(np.arange(points) < points // 2, 0.0, -DEPTH * reach)[None]},
        "body": {"thickness": thickness * zone, "base": "smooth"},
        "material": {"model": "zener", "modulus_inf": SHEAR, "branches": [branch], "poisson": 0.0},
        "adhesion": {"work": WORK, "range": reach, "law": "dugdale"},
        "history": list(history),
        "numerics": {"tolerance": 1e-4},
    }


def speed(rows: list[Row], points: int) -> float:
    """Cells per CREEP by which each of two edges moves, from the instants at which points change sides."""
    areas, instants = np.unique([row.contact_area for row in rows], return_index=True)
    assert len(areas) > 5
    return abs(float(np.polyfit([rows[instant].time / CREEP for instant in instants], areas * points / 2, 1)[0]))


def excess(velocity: float, way: float, count: int, cells: int, thickness: int) -> Map:
    """G over that of theory at the velocity which is seen, opening and closing, less 1. The lifts that are held, each
    for a `way` in c0 and a given number of steps, are those of theory at `velocity`."""
    given, held = strengths(velocity), way / velocity * CREEP
    opening, closing = (-np.sqrt(2 * thickness * cells * CELL * given * WORK / MODULUS)).tolist()
    history = (
        ramp(0.0, opening, 100, 3 * CREEP * (1 + 1 / velocity)),
        ramp(opening, opening, count, held),
        ramp(opening, closing, 100, 10 * CREEP),
        ramp(closing, closing, count, held),
    )
    job = layer(cells, thickness, {"approach": 0.0}, *history)
    *_, last = rows = list(steps(job))
    assert 0 < last.contact_area < 0.5
    steady = rows[-100 - 3 * count // 2 : -100 - count], rows[-count // 2 :]
    seen = (speed(part, job["grid"]["points"][0]) / (np.pi / 4 * cells) for part in steady)
    return given / [strengths(each)[side] for side, each in enumerate(seen)] - 1


@pytest.mark.filterwarnings("ignore:surface")  # of cells per wave: it is a step
@pytest.mark.parametrize(("velocity", "way", "count"), [(10, 20, 400)])
def test_steady_crack(velocity: float, way: float, count: int) -> None:
    """G/w is 4.5272 for edges that open with `velocity`, 0.2001 for those that close. The error
    is of second order in the cells, here a quarter and an eighth of l, and of first order in l/T: both extrapolated,
    0.2 % are left, to which the instants add some 0.2 %. Alone, the meshes are up to 3 % and 1.3 % off."""
    coarse, fine, thick = (excess(velocity, way, count, *each) for each in ((4, 80), (8, 80), (4, 160)))
    print(coarse, fine, thick)
    assert np.all(np.abs(fine) < np.abs(coarse))
    assert_allclose(coarse + (fine - coarse) * 4 / 3 + (thick - coarse) * 2, 0, atol=5e-3)


@pytest.mark.parametrize("duration", [0.03, 10.0])
def test_the_pull_off_is_within_its_error_at_all_accuracies(duration: float) -> None:
    """A ball is pulled off rubber faster and slower than this relaxes: 1500 equal steps are the reference, whose own
    vertex and row differ by less than 0.02 %. The error that is stated falls with the accuracy, and covers the true
    one; of an accuracy of 0.05 it is less than 5 % of the load."""
    body = {"model": "zener", "modulus_inf": 1e6}
    branches = [{"modulus": 4e6, "relaxation_time": 0.01}, {"modulus": 5e6, "relaxation_time": 0.1}]
    press = {"approach": {"from": -4e-6, "to": 5e-7}, "duration": 100.0, "time_step": 1.0}
    rest = {"approach": 5e-7, "duration": 100.0, "time_step": {"first": 0.01, "growth": 2.0}}
    pull = {"approach": {"from": 5e-7, "to": -4e-6}, "duration": duration}
    job = sphere(48, 1.0, 1.0, press, rest, material={**body, "branches": branches})
    job |= {"grid": {"points": 48, "size": 3e-4, "boundary": "free"}, "adhesion": {"work": 0.05, "range": 5.4e-7}}

    def pulled(accuracy: float, **steps: float) -> PullOff:
        numerics = {"accuracy": accuracy}
        _, rows = marched({**job, "numerics": numerics, "history": [press, rest, {**pull, **steps}]})
        names = "pressure", "max_pressure", "approach", "contact_area"
        columns = {"time": [row.time for row in rows], "error_area": [0.0] * len(rows)}  # the mesh is the reference's
        (found,) = find(columns | {name: column(rows, name).tolist() for name in names})
        return found

    exact = pulled(0.002, time_step=duration / 1500)
    assert exact.between < 2e-4 * -exact.pressure
    errors = []
    for accuracy in (0.05, 0.005):
        found = pulled(accuracy)
        errors.append(found.error(0.5 * accuracy))
        assert abs(found.pressure - exact.pressure) < errors[-1] < -accuracy * found.pressure
    assert errors[1] < 0.5 * errors[0]
