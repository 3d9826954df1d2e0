"""Heights from files: each rank its rows, and every mistake in one sentence on every rank."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from parcontact.errors import InputError
from parcontact.parallel.slab import Slab
from parcontact.physics import surface

from .heightfiles import KINDS, NX, NY, complaint, made, write
from .maps import random_map

pytestmark = pytest.mark.mpi


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("nx", "ny"), [(NX, NY), (4, 1), (1, 3)])
def test_rows(
    comm: MPI.Intracomm, communicators: list[MPI.Intracomm], shared_path: Path, kind: str, nx: int, ny: int
) -> None:
    """Every digit, on any number of ranks, also where some have no row."""
    whole = random_map(nx, ny)
    path = made(comm, shared_path / f"map.{kind}", lambda path: write(path, whole))
    for group in communicators:
        slab = Slab(group, nx, ny)
        rows = surface.read_heights(path, "heights", slab)
        assert rows.dtype == np.float64
        assert_array_equal(rows, whole[slab.rows])


def test_columns_first(comm: MPI.Intracomm, shared_path: Path) -> None:
    whole = random_map(NX, NY)
    path = made(comm, shared_path / "map.npy", lambda path: np.save(path, np.asfortranarray(whole)))
    slab = Slab(comm, NX, NY)
    assert_array_equal(surface.read_heights(path, "", slab), whole[slab.rows])


def test_comments_and_empty_lines(comm: MPI.Intracomm, shared_path: Path) -> None:
    text = "# road\n\n" + "1 2 3 4 5 6 7 # first\n   \n" * NY + "#end"
    path = made(comm, shared_path / "map.txt", lambda path: path.write_text(text))
    slab = Slab(comm, NX, NY)
    assert_array_equal(surface.read_heights(path, "", slab), np.tile(np.arange(1.0, 8.0), (slab.shape[0], 1)))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shape", [(NX, NY), (NY - 1, NX), (NY, NX + 1), (2 * NY, NX)])
def test_other_shape(comm: MPI.Intracomm, shared_path: Path, kind: str, shape: tuple[int, int]) -> None:
    path = made(comm, shared_path / f"map.{kind}", lambda path: write(path, np.ones(shape)))
    said = complaint(comm, path)
    if kind == "txt" and shape[1] != NX:
        assert f":2 has {shape[1]} numbers, but the grid has nx = {NX}" in said
    else:
        assert f"has shape {shape}, but the grid has (ny, nx) = ({NY}, {NX})" in said


@pytest.mark.parametrize("kind", ["npy", "h5"])
@pytest.mark.parametrize("shape", [(), (NX * NY,), (NY, NX, 1)])
def test_no_map(comm: MPI.Intracomm, shared_path: Path, kind: str, shape: tuple[int, ...]) -> None:
    path = made(comm, shared_path / f"map.{kind}", lambda path: write(path, np.ones(shape)))
    assert f"has shape {shape}" in complaint(comm, path)


@pytest.mark.parametrize("kind", KINDS)
def test_missing(comm: MPI.Intracomm, shared_path: Path, kind: str) -> None:
    assert "cannot be read: " in complaint(comm, shared_path / f"none.{kind}")


@pytest.mark.parametrize("kind", KINDS)
def test_a_directory(comm: MPI.Intracomm, shared_path: Path, kind: str) -> None:
    assert "cannot be read: " in complaint(comm, made(comm, shared_path / f"map.{kind}", Path.mkdir))


@pytest.mark.parametrize("kind", ["npy", "h5"])
@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"no such format\n",
        b"\x93NUMPY\x01\x00",
        b"\x93NUMPY\x01\x00\x08\x00{'a': ((",
        b"\x93NUMPY\x01\x00\x02\x00)(",
    ],
)
def test_unreadable(comm: MPI.Intracomm, shared_path: Path, kind: str, content: bytes) -> None:
    path = made(comm, shared_path / f"map.{kind}", lambda path: path.write_bytes(content))
    assert "cannot be read: " in complaint(comm, path)


def test_cut_short(comm: MPI.Intracomm, shared_path: Path) -> None:
    def make(path: Path) -> None:
        write(path, random_map(NX, NY))
        path.write_bytes(path.read_bytes()[:-100])

    for kind in ("npy", "h5"):
        assert "cannot be read: " in complaint(comm, made(comm, shared_path / f"map.{kind}", make))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "has shape (0, 7)"),
        (b"# only a comment\n", "has shape (0, 7)"),
        (b"1 2 3\n", ":1 has 3 numbers"),
        (b"1,2,3,4,5,6,7,8\n" * NY, ":1 has 8 numbers"),
        (b"Height map\n" + b"1 2 3 4 5 6 7\n" * NY, "7 numbers a line were expected, got 'Height map'"),
        (b"1 2 3 4 5 6 7\n" * (NY - 1) + b"1 2 3 4 5 6 high\n", f":{NY}: a number was expected, got 'high'"),
        (b"1 2 3 4 5 6 7\n" * (NY - 1) + b"1 2 3 4 5 6\n", f":{NY} has 6 numbers"),
        (b"\0" * 10_000, ":1 has 8000 characters or more; 7 numbers were expected"),
        (b"\xff\xfe\x00 2 3 4 5 6 7\n" * NY, "7 numbers a line were expected"),
    ],
)
def test_text_that_is_no_map(comm: MPI.Intracomm, shared_path: Path, content: bytes, said: str) -> None:
    path = made(comm, shared_path / "map.txt", lambda path: path.write_bytes(content))
    assert said in complaint(comm, path)


def test_dataset(comm: MPI.Intracomm, shared_path: Path) -> None:
    path = made(comm, shared_path / "map.h5", lambda path: write(path, random_map(NX, NY)))
    assert "has no dataset 'road'; it has heights, other" in complaint(comm, path, "road")
    assert "has no dataset 'other'" in complaint(comm, path, "other")


@pytest.mark.parametrize("values", [np.full((NY, NX), 1j), np.full((NY, NX), b"high")])
@pytest.mark.parametrize("kind", ["npy", "h5"])
def test_no_real_numbers(comm: MPI.Intracomm, shared_path: Path, kind: str, values: NDArray[Any]) -> None:
    path = made(comm, shared_path / f"map.{kind}", lambda path: write(path, values))
    assert "real numbers were expected" in complaint(comm, path)


def test_only_these_rows_are_held(comm: MPI.Intracomm, shared_path: Path) -> None:
    path = made(comm, shared_path / "map.npy", lambda path: write(path, random_map(NX, NY)))
    slab = Slab(comm, NX, NY)
    rows = surface.read_heights(path, "", slab)
    assert rows.shape == slab.shape
    assert rows.base is None  # not a view into the whole file


def test_types_that_are_no_numbers(comm: MPI.Intracomm, shared_path: Path) -> None:
    """Among them one that h5py does not know."""

    def make(path: Path) -> None:
        with h5py.File(path, "w") as file:
            space = h5py.h5s.create_simple((NY, NX))
            h5py.h5d.create(file.id, b"time", h5py.h5t.UNIX_D32LE, space)
            file["flags"] = np.zeros((NY, NX), bool)
            file["waves"] = np.zeros((NY, NX), complex)
            file["pairs"] = np.zeros((NY, NX), [("a", float), ("b", int)])
            file.create_dataset("texts", (NY, NX), h5py.string_dtype())
            file.create_dataset("links", (NY, NX), h5py.ref_dtype)

    path = made(comm, shared_path / "map.h5", make)
    assert "cannot be read: " in complaint(comm, path, "time")
    for name in ("flags", "waves", "pairs", "texts", "links"):
        assert "real numbers were expected" in complaint(comm, path, name)


@pytest.mark.parametrize("value", [1e300, -1e100, 5e-324])
def test_heights_beyond_computing(comm: MPI.Intracomm, shared_path: Path, value: float) -> None:
    path = made(comm, shared_path / "map.npy", lambda path: write(path, np.full((NY, NX), value)))
    assert f"its largest value is {abs(value):.3g} m; 1e-70 to 1e+70 m were expected" in complaint(comm, path)


def test_heights_times_their_scale(comm: MPI.Intracomm, shared_path: Path) -> None:
    """Either may be a number to compute with, and their product not."""
    path = made(comm, shared_path / "map.npy", lambda path: write(path, np.full((NY, NX), 1e-60)))
    with pytest.raises(InputError, match=r"its largest value is 1e-120 m; 1e-70 to 1e\+70 m were expected"):
        surface.read_heights(path, "heights", Slab(comm, NX, NY), 1e-60)
    assert surface.read_heights(path, "heights", Slab(comm, NX, NY), 1e54).max(initial=1e-6) == pytest.approx(1e-6)
