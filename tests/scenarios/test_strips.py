"""Boxes that are periodic along x and free along y: coefficients, line contacts, waves, sliding, what is refused."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import parcontact as pc
from parcontact import job as jobs
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics import halfspace as strip
from parcontact.physics.halfspace import HalfSpace, cell_factor, love

G, R, LENGTH, WIDTH = 1.0e6, 1.0e-2, 1.0e-4, 1.0e-3  # [Pa], of the cylinder [m], of the box along x and y [m]
E_STAR = 4.0 * G  # of an incompressible body on a rigid one
LINE_LOAD = 20.0  # [N/m]
HALF = math.sqrt(4 * LINE_LOAD * R / (math.pi * E_STAR))  # half width of contact; Johnson (1985), Sec. 4.2c
PEAK = math.sqrt(LINE_LOAD * E_STAR / (math.pi * R))


def job(points: list[int], **changes: Any) -> dict[str, Any]:
    return {
        "grid": {"points": points, "size": [LENGTH, WIDTH], "boundary": ["periodic", "free"]},
        "surface": {"shape": "cylinder", "radius": R, "axis": "x"},
        "material": {"model": "elastic", "shear_modulus": G},
        "history": [{"force": LINE_LOAD * LENGTH}],
        "numerics": {"tolerance": 1.0e-6},
    } | changes


@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_coefficients_are_those_of_a_cell_and_its_images(nu: float) -> None:
    """Less the displacement of a uniform line at the distance Ly, summed over 20000 images on either side. What is left
    out of that sum is of the order of (y/(N Lx))^2 of the logarithm: 2e-8."""
    (lx, ly), count = (1.3, 2.0), 20000
    dx, dy = lx / 8, ly / 16
    x, y = np.array([[0.0, 0.3, 0.65]]), np.array([[0.0], [0.25], [2.0], [3.9]])
    images = np.asarray(love(x + lx * np.arange(-count, count + 1)[:, None, None], y, dx, dy, nu)).sum(axis=0)
    far = (1 - nu) / np.pi * dx * dy / lx * math.log(2 * (count + 0.5) * lx / ly)
    found = strip.strip_coefficients(x, y, dx, dy, size=(lx, ly), poisson=nu)
    assert found == pytest.approx(images - far, abs=1e-10)  # the coefficients themselves are 0.06 and less


def test_far_across_a_cell_acts_like_a_line() -> None:
    """A line has the displacement (1 - nu)/pi P' ln(Ly/|y|); what varies along x decays by exp(-2 pi |y|/Lx)."""
    (lx, ly), y = (0.1, 1.0), np.array([[0.5], [1.0], [2.0]])
    found = strip.strip_coefficients(np.array([[0.0, 0.05]]), y, lx / 2, ly / 1000, size=(lx, ly), poisson=0.5)
    line = 0.5 / np.pi * (lx / 2 * ly / 1000) / lx * np.log(ly / y)
    assert np.abs(found - line).max() < 1e-6 * line[0, 0]  # (dy/y)^2/24 is 2e-7


@pytest.mark.filterwarnings("ignore:grid. in a free box")
@pytest.mark.parametrize(("across", "within"), [(WIDTH, 0.03), (0.1 * WIDTH, 0.6)])
def test_a_row_of_a_free_box_is_a_line_contact_if_it_is_wide(across: float, within: float) -> None:
    """Hertz's peak pressure, 2 % too high under a strip as wide as the box is long. Under a narrower strip it is more
    than a tenth too high, and the job gets a warning."""
    grid = {"points": [1, 256], "size": [across, WIDTH], "boundary": "free"}
    given = job([1, 256], grid=grid, history=[{"force": LINE_LOAD * across}])
    peak = pc.Simulation(given, comm=MPI.COMM_SELF).run().max_pressure
    wrong = peak / PEAK - 1.0
    assert wrong == pytest.approx(0.0, abs=within)
    warned = [doubt for doubt in jobs.load(given).doubts if "is a strip of the width" in str(doubt)]
    assert len(warned) == (across < WIDTH) == (wrong > 0.1)


