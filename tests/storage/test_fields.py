"""fields.h5: laid out once, readable at any instant, continued under other settings."""

from pathlib import Path
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
from mpi4py import MPI

from parcontact.errors import InputError, RunError
from parcontact.files import fields, hdf5
from parcontact.files.fields import FieldsFile
from parcontact.files.hdf5 import Link, Provenance, Slice, extend_chain, read_chain
from parcontact.parallel.slab import Array, Slab
from parcontact.results import info

pytestmark = pytest.mark.mpi


NX, NY = 6, 5
SIZE = (3.0, 2.0)
FIRST = Provenance((Link("title: first\n", 1),), (4,))
SECOND = Provenance(extend_chain(FIRST.chain, Link("title: second\n", 2, from_step=4)))


def field(slab: Slab, step: int, name: str) -> Array:
    """This rank's rows of a map that tells its step, name and place."""
    y, x = np.mgrid[slab.rows.start : slab.rows.stop, :NX]
    return step + 0.01 * y + 0.001 * x + len(name)


def saved(path: Path, slab: Slab, names: tuple[str, ...], steps: list[int], until: int) -> FieldsFile:
    """A file with the instants up to step `until`."""
    file = FieldsFile(path, slab, SIZE, names, steps)
    file.make(FIRST)
    for step in steps:
        if step <= until:
            file.save(step, 0.1 * step, {name: field(slab, step, name) for name in names})
    file.sync(FIRST)
    slab.comm.Barrier()
    return file


def check(path: Path, slab: Slab, steps: list[int], reached: int, names: dict[str, list[int]]) -> None:
    """Planned steps, how many of them were reached, and for each map the steps at which it holds numbers."""
    slab.comm.Barrier()
    whole = Slab.alone(NX, NY)
    with h5py.File(path) as file:
        assert file["step"][...].tolist() == steps
        assert np.flatnonzero(~np.isnan(file["t"][...])).tolist() == list(range(reached))
        assert np.allclose(file["t"][:reached], 0.1 * np.array(steps[:reached]), rtol=1e-15)
        assert {name for name in fields.UNITS if name in file} == set(names)
        for name, there in names.items():
            for index, step in enumerate(steps[:reached]):
                expected = field(whole, step, name) if step in there else np.full((NY, NX), np.nan)
                assert np.array_equal(file[name][index], expected, equal_nan=True)
    times = ElementTree.parse(path.with_suffix(".xdmf")).iter("Time")
    assert len(list(times)) == reached
    slab.comm.Barrier()


def test_layout(comm: MPI.Intracomm, shared_path: Path) -> None:
    """Coordinates of the grid's points, scales and units, as xarray and others expect them."""
    path, slab = shared_path / "fields.h5", Slab(comm, NX, NY)
    saved(path, slab, ("pressure", "gap"), [2, 4, 6], 4)
    check(path, slab, [2, 4, 6], 2, {"pressure": [2, 4], "gap": [2, 4]})
    with h5py.File(path) as file:
        assert np.allclose(file["x"], np.arange(NX) * 0.5)
        assert np.allclose(file["y"], np.arange(NY) * 0.4)
        assert [dimension[0].name for dimension in file["pressure"].dims] == ["/t", "/y", "/x"]
        assert file["pressure"].attrs["units"] == "Pa"
        assert file.attrs["job"] == "title: first\n"
        assert file.attrs["seeds"].tolist() == [4]
    text, sound = info.describe_path(path)
    assert sound
    assert "2 of 3 instants saved, t = 0.2 s (step 2) to 0.4 s (step 4)" in text


def test_goes_on_where_it_was(comm: MPI.Intracomm, shared_path: Path) -> None:
    """What lies after the step is forgotten, in place, and the chain of runs is longer."""
    path, slab = shared_path / "fields.h5", Slab(comm, NX, NY)
    saved(path, slab, ("pressure",), [2, 4, 6, 8], 6)
    inode = path.stat().st_ino
    file = FieldsFile(path, slab, SIZE, ("pressure",), [2, 4, 6, 8])
    assert file.resume(4, SECOND) == ""
    assert path.stat().st_ino == inode
    check(path, slab, [2, 4, 6, 8], 2, {"pressure": [2, 4]})
    with h5py.File(path) as h5:
        assert [link.job for link in read_chain(h5)] == ["title: first\n", "title: second\n"]
    slab.comm.Barrier()
    file.save(6, 0.6, {"pressure": field(slab, 6, "pressure")})
    file.sync(SECOND)
    check(path, slab, [2, 4, 6, 8], 3, {"pressure": [2, 4, 6]})


