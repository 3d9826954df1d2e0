"""A measured road in a job: the truth comes back, on any number of ranks, and mistakes name their key."""

import math
import re
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from conftest import Main, RunParcontact
from mpi4py import MPI

import parcontact as pc
from parcontact import job as jobs
from parcontact.errors import InputError
from parcontact.job import measured_maps
from parcontact.march import mesh, sanity, scene
from parcontact.parallel.slab import Slab

from . import truth

LENGTH, POINTS, SLOPE = 1e-3, 192, 0.05
JOB = """
grid: {{points: [{points}, {points}], size: {size}}}
surface: {{shape: topography, path: road.npy, unit: um, size: [1.0e-3, 1.0e-3]{more}}}
material: {{model: elastic, shear_modulus: 1.0e6}}
history: [{{pressure: 1.0e4}}]
"""


@pytest.fixture
def road(shared_path: Path, comm: MPI.Intracomm) -> Path:
    """A cut of a larger road in um, tilted, 2 % of it missing."""
    if comm.rank == 0:
        heights = truth.rough(2 * POINTS, 2 * LENGTH, 2.5e-4, 4e-5, SLOPE)[:POINTS, :POINTS]
        y, x = np.mgrid[0:POINTS, 0:POINTS] / POINTS
        measured = heights + 3e-5 * x - 1e-5 * y
        measured[np.random.default_rng(0).random(measured.shape) < 0.02] = np.nan
        np.save(shared_path / "road.npy", measured * 1e6)
        np.save(shared_path / "truth.npy", heights)
    comm.barrier()
    return shared_path


def heights_of(
    folder: Path, comm: MPI.Intracomm, points: int = POINTS, size: float = LENGTH, more: str = ""
) -> np.ndarray:
    """The whole map of a job, on every rank; collective."""
    path = folder / comm.bcast(f"job-{comm.size}-of-{MPI.COMM_WORLD.rank}.yaml")  # ranks that are alone share no file
    if comm.rank == 0:
        path.write_text(JOB.format(points=points, size=size, more=more))
    comm.barrier()
    base = scene.set_up(mesh.load(path), Slab(comm, points, points))
    rows = base.surface.heights((0.0, 0.0), base.slab.empty()) * base.units.height
    return np.concatenate(comm.allgather(rows))


@pytest.mark.mpi
def test_the_same_on_any_ranks(road: Path, communicators: list[MPI.Intracomm]) -> None:
    alone = heights_of(road, MPI.COMM_SELF)
    for comm in communicators:
        assert np.abs(heights_of(road, comm) - alone).max() <= 1e-12 * np.ptp(alone)


@pytest.mark.parametrize("periodic", ["smooth", "mirror"])
@pytest.mark.parametrize("finer", [1, 2])
def test_the_slope_comes_back(road: Path, periodic: str, finer: int) -> None:
    """With 2 % of missing points, a tilt and edges that do not fit, the rms slope is that of the truth to 2 %, on the
    map's own points and on twice as many."""
    copies = 2 if periodic == "mirror" else 1
    found = heights_of(road, MPI.COMM_SELF, copies * finer * POINTS, copies * LENGTH, f", periodic: {periodic}")
    inside = 2 * POINTS
    full = truth.rough(inside, 2 * LENGTH, 2.5e-4, 4e-5, SLOPE)
    part = full[:POINTS, :POINTS]
    expected = truth.central_slope(part, LENGTH, 1) * SLOPE / truth.central_slope(full, 2 * LENGTH, 1)
    assert truth.rms_slope(found, copies * LENGTH) == pytest.approx(expected, rel=0.02)


def test_a_larger_box_is_refused(road: Path) -> None:
    with pytest.raises(
        InputError, match=r"the box is 0\.002 m along y, but the map only 0\.001 m; use a smaller grid.size"
    ):
        heights_of(road, MPI.COMM_SELF, POINTS, 2 * LENGTH)


def test_missing_points_may_be_refused(road: Path) -> None:
    with pytest.raises(InputError, match="of its points are missing; give fill: true"):
        heights_of(road, MPI.COMM_SELF, more=", fill: false")