@pytest.mark.parametrize("nx", [1, 8])
def test_a_cylinder_is_a_line_contact(nx: int) -> None:
    """Hertz: half width and peak pressure; the approach relative to a line at the distance Ly, P'/(pi E*) (2 ln(2 Ly/b)
    + 1). Half a cell of the 126 in contact; pressures of 128 cells are of second order."""
    run = pc.Simulation(job([nx, 256]), comm=MPI.COMM_SELF)
    row = run.run()
    assert row["contact_area"] == pytest.approx(2 * HALF / WIDTH, abs=1.01 / 256)
    assert row["max_pressure"] == pytest.approx(PEAK, rel=1e-4)
    assert row["approach"] == pytest.approx(
        LINE_LOAD / (math.pi * E_STAR) * (2 * math.log(2 * WIDTH / HALF) + 1), rel=1e-4
    )
    pressure = run.field("pressure")
    assert np.ptp(pressure, axis=1).max() < 1e-5 * PEAK  # nothing varies along x
    y = (np.arange(256) - 128) * WIDTH / 256
    inside = np.abs(y) < 0.9 * HALF
    assert pressure[inside, 0] == pytest.approx(PEAK * np.sqrt(1 - (y[inside] / HALF) ** 2), rel=2e-3)


def test_a_wave_along_x_has_the_compliance_of_a_periodic_body() -> None:
    """(1 - nu)/q, with the cells' factor, in the middle of eight wavelengths: the edges are exp(-8 pi) away."""
    slab = Slab.alone(16, 128)
    size, fft = (1.0, 8.0), FFT(slab)
    pressure = np.broadcast_to(np.cos(2 * np.pi * np.arange(16) / 16), (128, 16)).copy()
    found = HalfSpace(size, free=True, repeats_along_x=True, kernel="love").operator(fft).apply(pressure, slab.empty())
    compliance = 0.5 / (2 * np.pi) * cell_factor(fft, size)[0, 1]
    assert np.abs(found[64] - compliance * pressure[64]).max() < 1e-8 * compliance


@pytest.mark.parametrize("points", [(16, 8), (8, 16)])
def test_the_operator_adds_up_coefficients(points: tuple[int, int]) -> None:
    """Of two cells, one of them at the free edge; with square cells, and as many distances along x as across."""
    slab, size = Slab.alone(*points), (points[0] / 16, points[1] / 16)
    pressure = slab.zeros()
    pressure[0, 3], pressure[5, 1] = 1.0, 2.0
    found = (
        HalfSpace(size, free=True, repeats_along_x=True, kernel="love")
        .operator(FFT(slab))
        .apply(pressure, slab.empty())
    )
    x, y = np.arange(points[0])[None, :] / 16, np.arange(points[1])[:, None] / 16
    expected = slab.zeros()
    for row, column in ((0, 3), (5, 1)):
        away = (x - column / 16 + size[0] / 2) % size[0] - size[0] / 2
        cell = strip.strip_coefficients(away, y - row / 16, 1 / 16, 1 / 16, size=size, poisson=0.5)
        expected += pressure[row, column] * cell
    assert np.abs(found - expected).max() < 1e-13


def test_two_periods_are_one_twice() -> None:
    """A sphere in a strip, and two in one of twice the length: both contacts are that of one."""
    sphere = {"shape": "sphere", "radius": 2.0e-3, "center": [LENGTH / 2, WIDTH / 2]}
    one = pc.Simulation(job([16, 64], surface=sphere, history=[{"force": 1e-4}]), comm=MPI.COMM_SELF)
    grid = {"points": [32, 64], "size": [2 * LENGTH, WIDTH], "boundary": ["periodic", "free"]}
    heights = pc.surface(sphere, grid=job([16, 64])["grid"])
    two = pc.Simulation(
        job([32, 64], grid=grid, surface=np.tile(heights, (1, 2)), history=[{"force": 2e-4}]), comm=MPI.COMM_SELF
    )
    first, second = one.run(), two.run()
    assert second["pressure"] == pytest.approx(first["pressure"], rel=1e-12)
    whole = one.field("pressure")
    assert np.abs(two.field("pressure") - np.tile(whole, (1, 2))).max() < 1e-4 * whole.max()  # of the tolerance