def test_goes_on_with_other_instants_and_maps(comm: MPI.Intracomm, shared_path: Path) -> None:
    """What was saved stays, also what is no longer asked for at those steps; a map not saved then is NaN there."""
    path, slab = shared_path / "fields.h5", Slab(comm, NX, NY)
    saved(path, slab, ("pressure", "displacement"), [2, 4, 6], 6)
    file = FieldsFile(path, slab, SIZE, ("pressure", "gap"), [3, 6, 9, 10])
    assert file.resume(5, SECOND) == ""
    check(path, slab, [2, 4, 6, 9, 10], 2, {"pressure": [2, 4], "gap": []})
    file.save(6, 0.6, {name: field(slab, 6, name) for name in ("pressure", "gap")})
    file.sync(SECOND)
    check(path, slab, [2, 4, 6, 9, 10], 3, {"pressure": [2, 4, 6], "gap": [6]})


def test_no_instant_is_known_yet(comm: MPI.Intracomm, shared_path: Path) -> None:
    """A run that chooses its steps may expect fewer than fields are due after; instants are added as it goes on."""
    path, slab = shared_path / "fields.h5", Slab(comm, NX, NY)
    file = saved(path, slab, ("pressure",), [], 0)
    check(path, slab, [], 0, {"pressure": []})
    file.make_place([7])
    file.save(7, 0.7, {"pressure": field(slab, 7, "pressure")})
    file.sync(FIRST)
    check(path, slab, [7], 1, {"pressure": [7]})


def test_lost_or_damaged(comm: MPI.Intracomm, shared_path: Path) -> None:
    """A file that cannot be read is kept under another name; the maps of the step to go on from can still be saved."""
    path, slab = shared_path / "fields.h5", Slab(comm, NX, NY)
    file = FieldsFile(path, slab, SIZE, ("pressure",), [2, 4, 6])
    assert "is missing" in file.resume(4, SECOND)
    assert file.is_due(4)
    check(path, slab, [4, 6], 0, {"pressure": []})
    for kept in ("fields.h5.aside", "fields.h5.aside-2"):
        if slab.root:
            path.write_bytes(kept.encode())
        slab.comm.Barrier()
        file = FieldsFile(path, slab, SIZE, ("pressure",), [2, 4, 6])
        assert f"it is kept as {path.with_name(kept)}" in file.resume(4, SECOND)
        check(path, slab, [4, 6], 0, {"pressure": []})
        assert path.with_name(kept).read_bytes() == kept.encode()


def test_cut_back_without_going_on(comm: MPI.Intracomm, shared_path: Path) -> None:
    path, slab = shared_path / "fields.h5", Slab(comm, NX, NY)
    fields.cut_back(path, slab, 4)
    saved(path, slab, ("pressure",), [2, 4, 6], 6)
    fields.cut_back(path, slab, 4)
    slab.comm.Barrier()
    with h5py.File(path) as file:
        assert np.isnan(file["t"][...]).tolist() == [False, False, True]


def instants(path: Path, file: h5py.File) -> list[tuple[float, tuple[Array, Array, Array], Array]]:
    """What a reader takes from the XDMF text: per instant its time, x, y, z of the points, and the pressures.

    By the standard, meshes of equal spacing have their dimensions as z, y, x, and data lie with x fastest. Numbers are
    of 4 bytes unless they are declared to be longer.
    """
    found = []
    for grid in [grid for grid in ElementTree.parse(path).iter("Grid") if grid.find("Time") is not None]:
        time, topology, geometry = (grid.find(name) for name in ("Time", "Topology", "Geometry"))
        assert time is not None
        assert topology is not None
        assert geometry is not None
        assert topology.get("TopologyType") == "3DCoRectMesh"
        assert geometry.get("GeometryType") == "ORIGIN_DXDYDZ"
        shape = [int(word) for word in topology.get("Dimensions", "").split()]
        assert all(item.get("Precision") == "8" for item in geometry)
        origin, spacing = ([float(word) for word in (item.text or "").split()] for item in geometry)
        assert spacing[0] == spacing[2]  # readers differ in which of the two is that of x
        z, y, x = (start + step * np.arange(n) for start, step, n in zip(origin, spacing, shape, strict=True))
        slab = grid.find("Attribute[@Name='pressure']/DataItem")
        assert slab is not None
        places, data = slab
        start, _, count = np.array([int(word) for word in (places.text or "").split()]).reshape(3, 3)
        part = tuple(slice(a, a + n) for a, n in zip(start, count, strict=True))
        values = file[(data.text or "").rpartition(":/")[2]][part]
        assert [int(word) for word in slab.get("Dimensions", "").split()] == shape
        found.append((float(time.get("Value", "nan")), (x, y, z), values.reshape(shape)))
    return found


def test_xdmf_puts_maps_into_the_x_y_plane(comm: MPI.Intracomm, shared_path: Path) -> None:
    """Every value at its point (x, y, 0), to the last digit (8-byte numbers), at its time."""
    path, slab = shared_path / "fields.h5", Slab(comm, NX, NY)
    saved(path, slab, ("gap", "pressure"), [2, 4, 6], 4)
    whole = Slab.alone(NX, NY)
    with h5py.File(path) as file:
        found = instants(path.with_suffix(".xdmf"), file)
        assert [time for time, *_ in found] == [0.2, 0.4]
        for step, (_, (x, y, z), values) in zip((2, 4), found, strict=True):
            assert np.array_equal(x, file["x"])
            assert np.array_equal(y, file["y"])
            assert z.tolist() == [0.0]
            assert np.array_equal(values[0], field(whole, step, "pressure"))


