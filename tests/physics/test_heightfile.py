"""Heights from files: each rank its rows, and every mistake in one sentence on every rank."""

import os
from collections.abc import Callable
from contextlib import suppress
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
from parcontact.physics import heightfile

from .maps import random_map

pytestmark = pytest.mark.mpi

NX, NY = 7, 5
KINDS = ["npy", "h5", "txt"]


def write(path: Path, values: NDArray[Any]) -> None:
    if path.suffix == ".npy":
        np.save(path, values)
    elif path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            file["heights"] = values
            file.create_group("other")
    else:
        np.savetxt(path, values, fmt="%.17g", header="made by a test")


def made(comm: MPI.Intracomm, path: Path, make: Callable[[Path], object]) -> Path:
    """A file that root has made, seen by all."""
    if comm.rank == 0:
        make(path)
    comm.Barrier()
    return path


def complaint(comm: MPI.Intracomm, path: Path, dataset: str = "heights") -> str:
    """What reading says, the same on every rank, in one line that names the file."""
    with pytest.raises(InputError) as caught:
        heightfile.read(path, dataset, Slab(comm, NX, NY))
    said = str(caught.value)
    assert comm.allgather(said) == [said] * comm.size
    assert str(path) in said
    assert "\n" not in said
    return said


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
        rows = heightfile.read(path, "heights", slab)
        assert rows.dtype == np.float64
        assert_array_equal(rows, whole[slab.rows])


@pytest.mark.parametrize("dtype", [np.float32, np.int16, np.uint8, ">f8"])
@pytest.mark.parametrize("kind", ["npy", "h5"])
def test_other_numbers(comm: MPI.Intracomm, shared_path: Path, kind: str, dtype: str) -> None:
    whole = np.arange(NX * NY).reshape(NY, NX).astype(dtype)
    path = made(comm, shared_path / f"map.{kind}", lambda path: write(path, whole))
    slab = Slab(comm, NX, NY)
    assert_array_equal(heightfile.read(path, "heights", slab), whole[slab.rows].astype(float))


def test_columns_first(comm: MPI.Intracomm, shared_path: Path) -> None:
    whole = random_map(NX, NY)
    path = made(comm, shared_path / "map.npy", lambda path: np.save(path, np.asfortranarray(whole)))
    slab = Slab(comm, NX, NY)
    assert_array_equal(heightfile.read(path, "", slab), whole[slab.rows])


def test_dataset_in_a_group(comm: MPI.Intracomm, shared_path: Path) -> None:
    whole = random_map(NX, NY)

    def make(path: Path) -> None:
        with h5py.File(path, "w") as file:
            file["measured/left"] = whole

    path = made(comm, shared_path / "map.h5", make)
    slab = Slab(comm, NX, NY)
    assert_array_equal(heightfile.read(path, "measured/left", slab), whole[slab.rows])


def test_comments_and_empty_lines(comm: MPI.Intracomm, shared_path: Path) -> None:
    text = "# road\n\n" + "1 2 3 4 5 6 7 # first\n   \n" * NY + "#end"
    path = made(comm, shared_path / "map.txt", lambda path: path.write_text(text))
    slab = Slab(comm, NX, NY)
    assert_array_equal(heightfile.read(path, "", slab), np.tile(np.arange(1.0, 8.0), (slab.shape[0], 1)))


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
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_not_finite(comm: MPI.Intracomm, shared_path: Path, kind: str, value: float) -> None:
    """Wherever it stands: in the rows of one rank only."""
    whole = random_map(NX, NY)
    whole[-1, 2:4] = value
    path = made(comm, shared_path / f"map.{kind}", lambda path: write(path, whole))
    assert f"2 of its {NX * NY} heights are not finite numbers" in complaint(comm, path)


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
        (b"1,2,3,4,5,6,7\n" * NY, ":1 has 1 numbers"),
        (b"1 2 3 4 5 6 7\n" * (NY - 1) + b"1 2 3 4 5 6 high\n", "cannot be read: could not convert string to float"),
        (b"1 2 3 4 5 6 7\n" * (NY - 1) + b"1 2 3 4 5 6\n", f":{NY} has 6 numbers"),
        (b"\xff\xfe\x00 2 3 4 5 6 7\n" * NY, "cannot be read: "),
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
    assert "which are no heights" in complaint(comm, path)


def test_only_these_rows_are_held(comm: MPI.Intracomm, shared_path: Path) -> None:
    path = made(comm, shared_path / "map.npy", lambda path: write(path, random_map(NX, NY)))
    slab = Slab(comm, NX, NY)
    rows = heightfile.read(path, "", slab)
    assert rows.shape == slab.shape
    assert rows.base is None  # not a view into the whole file


# -- files that are made to break a reader -----------------------------------------------------------------------------