def test_a_surface_slides_along_x_for_ever_and_along_y_once() -> None:
    """Along x pressures come round; along y a shape leaves the box at its edge."""
    sphere = {"shape": "sphere", "radius": 2.0e-3, "center": [0.0, WIDTH / 2]}
    slide = {"force": 1e-4, "velocity": 1.0, "distance": 1.5 * LENGTH, "cells_per_step": 4}
    run = pc.Simulation(job([16, 64], surface=sphere, history=[{"force": 1e-4}, slide]), comm=MPI.COMM_SELF)
    steps = run.steps()
    next(steps), next(steps)
    before = run.field("pressure").copy()
    for row in steps:
        assert abs(row["force_x"]) < 1e-4 * 1e-4  # an elastic body has no friction
    assert np.abs(run.field("pressure") - np.roll(before, 8, axis=1)).max() < 1e-3 * before.max()
    across = [{"approach": 1e-6}, {"approach": 1e-6, "velocity": [0.0, 1.0], "distance": WIDTH, "cells_per_step": 32}]
    off = pc.Simulation(job([16, 64], surface=sphere, history=across), comm=MPI.COMM_SELF)
    with pytest.warns(UserWarning, match="reaches the edge of the box"):
        assert off.run()["contact_area"] == 0.0


def test_contact_at_the_free_edges_alone_is_stated() -> None:
    along_y = pc.Simulation(job([32, 32], surface={"shape": "cylinder", "radius": R, "axis": "y"}), comm=MPI.COMM_SELF)
    along_x = pc.Simulation(job([32, 32]), comm=MPI.COMM_SELF)
    with pytest.warns(UserWarning, match="reaches the edge of the box"):
        along_y.run()
    along_x.run()  # any warning would be an error


@pytest.mark.mpi
def test_ranks_agree(comm: MPI.Intracomm) -> None:
    """To rounding, with fewer rows than ranks along neither side."""
    sphere = {"shape": "sphere", "radius": 2.0e-3, "center": [0.0, WIDTH / 2]}
    scene = job([16, 48], surface=sphere, history=[{"force": 1e-4}])
    rows = [pc.Simulation(scene, comm=one).run() for one in (comm, MPI.COMM_SELF)]
    for name in ("approach", "contact_area", "max_pressure", "mean_gap"):
        assert rows[0][name] == pytest.approx(rows[1][name], rel=1e-9)


ZENER = {"model": "zener", "modulus_inf": G, "branches": [{"modulus": G, "relaxation_time": 1.0}]}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"adhesion": {"work": 0.05, "range": 1e-6}}, "must be periodic or free with adhesion, got [periodic, free]"),
        ({"body": {"thickness": 1e-3}}, "must be periodic or free with a layer (body), got [periodic, free]"),
        ({"initial": {"state": "steady", "pressure": 1e4}, "material": ZENER}, "with steady sliding, got [periodic"),
        ({"numerics": {"kernel": "spectral"}}, "must be love when grid.boundary is free"),
    ],
)  # fmt: skip
def test_what_a_strip_does_not_have(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(pc.JobError) as caught:
        pc.Simulation(job([8, 8], **changes))
    (mistake,) = caught.value.mistakes
    assert said in mistake


@pytest.mark.parametrize(
    ("boundary", "said"),
    [
        (["free", "periodic"], "must be [periodic, free] if it is free along one axis, got [free, periodic]: exchange"),
        (["periodic", "open"], "grid.boundary must be periodic | free | [periodic, free], got"),
        (["periodic"], "grid.boundary must be periodic | free | [periodic, free], got"),
    ],
)  # fmt: skip
def test_other_boundaries(boundary: list[str], said: str) -> None:
    with pytest.raises(pc.JobError) as caught:
        pc.Simulation(job([8, 8], grid={"points": 8, "size": 1e-3, "boundary": boundary}))
    assert said in caught.value.mistakes[0]


def test_pairs_of_one_kind_are_that_kind(tmp_path: Path) -> None:
    for kind in ("periodic", "free"):
        grid = {"points": 8, "size": 1e-3, "boundary": [kind, kind]}
        assert pc.Simulation(job([8, 8], grid=grid)).job.grid.boundary == kind