def test_another_part_of_the_map(road: Path) -> None:
    """The box has exactly the points around the centre, of a map that has no trend and is not resampled."""
    plain, half = ", periodic: none, detrend: mean", POINTS // 2
    heights = np.load(road / "truth.npy")
    np.save(road / "road.npy", heights * 1e6)
    found = heights_of(road, MPI.COMM_SELF, half, LENGTH / 2, f"{plain}, centre: [2.5e-4, 7.5e-4]")
    part = heights[half:, :half]
    assert np.abs(found - (part - part.mean())).max() <= 1e-12 * np.ptp(part)
    with pytest.raises(
        InputError, match=r"around 0.0002 m along x leaves the map.*; a centre of 0.00025 to 0.00075 m was expected"
    ):
        heights_of(road, MPI.COMM_SELF, half, LENGTH / 2, f"{plain}, centre: [2.0e-4, 7.5e-4]")


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        (", unit: inch", "surface.unit must be m | mm | um | nm, got 'inch'"),
        (", detrend: slope", "surface.detrend must be none | mean | tilt | curvature, got 'slope'"),
        (", scale: 2", "surface.scale is not a key of shape topography"),
        (", short_wavelength: 2e-3", "surface.short_wavelength must fit into the box of 0.001 m, got 0.002"),
    ],
)
def test_mistakes_name_their_key(road: Path, more: str, sentence: str) -> None:
    key = more.split(":")[0].strip(", ")
    kept = [part for part in ("path: road.npy", "unit: um", "size: [1.0e-3, 1.0e-3]") if not part.startswith(key + ":")]
    text = JOB.format(points=8, size=1e-3, more=more)
    text = text.replace("path: road.npy, unit: um, size: [1.0e-3, 1.0e-3]", ", ".join(kept))
    (road / "job.yaml").write_text(text)
    with pytest.raises(jobs.JobError) as failure:
        mesh.load(road / "job.yaml")
    assert sentence in str(failure.value)
    assert ":3:" in str(failure.value)


def test_the_verb_surface(road: Path, main: "Main", run_parcontact: "RunParcontact") -> None:
    """What it says is what the truth has; its picture is one; two ranks speak once."""
    (road / "job.yaml").write_text(JOB.format(points=POINTS, size=LENGTH, more=""))
    done = run_parcontact(["surface", "job.yaml", "--out", "road.png"], ranks=2, cwd=road)
    assert done.returncode == 0, done.stderr
    assert "missing points (2" in done.stdout or "missing points (1.9" in done.stdout
    (slope,) = re.findall(r"rms slope +(\S+)", done.stdout)
    assert float(slope) == pytest.approx(SLOPE, rel=0.05)
    assert matplotlib.image.imread(road / "road.png").shape[1] == 1160  # the width of every picture
    code, _, err = main("surface", road / "job.yaml", "--out", road / "road.doc")
    assert code == 2
    assert err.startswith("parcontact: --out must end in .png, .pdf, .svg")
    (road / "large.yaml").write_text(JOB.format(points=10**7, size=LENGTH, more=""))
    code, _, err = main("surface", road / "large.yaml")
    assert code == 2
    assert "10000000 x 10000000 points need at least" in err


# -- what is taken out of a map, and what is doubted ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("more", "doubt"),
    [
        ("size: [1.5, 1.5]", "the map is 1.5 x 1.5 m; are lengths in m?"),
        ("pixel: 0.01", "the map is 1.92 x 1.92 m; are lengths in m?"),
        ("pixel: 2.0e-12", "the spacing of points is 0.002 nm, less than the size of atoms; is the unit right?"),
        ("pixel: [1.3e-5, 3.0e-5]", "the spacing of points is 13 µm along x and 30 µm along y"),
        ("unit: nm, size: [1.0e-2, 1.0e-2]", "the map is 10 mm x 10 mm, and its heights differ by 3"),
        ("pixel: [1.3e-5, 1.4e-5]", ""),
    ],
)
def test_sizes_that_are_doubted(road: Path, more: str, doubt: str) -> None:
    """A map of more than a metre, points nearer than atoms, heights of less than 1e-5 of its side, and
    pixels that are no squares."""
    text = JOB.replace("unit: um, size: [1.0e-3, 1.0e-3]", more if "unit" in more else f"unit: um, {more}").replace(
        "size: {size}", "size: from surface"
    )
    (road / "job.yaml").write_text(text.format(points=POINTS, more=", outliers: clip"))
    found = scene.set_up(mesh.load(road / "job.yaml"), Slab.alone(POINTS, POINTS)).remarks.doubts
    assert bool(found) == bool(doubt)
    assert not doubt or any(doubt in str(each) and str(each).startswith("surface: road.npy: ") for each in found)


