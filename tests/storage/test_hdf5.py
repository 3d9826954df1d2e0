"""Files that all ranks write together: the same bytes whichever way, and one error for all."""

from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np
import pytest
from mpi4py import MPI

from parcontact.errors import InputError, RunError
from parcontact.parallel.slab import Array, Slab
from parcontact.storage import checkpoint, hdf5
from parcontact.storage.hdf5 import Slice

pytestmark = pytest.mark.mpi


def field(slab: Slab, seed: int = 0) -> Array:
    """This rank's rows of a map that does not depend on the number of ranks."""
    return np.random.default_rng(seed).standard_normal((slab.ny, slab.nx))[slab.rows]


def make(path: Path, slab: Slab, names: tuple[str, ...] = ("a", "group/b")) -> None:
    def build(file: h5py.File) -> None:
        for name in names:
            hdf5.fixed(file, name, (slab.ny, slab.nx), np.float64)
        hdf5.fixed(file, "stack", (3, slab.ny, slab.nx), np.float64)
        hdf5.fixed(file, "t", (3,), np.float64)
        file.attrs["text"] = np.bytes_("x")

    hdf5.lay_out(path, slab, build, (len(names) + 3) * slab.ny * slab.nx * hdf5.DOUBLE)


@pytest.mark.parametrize("ny", [1, 2, 7, 16])  # with 3 and 4 ranks, some have no rows
@pytest.mark.parametrize(("writes", "reads"), [(True, True), (True, False), (False, True)])
def test_both_ways_are_interchangeable(
    communicators: list[MPI.Intracomm],
    shared_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    ny: int,
    writes: bool,
    reads: bool,
) -> None:
    """Together by MPI-IO or in turn, on any number of ranks: what one writes, all others read."""
    for writer in communicators:
        slab = Slab(writer, 5, ny)
        path = shared_path / f"{writer.size}.h5"
        make(path, slab)
        a, b = field(slab, 1), field(slab, 2)
        monkeypatch.setattr(hdf5, "MPI_IO", writes)
        hdf5.write(path, slab, [Slice("a", (), a), Slice("group/b", (), b), Slice("stack", (2,), a)])
        monkeypatch.setattr(hdf5, "MPI_IO", reads)
        for reader in communicators:
            if reader.size > writer.size:
                continue  # ranks that have not come to this file yet
            other = Slab(reader, 5, ny)
            found = [np.full(other.shape, np.nan) for _ in range(3)]
            names: tuple[tuple[str, tuple[int, ...]], ...] = (("a", ()), ("group/b", ()), ("stack", (2,)))
            hdf5.read(path, other, [Slice(*n, rows) for n, rows in zip(names, found, strict=True)])
            for rows, seed in zip(found, (1, 2, 1), strict=True):
                assert np.array_equal(rows, field(other, seed))


