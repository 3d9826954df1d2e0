"""Maps from files: all formats give the same map, and what will not do is one sentence."""

import math
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
from numpy.testing import assert_allclose

from parcontact.errors import InputError
from parcontact.job import Topography, map_files
from parcontact.job.surfaces import MapUnits

SIZE = (6e-5, 4e-5)
HEIGHTS = 1e-6 * np.random.default_rng(5).standard_normal((16, 24))  # (ny, nx) [m]


def read(
    path: Path,
    unit: str | None = None,
    size: tuple[float, float] | None = None,
    channel: str | None = None,
    **more: Any,
) -> map_files.Map:
    given = {"unit": unit, "size": size, "channel": channel, **more}
    part = Topography.model_construct(path=path, **{key: value for key, value in given.items() if value is not None})
    return map_files.read_map(part)


def write(folder: Path) -> dict[str, tuple[Path, str | None, tuple[float, float] | None]]:
    """The same map in every format: path, and the unit and size that must be given."""
    import SurfaceTopography  # takes half a second

    microns = HEIGHTS * 1e6
    map_of = SurfaceTopography.Topography(microns.T, (SIZE[0] * 1e6, SIZE[1] * 1e6), unit="um")
    for ending in ("nc", "x3p", "gwy"):
        getattr(map_of, {"nc": "to_netcdf", "x3p": "to_x3p", "gwy": "to_gwy"}[ending])(str(folder / f"road.{ending}"))
    map_of.to_matrix(str(folder / "headed.txt"))
    np.save(folder / "road.npy", microns)
    np.savetxt(folder / "road.txt", microns, fmt="%.17g")
    y, x = np.indices(microns.shape)
    table = np.stack([x.ravel() * 2.5, y.ravel() * 2.5, microns.ravel()], axis=1)
    np.savetxt(folder / "road.xyz", np.random.default_rng(6).permutation(table), fmt="%.17g")
    own = {"road.npy": ("um", SIZE), "road.txt": ("um", SIZE), "road.xyz": ("um", None)}
    names = ["road.nc", "road.x3p", "road.gwy", "headed.txt", *own]
    return {name: (folder / name, *own.get(name, (None, None))) for name in names}


@pytest.mark.parametrize("name", ["road.nc", "road.x3p", "road.gwy", "headed.txt", "road.npy", "road.txt", "road.xyz"])
def test_all_formats_give_the_same_map(tmp_path: Path, name: str) -> None:
    """To 1e-12 of its height; headed.txt is written with fewer digits by SurfaceTopography."""
    found = read(*write(tmp_path)[name], None)
    assert found.heights.shape == HEIGHTS.shape
    assert_allclose(found.heights, HEIGHTS, rtol=0.0, atol=1e-12 * np.ptp(HEIGHTS))
    assert_allclose(found.size, SIZE, rtol=1e-12)


def rows(mark: str = " ", cell: float = 2.5, digits: int = 6) -> str:
    """Positions and heights of the map in um; positions in units of 1 um at a cell of 2.5."""
    y, x = np.indices(HEIGHTS.shape)
    columns = zip(x.ravel() * cell, y.ravel() * cell, HEIGHTS.ravel() * 1e6, strict=True)
    return "".join(mark.join((f"{a:.{digits}f}", f"{b:.{digits}f}", repr(float(z)))) + "\n" for a, b, z in columns)


UM = {"unit": "um"}
TABLES: dict[str, tuple[str, str, dict[str, Any]]] = {
    "three columns in .txt": ("road.txt", rows(), UM),
    "a header": ("road.xyz", "X Y Z\n" + rows(), UM),
    "names with units": ("road.csv", "x (um),y (um),z (um)\n" + rows(","), {}),
    "a file of a laboratory": ("road.dat", "Surface of 3 \xb5m\n\nx[um]; y[um]; z[um]\n" + rows(";"), {}),
    "positions in mm": ("road.xyz", rows(cell=2.5e-3), {"units": MapUnits(xy="mm", z="um")}),
    "names with two units": ("road.xyz", "x [mm] y [mm] z [um]\n" + rows(cell=2.5e-3), {}),
}