def test_clipped_outliers_are_no_doubt(road: Path) -> None:
    heights = truth.rough(POINTS, LENGTH, 2.5e-4, 4e-5, SLOPE)
    heights[60, 70] += 20e-6
    np.save(road / "road.npy", heights * 1e6)
    (road / "job.yaml").write_text(JOB.format(points=POINTS, size=LENGTH, more=", outliers: clip"))
    setup = scene.set_up(jobs.load(road / "job.yaml"), Slab.alone(POINTS, POINTS))
    assert setup.remarks.doubts == []
    assert "road: outliers set to the median of their neighbours: 1" in setup.remarks.notes


@pytest.mark.parametrize("more", ["", ", nodata: -999.0"])
def test_a_map_whose_missing_points_have_a_number_is_not_asked_for_it(road: Path, more: str) -> None:
    heights = truth.rough(POINTS, LENGTH, 2.5e-4, 4e-5, SLOPE)
    heights[60, 70] += 20e-6
    np.save(road / "road.npy", heights * 1e6)
    (road / "job.yaml").write_text(JOB.format(points=POINTS, size=LENGTH, more=more))
    (doubt, *_) = scene.set_up(jobs.load(road / "job.yaml"), Slab.alone(POINTS, POINTS)).remarks.doubts
    assert "give outliers: clip" in str(doubt)
    assert ("or nodata: NUMBER" in str(doubt)) == (not more)


def test_bands_have_no_direction() -> None:
    part = {"shape": "rough", "hurst": 0.8, "long_wavelength": 1e-3, "short_wavelength": 1e-5, "rms_slope": 0.1}
    job = {
        "bands": "auto",
        "material": {"include": "synthetic_tyre"},
        "steady": {"velocities": [0.1], "pressures": [1e5]},
    }
    assert jobs.load({**job, "surface": part}).bands is not None
    with pytest.raises(jobs.JobError, match=r"surface\.anisotropy cannot be used with bands"):
        jobs.load({**job, "surface": {**part, "anisotropy": {"ratio": 3}}})


# -- the grid of the map, and a map without a job ---------------------------------------------------------------------


def grid_of(road: Path, grid: str, surface: str = "") -> jobs.Grid:
    surface = surface or "{shape: topography, path: road.npy, unit: um, size: [1.0e-3, 2.0e-3]}"
    text = f"grid: {grid}\nsurface: {surface}\n" + "".join(JOB.splitlines(True)[3:]).replace("{{", "{")
    (road / "job.yaml").write_text(text.replace("}}", "}"))
    return mesh.load(road / "job.yaml").grid