def test_xdmf_tells_loads_without_duration_apart() -> None:
    """Maps of one time are one instant to a reader: single solves are distinguished by their steps."""
    text = fields.xdmf("fields.h5", np.array([0.0, 0.0, np.nan]), np.array([1, 2, 3]), (NY, NX), SIZE, ("gap",))
    times = [time.get("Value") for time in ElementTree.fromstring(text).iter("Time")]
    assert times == ["1.0", "2.0"]


def test_chain_of_long_jobs(comm: MPI.Intracomm, shared_path: Path) -> None:
    """The job of the file is there once; of others that are too long only the facts are kept."""
    path, slab = shared_path / "fields.h5", Slab(comm, NX, NY)
    long, longer = Link("a" * 200_000, 1), Link("b" * 300_000, 1, from_step=5)
    file = FieldsFile(path, slab, SIZE, ("pressure",), [2, 4])
    file.make(Provenance((long,)))
    comm.Barrier()
    with h5py.File(path) as h5:
        assert read_chain(h5) == (long,)
    comm.Barrier()
    file.resume(0, Provenance(extend_chain((long,), longer)))
    comm.Barrier()
    with h5py.File(path) as h5:
        assert [(link.job[:5], link.from_step) for link in read_chain(h5)] == [("aaaaa", 0), ("(too ", 5)]


def test_chain_counts_runs_that_are_alike() -> None:
    link = Link("title: a\n", 2)
    assert extend_chain((link,), Link("title: a\n", 2, from_step=9))[0].runs == 2
    assert len(extend_chain((link,), Link("title: a\n", 3, from_step=9))) == 2
    assert len(extend_chain((link,), Link("title: b\n", 2, from_step=9))) == 2


# -- files that all ranks write together: the same bytes whichever way, and one error for all -------------------------


def field_hdf5(slab: Slab, seed: int = 0) -> Array:
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
        a, b = field_hdf5(slab, 1), field_hdf5(slab, 2)
        monkeypatch.setattr(hdf5, "MPI_IO", writes)
        hdf5.write_rows(path, slab, [Slice("a", (), a), Slice("group/b", (), b), Slice("stack", (2,), a)])
        monkeypatch.setattr(hdf5, "MPI_IO", reads)
        for reader in communicators:
            if reader.size > writer.size:
                continue  # ranks that have not come to this file yet
            other = Slab(reader, 5, ny)
            found = [np.full(other.shape, np.nan) for _ in range(3)]
            names: tuple[tuple[str, tuple[int, ...]], ...] = (("a", ()), ("group/b", ()), ("stack", (2,)))
            hdf5.read_rows(path, other, [Slice(*n, rows) for n, rows in zip(names, found, strict=True)])
            for rows, seed in zip(found, (1, 2, 1), strict=True):
                assert np.array_equal(rows, field_hdf5(other, seed))


def test_same_bytes(comm: MPI.Intracomm, shared_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    slab = Slab(comm, 6, 9)
    for name, together in (("together.h5", True), ("in turn.h5", False)):
        monkeypatch.setattr(hdf5, "MPI_IO", together)
        make(shared_path / name, slab)
        hdf5.write_rows(
            shared_path / name, slab, [Slice("a", (), field_hdf5(slab)), Slice("stack", (1,), field_hdf5(slab))]
        )
    comm.Barrier()
    assert (shared_path / "together.h5").read_bytes() == (shared_path / "in turn.h5").read_bytes()


def test_writing_leaves_all_else_alone(comm: MPI.Intracomm, shared_path: Path) -> None:
    """Structure, attributes and other maps keep their bytes: the file is readable while it is written."""
    slab, path = Slab(comm, 6, 9), shared_path / "file.h5"
    make(path, slab)
    comm.Barrier()
    before = path.read_bytes()
    comm.Barrier()
    hdf5.write_rows(path, slab, [Slice("a", (), field_hdf5(slab))])
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
        hdf5.write_rows(shared_path / "absent.h5", slab, [Slice("a", (), field_hdf5(slab))])
    make(path, slab)
    with pytest.raises(RunError, match=r"cannot write .*file\.h5"):
        hdf5.write_rows(path, slab, [Slice("a", (), field_hdf5(slab)), Slice("absent", (), field_hdf5(slab))])
    with pytest.raises(RunError, match=r"cannot create .*: No such file"):
        make(shared_path / "absent" / "file.h5", slab)


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
    with pytest.raises(InputError, match="gap is a link to another file"):
        hdf5.open_results(tmp_path / "fields.h5")