@pytest.mark.parametrize("case", TABLES)
def test_tables_of_positions(tmp_path: Path, case: str) -> None:
    """The same map to rounding, whatever separates numbers and stands above them; Latin-1 is read."""
    name, text, given = TABLES[case]
    (tmp_path / name).write_bytes(text.encode("latin-1"))
    found = read(tmp_path / name, **given)
    assert_allclose(found.heights, HEIGHTS, rtol=1e-12)
    assert_allclose(found.size, SIZE, rtol=1e-12)


@pytest.mark.parametrize(("cell", "digits"), [(1.6504, 3), (0.33333, 2), (2.5, 6)])
def test_positions_that_are_rounded(tmp_path: Path, cell: float, digits: int) -> None:
    """To fixed digits: the step is known to a digit over the length of the map."""
    (tmp_path / "road.xyz").write_text(rows(cell=cell, digits=digits))
    found = read(tmp_path / "road.xyz", "um")
    assert_allclose(found.heights, HEIGHTS, rtol=1e-12)
    for length, count in zip(found.size, (24, 16), strict=True):
        assert length / count == pytest.approx(cell * 1e-6, abs=10.0**-digits / (count - 1) * 1e-6)


def test_a_grid_of_esri(tmp_path: Path) -> None:
    """Its first row is the northernmost, with the largest y; its cells and its mark of missing points are read."""
    holed = HEIGHTS * 1e6
    holed[3, 5] = -9999.0
    head = "ncols 24\nnrows 16\nxllcorner 0.0\nyllcorner 0.0\ncellsize 2.5\nNODATA_value -9999\n"
    (tmp_path / "road.asc").write_text(head + "\n".join(" ".join(map(repr, row)) for row in holed[::-1].tolist()))
    found = read(tmp_path / "road.asc", "um")
    assert_allclose(found.size, SIZE, rtol=1e-12)
    assert np.argwhere(np.isnan(found.heights)).tolist() == [[3, 5]]
    assert_allclose(np.nan_to_num(found.heights), np.where(holed == -9999.0, 0.0, HEIGHTS), rtol=1e-12)


LINES: dict[str, tuple[str, str, dict[str, Any]]] = {
    "heights": ("line.txt", "".join(f"{z!r}\n" for z in HEIGHTS[0].tolist()), {"unit": "m", "pixel": (2.5e-6, 2.5e-6)}),
    "positions": ("line.csv", "x[um], z[m]\n" + "".join(f"{2.5 * i},{z}\n" for i, z in enumerate(HEIGHTS[0])), {}),
}


@pytest.mark.parametrize("case", LINES)
def test_line_scans(tmp_path: Path, case: str) -> None:
    name, text, given = LINES[case]
    (tmp_path / name).write_text(text)
    found = read(tmp_path / name, **given)
    assert found.is_line
    assert_allclose(found.heights, HEIGHTS[:1], rtol=1e-12)
    assert found.size[0] == pytest.approx(SIZE[0], rel=1e-12)


def test_a_line_scan_of_an_instrument(tmp_path: Path) -> None:
    """As SurfaceTopography reads it; heights of a scan that is not uniform are interpolated."""
    x = 2.5e-6 * np.arange(24.0)
    import SurfaceTopography

    SurfaceTopography.UniformLineScan(HEIGHTS[0], SIZE[0], unit="m").to_netcdf(str(tmp_path / "even.nc"))
    SurfaceTopography.NonuniformLineScan(x**2, 2.0 * x**2, unit="m").to_netcdf(str(tmp_path / "odd.nc"))
    even, odd = read(tmp_path / "even.nc"), read(tmp_path / "odd.nc")
    assert_allclose(even.heights, HEIGHTS[:1], rtol=1e-12)
    assert even.size[0] == pytest.approx(SIZE[0], rel=1e-7)  # single precision in the file
    assert np.ptp(np.diff(odd.heights[0])) <= 1e-12 * np.ptp(odd.heights)
    assert odd.size[0] == pytest.approx(x[-1] ** 2 * 24 / 23, rel=1e-12)