@pytest.mark.parametrize(
    ("grid", "points", "size"),
    [
        ("{points: from surface, size: from surface}", (POINTS, POINTS), (1e-3, 2e-3)),
        ("{points: 64, size: from surface}", (64, 64), (1e-3, 2e-3)),
        ("{points: from surface, size: [1.0e-3, 1.0e-3]}", (POINTS, POINTS // 2), (1e-3, 1e-3)),
    ],
)
def test_the_grid_is_that_of_the_map(road: Path, grid: str, points: tuple[int, int], size: tuple[float, float]) -> None:
    """All of it, or the points that the map has in the box that is given."""
    found = grid_of(road, grid)
    assert (found.points, found.size) == (points, size)


def test_the_grid_of_a_mirrored_map_is_twice_as_long(road: Path) -> None:
    surface = "{shape: topography, path: road.npy, unit: um, size: [1.0e-3, 1.0e-3], periodic: mirror}"
    found = grid_of(road, "{points: from surface, size: from surface}", surface)
    assert (found.points, found.size) == ((2 * POINTS, 2 * POINTS), (2e-3, 2e-3))


@pytest.mark.parametrize(
    ("surface", "sentence"),
    [
        (
            "{shape: flat}",
            "1:16: grid.points and grid.size: from surface: one measured map, shape: topography, is needed, and the "
            "surface has none",
        ),
        (
            "{shape: topography, path: road.npy, size: [1, 1]}",
            "road.npy does not say the unit of its heights: give unit: m | mm",
        ),
    ],
)
def test_a_grid_of_no_map_is_one_sentence(road: Path, surface: str, sentence: str) -> None:
    """At the first key that asks for it, or at the surface whose map cannot be read."""
    with pytest.raises(jobs.JobError) as failure:
        grid_of(road, "{points: from surface, size: from surface}", surface)
    (mistake,) = failure.value.mistakes
    assert "job.yaml:2:10: surface: /" in mistake or "grid.points" in mistake
    assert sentence in mistake


def test_an_array_has_points_but_no_size(road: Path) -> None:
    job = {"surface": np.zeros((4, 6)), "material": {"model": "elastic", "shear_modulus": 1e6}, "history": []}
    job |= {"history": [{"pressure": 1.0}], "grid": {"points": "from surface", "size": 1e-3}}
    assert mesh.load(job).grid.points == (6, 4)
    with pytest.raises(jobs.JobError, match="an array has points, but no size"):
        mesh.load(job, {"grid.size": "from surface"})


def test_a_map_without_a_job(road: Path, main: "Main", monkeypatch: pytest.MonkeyPatch) -> None:
    """What it is like, a picture, and a job to start from that loads, with the whole map; nothing is replaced."""
    words = ["surface", "road.npy", "--set", "surface.unit=um", "--set", "surface.size=[1e-3, 1e-3]"]
    monkeypatch.chdir(road)
    code, out, err = main(*words, "--job", "start/job.yaml")
    assert code == 0, err
    for line in (r"size +1 mm x 1 mm", r"points +192 x 192", r"pixel +5.208 µm x 5.208 µm"):
        assert re.search(f"^{line}$", out, re.MULTILINE)
    for line in (r"missing +(2(.\d)?|1.9) %", r"rms slope +0.0", r"spectrum +waves of 1 mm to 10.42 µm"):
        assert re.search(f"^{line}", out, re.MULTILINE)
    assert matplotlib.image.imread(road / "road-surface.png").ndim == 3
    found = mesh.load(road / "start/job.yaml")
    assert (found.grid.points, found.grid.size) == ((POINTS, POINTS), (LENGTH, LENGTH))
    written = (road / "start/job.yaml").read_text()
    for line in (f"points: [{POINTS}, {POINTS}]", "detrend: tilt", "periodic: smooth"):
        assert line in written
    assert main(*words, "--job", "start/job.yaml")[0] == 2
    code, _, err = main("surface", "road.npy")
    assert code == 2
    assert "does not say the unit of its heights" in err
    assert "--set surface.unit=um --set surface.size=[1e-3,1e-3]" in err
    (road / "grid.xyz").write_text("".join(f"{x} {y} {x * y % 3}\n" for y in range(8) for x in range(9)))
    _, _, err = main("surface", "grid.xyz")
    assert "the unit of its positions and heights: give unit: m | mm | um | nm, or units: {xy: UNIT, z: UNIT}" in err
    assert err.endswith("--set surface.unit=um\n")


@pytest.mark.parametrize(
    ("cells", "more", "written"),
    [
        (16, "", "accuracy: 0.05}  # estimate for these points"),
        (2, "", "accuracy: 0.01}  # needs more points"),
        (3, "numerics.accuracy=0.03", "accuracy: 0.03}\n"),
    ],
)
def test_a_job_to_start_from_asks_for_what_its_points_keep(
    shared_path: Path, main: "Main", monkeypatch: pytest.MonkeyPatch, cells: int, more: str, written: str
) -> None:
    """The command writes the smallest accuracy for which `points: auto` takes no more points than the map has."""
    np.save(shared_path / "road.npy", truth.rough(POINTS, LENGTH, 2.5e-4, cells * LENGTH / POINTS, SLOPE) * 1e6)
    monkeypatch.chdir(shared_path)
    words = ["surface", "road.npy", "--set", "surface.unit=um", "--set", "surface.size=[1e-3, 1e-3]"]
    code, _, err = main(*words, *(["--set", more] if more else []), "--job", "job.yaml")
    assert code == 0, err
    assert written in (shared_path / "job.yaml").read_text()
    if "keep" in written:
        finer, kept = (
            mesh.load(shared_path / "job.yaml", ["grid.points=auto", f"numerics.accuracy={a}"]).grid.points
            for a in (0.02, 0.05)
        )
        assert max(kept) <= POINTS < max(finer)


@pytest.mark.mpi
def test_points_that_stick_out(shared_path: Path, comm: MPI.Intracomm, communicators: list[MPI.Intracomm]) -> None:
    """Every rank warns of them, with the slope of the truth, and that of the truth and two single points. To 2 %: edges
    are joined. The advice on the mesh says that its wave may be theirs."""
    heights, high = truth.rough(POINTS, LENGTH, 2.5e-4, 4e-5, SLOPE), 20e-6
    spiked = heights.copy()
    spiked[[60, 90], [70, 100]] += high, -high
    squares = (2 * np.pi * np.fft.fftfreq(POINTS, LENGTH / POINTS)) ** 2  # a point has all waves identical
    expected = math.sqrt(SLOPE**2 + 2 * (high / POINTS) ** 2 * 2 * squares.mean())
    if comm.rank == 0:
        np.save(shared_path / "road.npy", spiked * 1e6)
        (shared_path / "job.yaml").write_text(JOB.format(points=POINTS, size=LENGTH, more=""))
    comm.barrier()
    job = mesh.load(shared_path / "job.yaml")
    for group in communicators:
        doubts = [*map(str, sanity.check_heights(scene.set_up(job, Slab(group, POINTS, POINTS))))]
        assert group.allgather(doubts) == [doubts] * group.size
        assert doubts[0].startswith("surface: 2 points of the map differ from their neighbours by more than 16 times")
        found = [float(text) for text in re.findall(r"([0-9.]+) with(?:out)?\b", doubts[0])]
        assert found == pytest.approx([expected, SLOPE], rel=0.02)
        assert "by the spectrum of the heights, which has outliers" in doubts[1]


# -- a box as large as a point of the map, or smaller, is refused instead of being flat -------------------------------

APART = 1e-5  # m, from one point of the map to the next


@pytest.fixture
def fine_map(tmp_path: Path) -> dict[str, object]:
    np.save(tmp_path / "road.npy", np.random.default_rng(1).standard_normal((16, 16)))
    size = [16 * APART, 16 * APART]
    return {"shape": "topography", "path": str(tmp_path / "road.npy"), "unit": "um", "size": size}


@pytest.mark.parametrize("periodic", ["smooth", "mirror"])
@pytest.mark.parametrize("size", [0.01 * APART, 0.9 * APART, [10 * APART, 1.4 * APART]])
def test_a_box_of_one_point(fine_map: dict[str, object], size: object, periodic: str) -> None:
    with pytest.raises(
        pc.InputError, match=r"the box is .* m along \w, below the spacing of points of the map, 1e-05 m"
    ):
        pc.surface({**fine_map, "periodic": periodic}, {"points": 8, "size": size})


def test_a_profile_is_one_point_wide(fine_map: dict[str, object]) -> None:
    heights = pc.surface(fine_map, {"points": [8, 1], "size": [8 * APART, APART]})
    assert heights.shape == (1, 8)
    assert np.ptp(heights) > 0.0


def test_a_periodic_map_is_filtered_periodically(tmp_path: Path) -> None:
    """A low-pass of a map that is periodic leaves its long waves exactly, to rounding, in a periodic box; a map with a
    jump at its edge is no such map."""
    x = 2 * np.pi * np.arange(48) / 48
    long = 1e-6 * np.cos(3 * x)[None, :] * np.cos(2 * x)[:, None]
    np.save(tmp_path / "map.npy", long + 1e-7 * np.cos(16 * x + 0.4)[None, :] * np.cos(17 * x)[:, None])
    surface = {"shape": "topography", "path": str(tmp_path / "map.npy"), "unit": "m", "size": [1e-3, 1e-3]} | {
        **{"detrend": "mean", "periodic": "none", "short_wavelength": 1e-4}
    }
    rest = {"material": {"model": "elastic", "shear_modulus": 1e6}, "history": [{"pressure": 1e3}]}
    job = jobs.load({"grid": {"points": 48, "size": 1e-3}, "surface": surface, **rest})
    setup = scene.set_up(job, Slab.alone(48, 48))
    heights = setup.surface.heights((0.0, 0.0), setup.slab.empty()) * setup.units.height
    np.testing.assert_allclose(heights - heights.mean(), long, atol=1e-15)
    assert measured_maps.is_periodic(long)
    assert not measured_maps.is_periodic(long + 1e-6 * x)