def test_links_that_leave_the_file(comm: MPI.Intracomm, shared_path: Path) -> None:
    """To a pipe, say, where reading would hang; also on the way to the data set, and by way of a soft link."""

    def make(path: Path) -> None:
        os.mkfifo(shared_path / "pipe")
        with h5py.File(path, "w") as file:
            file["out"] = h5py.ExternalLink(str(shared_path / "pipe"), "/heights")
            file["group/out"] = h5py.ExternalLink(str(shared_path / "pipe"), "/")
            file["soft"] = h5py.SoftLink("/group/out/heights")

    path = made(comm, shared_path / "map.h5", make)
    for name in ("out", "group/out/heights", "soft"):
        said = complaint(comm, path, name)
        assert f"{name!r} is a link into another file, '{shared_path / 'pipe'}'" in said


def test_data_in_other_files(comm: MPI.Intracomm, shared_path: Path) -> None:
    def make(path: Path) -> None:
        layout = h5py.VirtualLayout((NY, NX), "f8")
        layout[...] = h5py.VirtualSource(str(shared_path / "other.h5"), "heights", (NY, NX))
        with h5py.File(path, "w") as file:
            file.create_dataset("raw", (NY, NX), "f8", external=[(str(shared_path / "raw.bin"), 0, h5py.h5f.UNLIMITED)])
            file.create_virtual_dataset("virtual", layout)

    path = made(comm, shared_path / "map.h5", make)
    for name in ("raw", "virtual"):
        assert f"the heights of {name!r} lie in other files" in complaint(comm, path, name)


def test_links_within_the_file(comm: MPI.Intracomm, shared_path: Path) -> None:
    """Those that lead somewhere are followed; circles and dead ends are told."""
    whole = random_map(NX, NY)

    def make(path: Path) -> None:
        with h5py.File(path, "w") as file:
            file["deep/map"] = whole
            file["soft"] = h5py.SoftLink("/deep/map")
            file["deep/near"] = h5py.SoftLink("map")
            file["one"], file["two"] = h5py.SoftLink("/two"), h5py.SoftLink("/one")
            file["dead"] = h5py.SoftLink("/nowhere")

    path = made(comm, shared_path / "map.h5", make)
    slab = Slab(comm, NX, NY)
    for name in ("soft", "deep/near", "/deep/map"):
        assert_array_equal(heightfile.read(path, name, slab), whole[slab.rows])
    assert "'one' is a link that leads to itself" in complaint(comm, path, "one")
    assert "has no dataset 'dead'" in complaint(comm, path, "dead")


def test_types_that_are_no_numbers(comm: MPI.Intracomm, shared_path: Path) -> None:
    """Among them one that h5py does not know."""

    def make(path: Path) -> None:
        with h5py.File(path, "w") as file:
            space = h5py.h5s.create_simple((NY, NX))
            h5py.h5d.create(file.id, b"time", h5py.h5t.UNIX_D32LE, space)
            file["pairs"] = np.zeros((NY, NX), [("a", float), ("b", int)])
            file.create_dataset("texts", (NY, NX), h5py.string_dtype())
            file.create_dataset("links", (NY, NX), h5py.ref_dtype)

    path = made(comm, shared_path / "map.h5", make)
    assert "cannot be read: " in complaint(comm, path, "time")
    for name in ("pairs", "texts", "links"):
        assert "which are no heights" in complaint(comm, path, name)


@pytest.mark.parametrize("seed", range(40))
def test_damaged_files(comm: MPI.Intracomm, shared_path: Path, seed: int) -> None:
    """Bytes that were changed by chance: heights, or one sentence."""
    random = np.random.default_rng(seed)

    def make(path: Path) -> None:
        with h5py.File(path, "w") as file:
            file["heights"], file["deep/map"] = random_map(NX, NY), random_map(NX, NY)
            file["soft"] = h5py.SoftLink("/deep/map")
        content = bytearray(path.read_bytes())
        for place in random.integers(0, len(content), 20):
            content[place] = random.integers(256)
        path.write_bytes(content)

    path = made(comm, shared_path / "map.h5", make)
    for name in ("heights", "soft"):
        with suppress(InputError):
            assert heightfile.read(path, name, Slab(comm, NX, NY)).shape[1] == NX


def test_a_sparse_file_is_not_read_as_one_line(comm: MPI.Intracomm, shared_path: Path) -> None:
    """10 GB of zeros; and a header that claims to be 4 GB."""

    def text(path: Path) -> None:
        with path.open("wb") as file:
            file.truncate(10_000_000_000)

    def header(path: Path) -> None:
        with path.open("wb") as file:
            file.write(b"\x93NUMPY\x02\x00\xff\xff\xff\xff")
            file.truncate(10_000_000_000)

    assert ":1 is longer than " in complaint(comm, made(comm, shared_path / "map.txt", text))
    assert "its header claims to be larger than 1 MB" in complaint(comm, made(comm, shared_path / "map.npy", header))
    many = made(comm, shared_path / "many.txt", lambda path: path.write_text("1 2 3 4 5 6 7\n" * 9 * NY))
    assert f"has more than {4 * NY} rows" in complaint(comm, many)


@pytest.mark.parametrize("value", [1e300, -1e100, 5e-324])
def test_heights_beyond_computing(comm: MPI.Intracomm, shared_path: Path, value: float) -> None:
    path = made(comm, shared_path / "map.npy", lambda path: write(path, np.full((NY, NX), value)))
    assert f"its largest height is {abs(value):.3g}, which cannot be computed with" in complaint(comm, path)