def test_missing_points(tmp_path: Path) -> None:
    """NaN in .npy and .txt, rows that are not there in .xyz."""
    holed = HEIGHTS.copy()
    holed[3, 5] = holed[0, 0] = np.nan
    np.save(tmp_path / "road.npy", holed)
    np.savetxt(tmp_path / "road.txt", holed)
    y, x = np.indices(holed.shape)
    table = np.stack([x.ravel(), y.ravel(), holed.ravel()], axis=1)
    np.savetxt(tmp_path / "road.xyz", table[np.isfinite(table[:, 2])])
    for name, size in (("road.npy", SIZE), ("road.txt", SIZE), ("road.xyz", None)):
        found = read(tmp_path / name, "m", size, None)
        assert np.array_equal(np.isnan(found.heights), np.isnan(holed))


@pytest.mark.parametrize("word", ["", "---", "#N/A", "NaN", "No Data", "n/a", "null"])
@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_words_for_missing_points(tmp_path: Path, word: str, mark: str) -> None:
    """One point is missing, in a matrix and in rows of positions; a mark ends each row."""
    cells = [[f"{z!r}" for z in row] for row in HEIGHTS.tolist()]
    cells[3][5] = word
    (tmp_path / "matrix.txt").write_text("".join(mark.join(row) + mark + "\n" for row in cells))
    table = "".join(f"{x}{mark}{y}{mark}{z}\n" for y, row in enumerate(cells) for x, z in enumerate(row))
    (tmp_path / "table.xyz").write_text(table)
    for name, size in (("matrix.txt", SIZE), ("table.xyz", None)):
        found = read(tmp_path / name, "m", size)
        assert np.argwhere(np.isnan(found.heights)).tolist() == [[3, 5]]
        assert_allclose(np.delete(found.heights, 77), np.delete(HEIGHTS, 77), rtol=1e-12)


def test_a_word_between_blanks(tmp_path: Path) -> None:
    (tmp_path / "road.xyz").write_text(rows().replace(f"{float(HEIGHTS[3, 5] * 1e6)!r}", "No Data"))
    assert np.argwhere(np.isnan(read(tmp_path / "road.xyz", "um").heights)).tolist() == [[3, 5]]


def test_the_array_that_the_job_names(tmp_path: Path) -> None:
    """The first one with numbers and two axes, or that of `channel`, also in a group; rows are along x, as in .npy."""
    with h5py.File(tmp_path / "road.h5", "w") as file:
        file["area"], file["heights"], file["more/heights"] = 1.0, HEIGHTS, 2.0 * HEIGHTS
    scipy.io.savemat(tmp_path / "road.mat", {"name": "road", "heights": HEIGHTS, "more/heights": 2.0 * HEIGHTS})
    for ending in ("h5", "mat"):
        path = tmp_path / f"road.{ending}"
        assert np.array_equal(read(path, "m", SIZE).heights, HEIGHTS)
        assert np.array_equal(read(path, "m", SIZE, "more/heights").heights, 2.0 * HEIGHTS)


def test_a_file_of_matlab_7_3_is_refused(tmp_path: Path) -> None:
    """It is HDF5 behind 512 bytes, with the axes in the other order."""
    with h5py.File(tmp_path / "road.mat", "w", userblock_size=512) as file:
        file["heights"] = HEIGHTS.T
    with (tmp_path / "road.mat").open("r+b") as start:
        start.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM")
    with pytest.raises(InputError, match=r"road\.mat cannot be read: .* matlab v7\.3"):
        read(tmp_path / "road.mat", "m", SIZE)


def test_columns_in_another_order(tmp_path: Path) -> None:
    """The names of columns count, not their places."""
    y, x = np.indices(HEIGHTS.shape)
    table = np.stack([HEIGHTS.ravel() * 1e9, y.ravel() * 2.5, x.ravel() * 2.5], axis=1)
    np.savetxt(tmp_path / "road.txt", table, fmt="%.17g", header="z/nm y/um x/um")
    found = read(tmp_path / "road.txt")
    assert_allclose(found.heights, HEIGHTS, rtol=1e-12)
    assert_allclose(found.size, SIZE, rtol=1e-12)