def test_same_bytes(comm: MPI.Intracomm, shared_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    slab = Slab(comm, 6, 9)
    for name, together in (("together.h5", True), ("in turn.h5", False)):
        monkeypatch.setattr(hdf5, "MPI_IO", together)
        make(shared_path / name, slab)
        hdf5.write(shared_path / name, slab, [Slice("a", (), field(slab)), Slice("stack", (1,), field(slab))])
    comm.Barrier()
    assert (shared_path / "together.h5").read_bytes() == (shared_path / "in turn.h5").read_bytes()


def test_writing_leaves_all_else_alone(comm: MPI.Intracomm, shared_path: Path) -> None:
    """Structure, attributes and other maps keep their bytes: the file is readable while it is written."""
    slab, path = Slab(comm, 6, 9), shared_path / "file.h5"
    make(path, slab)
    comm.Barrier()
    before = path.read_bytes()
    comm.Barrier()
    hdf5.write(path, slab, [Slice("a", (), field(slab))])
    comm.Barrier()
    after = path.read_bytes()
    with h5py.File(path) as file:
        start, length = file["a"].id.get_offset(), file["a"].nbytes
    assert len(before) == len(after)
    assert before[:start] == after[:start]
    assert before[start + length :] == after[start + length :]


@pytest.mark.parametrize("together", [False, True])
def test_one_error_for_all(
    comm: MPI.Intracomm, shared_path: Path, monkeypatch: pytest.MonkeyPatch, together: bool
) -> None:
    monkeypatch.setattr(hdf5, "MPI_IO", together)
    slab, path = Slab(comm, 6, 9), shared_path / "file.h5"
    with pytest.raises(RunError, match=r"cannot open .*absent\.h5: No such file"):
        hdf5.write(shared_path / "absent.h5", slab, [Slice("a", (), field(slab))])
    make(path, slab)
    with pytest.raises(RunError, match=r"cannot write .*file\.h5"):
        hdf5.write(path, slab, [Slice("a", (), field(slab)), Slice("absent", (), field(slab))])
    with pytest.raises(RunError, match=r"cannot make .*: No such file"):
        make(shared_path / "absent" / "file.h5", slab)


def test_error_of_one_rank(comm: MPI.Intracomm, shared_path: Path) -> None:
    """A rank whose rows do not fit fails, and all of them say why."""
    slab, path = Slab(comm, 6, 9), shared_path / "file.h5"
    make(path, slab)
    rows = field(slab)
    if comm.rank == comm.size - 1:
        rows = np.zeros((slab.shape[0] + 50, 6))
    with pytest.raises(RunError, match="cannot write"):
        hdf5.write(path, slab, [Slice("a", (), rows), Slice("group/b", (), field(slab))])


def test_change_keeps_maps(comm: MPI.Intracomm, shared_path: Path) -> None:
    slab, path = Slab(comm, 6, 9), shared_path / "file.h5"
    make(path, slab)
    hdf5.write(path, slab, [Slice("a", (), field(slab))])
    hdf5.change(path, slab, lambda file: file.attrs.modify("text", np.bytes_("y")))
    hdf5.on_root(slab, lambda: hdf5.put(path, {"t": np.array([1.0, 2.0, np.nan])}), "put")
    rows = np.empty(slab.shape)
    hdf5.read(path, slab, [Slice("a", (), rows)])
    assert np.array_equal(rows, field(slab))
    with h5py.File(path) as file:
        assert file.attrs["text"] == b"y"
        assert np.array_equal(file["t"][...], [1.0, 2.0, np.nan], equal_nan=True)


def test_regions_of_maps(comm: MPI.Intracomm, shared_path: Path) -> None:
    """They are in order, do not meet, and hold the bytes of all maps."""
    slab, path = Slab(comm, 6, 9), shared_path / "file.h5"
    make(path, slab)
    with h5py.File(path) as file:
        found = checkpoint.find_regions(file)
    assert all(stop < start for (_, stop), (start, _) in pairwise(found))
    assert sum(stop - start for start, stop in found) == (2 + 3) * 6 * 9 * 8


@pytest.mark.parametrize("kind", ["link", "virtual", "outside"])
def test_maps_of_another_file_are_refused(tmp_path: Path, kind: str) -> None:
    """Whoever made the file would choose which files of this machine get into a report that is sent away."""
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["gap"] = np.ones((2, 2))
    with h5py.File(tmp_path / "fields.h5", "w") as file:
        if kind == "link":
            file["gap"] = h5py.ExternalLink("other.h5", "gap")
        elif kind == "virtual":
            layout = h5py.VirtualLayout((2, 2), float)
            layout[...] = h5py.VirtualSource(tmp_path / "other.h5", "gap", (2, 2))
            file.create_virtual_dataset("gap", layout)
        else:
            place = [(str(tmp_path / "raw"), 0, 32)]
            file.create_dataset("gap", (2, 2), float, external=place)
    with pytest.raises(InputError, match="gap is stored in another file"):
        hdf5.open_results(tmp_path / "fields.h5")
