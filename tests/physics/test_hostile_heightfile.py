"""Files of heights that are made to break a reader: each ends in one sentence."""

import os
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_array_equal

from parcontact.errors import InputError
from parcontact.parallel.slab import Slab
from parcontact.physics import heightfile

from .heightfiles import NX, NY, complaint, made, write
from .maps import random_map

pytestmark = pytest.mark.mpi


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
            file["flags"] = np.zeros((NY, NX), bool)
            file["waves"] = np.zeros((NY, NX), complex)
            file["pairs"] = np.zeros((NY, NX), [("a", float), ("b", int)])
            file.create_dataset("texts", (NY, NX), h5py.string_dtype())
            file.create_dataset("links", (NY, NX), h5py.ref_dtype)

    path = made(comm, shared_path / "map.h5", make)
    assert "cannot be read: " in complaint(comm, path, "time")
    for name in ("flags", "waves", "pairs", "texts", "links"):
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
    assert f"its largest height is {abs(value):.3g} m, which cannot be computed with" in complaint(comm, path)


def test_heights_times_their_scale(comm: MPI.Intracomm, shared_path: Path) -> None:
    """Either may be a number to compute with, and their product not."""
    path = made(comm, shared_path / "map.npy", lambda path: write(path, np.full((NY, NX), 1e-60)))
    with pytest.raises(InputError, match=r"its largest height is 1e-120 m, which cannot be computed with"):
        heightfile.read(path, "heights", Slab(comm, NX, NY), 1e-60)
    assert heightfile.read(path, "heights", Slab(comm, NX, NY), 1e54).max(initial=1e-6) == pytest.approx(1e-6)