BLOCK = "".join(" ".join(f"{z!r}" for z in row) + "\n" for row in HEIGHTS.tolist())


@pytest.mark.parametrize("between", ["\n", "\n\n", "# channel 2\n"])
def test_a_second_block_is_refused(tmp_path: Path, between: str) -> None:
    (tmp_path / "road.txt").write_text(BLOCK + between + BLOCK)
    line = 17 + between.count("\n")
    with pytest.raises(InputError, match=rf"road\.txt:{line}: a second block of numbers"):
        read(tmp_path / "road.txt", "m", SIZE)
    (tmp_path / "road.txt").write_text(BLOCK.replace("\n", "\n\n"))  # blank lines between all rows
    assert np.array_equal(read(tmp_path / "road.txt", "m", SIZE).heights, HEIGHTS)


def test_positions_given_twice_are_refused(tmp_path: Path) -> None:
    (tmp_path / "road.xyz").write_text(rows() + "\n" + rows())
    with pytest.raises(InputError, match="384 positions have two heights"):
        read(tmp_path / "road.xyz", "um")


def save(path: Path, values: object) -> None:
    if path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            file["heights"] = values
            return
    with path.open("wb") as file:
        np.save(file, np.asarray(values), allow_pickle=True)


SQUARE = "".join(f"{x} {y} 0\n" for x in range(6) for y in range(6))
BAD = {
    "no unit": ("road.npy", HEIGHTS, (None, SIZE, None), "does not say the unit of its heights"),
    "no size": ("road.npy", HEIGHTS, ("m", None, None), "does not say how large its map is"),
    "a block": ("road.npy", HEIGHTS[None], ("m", SIZE, None), "has 3 dimensions; a map of two"),
    "words": ("road.npy", [["a", "b"]], ("m", SIZE, None), "holds values of type <U1; real numbers were expected"),
    "complex": (
        "road.npy",
        HEIGHTS * 1j,
        ("m", SIZE, None),
        "holds values of type complex128; real numbers were expected",
    ),
    "too high": ("road.npy", HEIGHTS * 1e306, ("m", SIZE, None), "1e-70 to 1e+70 m were expected"),
    "too wide": (
        "road.npy",
        HEIGHTS,
        ("m", (math.inf, 1.0), None),
        "would be inf x 1 m; two positive lengths were expected",
    ),
    "nowhere": (
        "road.xyz",
        SQUARE + "1 inf 0\n",
        ("m", None, None),
        "the map would be 6 x inf m; two positive lengths were expected",
    ),
    "a stray point": ("road.xyz", SQUARE + "1e300 0 0\n", ("m", None, None), "positions along x are not equally"),
    "objects": ("road.npy", [[None, {}]], ("m", SIZE, None), "cannot be read"),
    "few points": ("road.npy", HEIGHTS[:3], ("m", SIZE, None), "at least 4 each way"),
    "mostly missing": ("road.npy", np.where(HEIGHTS > -1e-7, np.nan, HEIGHTS), ("m", SIZE, None), "more than half"),
    "a word": ("road.xyz", "1 2 x\n", ("m", None, None), "cannot be read"),
    "an unknown format": (
        "road.abc",
        "what is this",
        (None, None, None),
        "in a format that SurfaceTopography does not know",
    ),
    "ragged": ("road.txt", "1 2 3\n4 5\n", ("m", SIZE, None), "road.txt:2: 2 numbers; 3 were expected, as in line 1"),
    "no bytes": ("road.npy", b"", ("m", SIZE, None), "it is empty"),
    "no values": ("road.npy", np.empty((0, 8)), ("m", SIZE, None), "an array of shape (0, 8), without values"),
    "no heights": ("road.nms", "\0" * 3468, (None, None, None), "in a format that SurfaceTopography does not know"),
    "bytes": ("road.bin", bytes(range(200)) * 25, ("m", SIZE, None), "has no channel of heights"),
    "decimal commas": (
        "road.txt",
        "1,25 3,4 0 -2.1\n" * 4,
        ("m", SIZE, None),
        "road.txt:1: a number was expected, got '25 3'",
    ),
    "one row": ("road.xyz", "1 2\n3 4\n", ("m", None, None), "has 2 positions along x"),
    "no grid": (
        "road.xyz",
        "".join(f"{x * x} {y} 0\n" for x in range(6) for y in range(6)),
        ("m", None, None),
        "positions along x are not equally spaced",
    ),
    "a size twice": ("road.xyz", SQUARE, ("m", SIZE, None), "leave out size"),
    "an array in a file of another name": (
        "road.npz",
        HEIGHTS,
        ("m", SIZE, None),
        "save an array of another kind by numpy.save",
    ),
    "numbers in a file of another name": ("road.map", rows(), ("um", None, None), "rename it to end in .npy, .h5"),
    "a channel of an array": ("road.npy", HEIGHTS, ("m", SIZE, "Gloss"), "has no channel 'Gloss': it holds one map"),
    "a channel of numbers": ("road.txt", rows(), ("m", None, "Gloss"), "has no channel 'Gloss': it holds one map"),
    "a channel that HDF5 lacks": ("road.h5", HEIGHTS, ("m", SIZE, "Gloss"), "has no channel 'Gloss'; it has heights"),
    "the size of a header, twice": ("headed.txt", None, ("um", SIZE, None), "leave out size"),
    "a unit twice": ("road.nc", None, ("mm", None, None), "leave out unit"),
    "its size twice": ("road.nc", None, (None, SIZE, None), "leave out size"),
    "an unknown channel": ("road.nc", None, (None, None, "Gloss"), "has no channel 'Gloss'; it has Default"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_will_not_do(tmp_path: Path, case: str) -> None:
    name, content, given, sentence = BAD[case]
    path = tmp_path / name
    if content is None:
        write(tmp_path)
    elif isinstance(content, str):
        path.write_text(content)
    elif isinstance(content, bytes):
        path.write_bytes(content)
    else:
        save(path, content)
    with pytest.raises(InputError) as failure:
        read(path, *given)
    assert sentence in str(failure.value)
    assert "\n" not in str(failure.value)


def test_a_header_of_gigabytes(tmp_path: Path) -> None:
    """In a file whose bytes are not on the disk: it is not read."""
    with (tmp_path / "road.npy").open("wb") as file:
        file.write(b"\x93NUMPY\x02\x00\xff\xff\xff\xe0")
        file.truncate(3_900_000_000)
    with pytest.raises(InputError, match="its header has more than 1 MB"):
        read(tmp_path / "road.npy", "m", SIZE, None)


@pytest.mark.parametrize("ending", ["x3p", "gwy", "nc"])
def test_half_a_file(tmp_path: Path, ending: str) -> None:
    """Whatever its reader raises."""
    path = write(tmp_path)[f"road.{ending}"][0]
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(InputError, match=r"road\.\w+ (cannot be read|is damaged)"):
        read(path, None, None, None)


READ_WITHOUT = ("road.npy", "road.h5", "road.mat", "road.txt", "road.xyz", "noted.csv")


@pytest.mark.parametrize("name", [*READ_WITHOUT, "road.x3p", "headed.txt"])
def test_numbers_do_not_depend_on_what_is_installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """Without SurfaceTopography a map is the same to the last digit, or is refused; headers without a size are text."""
    _, unit, size = {"noted.csv": (None, "um", SIZE), **write(tmp_path)}.get(name, (None, "um", SIZE))
    save(tmp_path / "road.h5", HEIGHTS * 1e6)
    scipy.io.savemat(tmp_path / "road.mat", {"name": "road", "heights": HEIGHTS * 1e6})
    np.savetxt(tmp_path / "noted.csv", HEIGHTS * 1e6, fmt="%.17g", delimiter=",", header="date: a day\nunit: um")
    found = read(tmp_path / name, unit, size)
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
    if name in READ_WITHOUT:
        assert np.array_equal(read(tmp_path / name, unit, size).heights, found.heights)
        return
    with pytest.raises(InputError, match="pip install 'parcontact"):
        read(tmp_path / name, unit, size)
