"""Checkpoints: whole or refused, the same from any number of ranks."""

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from mpi4py import MPI

from parcontact.errors import InputError, RunError
from parcontact.files import checkpoint, hdf5
from parcontact.files.checkpoint import Contents, Facts
from parcontact.files.hdf5 import Link, Provenance
from parcontact.parallel.slab import Slab
from parcontact.physics.records import Entry
from parcontact.results import info

NX, NY = 6, 9
NOON = "2026-01-01T12:00:00+00:00"  # one instant on all ranks
WHENCE = Provenance((Link("title: w\n", 5, started=NOON), Link("title: x\n", 2, started=NOON)), (3,))
FACTS = Facts({"grid": {"points": [NX, NY]}}, WHENCE, step=7, time=0.25)


def entries(slab: Slab) -> dict[str, Entry]:
    rng = np.random.default_rng(0)
    p, branch = rng.random((NY, NX)), rng.random((NY, NX)).astype(np.float32)
    return {
        "contact/pressure": Entry(p[slab.rows], 0.5, "1"),
        "material/branch 0": Entry(branch[slab.rows], 2.0, "Pa m"),
        "contact/modulus": Entry(1.5, 4.0, "Pa"),
        "energy/branches": Entry(np.array([1.0, np.nan, np.inf]), 1.0, "J"),
    }


def write(path: Path, comm: MPI.Intracomm) -> None:
    slab = Slab(comm, NX, NY)
    checkpoint.write_checkpoint(path, slab, FACTS, entries(slab))


def look(path: Path, comm: MPI.Intracomm) -> Contents | str:
    """What a sound checkpoint holds, or what is wrong with it."""
    try:
        contents = checkpoint.inspect(path)
    except InputError as error:
        return str(error)
    return checkpoint.verify(contents, Slab(comm, NX, NY)) or contents


@pytest.mark.mpi
def test_any_number_of_ranks_reads_it(communicators: list[MPI.Intracomm], shared_path: Path) -> None:
    for writer in communicators:
        path = shared_path / f"{writer.size}.h5"
        write(path, writer)
        for reader in communicators:
            if reader.size > writer.size:
                continue  # ranks that have not come to this file yet
            contents = look(path, reader)
            assert isinstance(contents, Contents)
            assert (contents.step, contents.time, contents.shape) == (7, 0.25, (NY, NX))
            assert contents.job == FACTS.job
            assert contents.chain == FACTS.provenance.chain
            assert contents.numbers.keys() == {"contact/modulus", "energy/branches"}  # no rank holds a whole map
            slab = Slab(reader, NX, NY)
            wanted = entries(slab)
            empty = {name: Entry(np.zeros_like(entry.value), entry.unit) for name, entry in wanted.items()}
            checkpoint.read_maps(contents, slab, empty)
            for name, entry in wanted.items():
                found = empty[name].value if entry.is_map else contents.numbers[name]
                assert np.array_equal(found, entry.value, equal_nan=True)
                assert contents.units[name] == entry.unit


@pytest.mark.mpi
def test_other_units(comm: MPI.Intracomm, shared_path: Path) -> None:
    """A run in other units (powers of two) reads the same values, exactly."""
    path = shared_path / "file.h5"
    write(path, comm)
    contents = look(path, comm)
    assert isinstance(contents, Contents)
    slab = Slab(comm, NX, NY)
    other = {"contact/pressure": Entry(slab.zeros(), 2.0)}
    checkpoint.read_maps(contents, slab, other)
    assert np.array_equal(other["contact/pressure"].value, 0.25 * np.asarray(entries(slab)["contact/pressure"].value))


def test_failed_write_leaves_the_old_one(comm: MPI.Intracomm, tmp_path: Path) -> None:
    path = tmp_path / "file.h5"
    write(path, comm)
    slab = Slab(comm, NX, NY)
    bad = entries(slab) | {"contact/pressure": Entry(np.zeros((NY + 1, NX)))}
    with pytest.raises(RunError, match=r"cannot write .*file\.h5\..*\.part"):
        checkpoint.write_checkpoint(path, slab, FACTS, bad)
    assert isinstance(look(path, comm), Contents)
    assert [file.name for file in tmp_path.iterdir()] == ["file.h5"]
    with pytest.raises(RunError, match=r"cannot create .*No such file or directory"):
        write(tmp_path / "absent" / "file.h5", comm)


def test_it_is_on_the_disk_before_it_has_its_name(
    comm: MPI.Intracomm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whole and sealed, under another name."""
    path, sync, found = tmp_path / "file.h5", hdf5.sync, list[tuple[int, bool]]()

    def look_and_sync(part: Path, slab: Slab) -> None:
        found.append((checkpoint.inspect(part).step, path.exists()))
        sync(part, slab)

    monkeypatch.setattr(hdf5, "sync", look_and_sync)
    write(path, comm)
    assert found == [(7, False)]


def test_maps_that_cannot_be_read(comm: MPI.Intracomm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As from a broken disk: said in a sentence, as of a damaged file."""

    def fail(*_: object) -> None:
        raise RunError("cannot read file.h5")

    write(tmp_path / "file.h5", comm)
    monkeypatch.setattr(hdf5, "read_rows", fail)
    assert look(tmp_path / "file.h5", comm) == "cannot read file.h5"


def test_every_bit_counts(comm: MPI.Intracomm, tmp_path: Path) -> None:
    """Each flipped bit, except in bytes that mean nothing, is found; HDF5 is never given what would make it crash."""
    path = tmp_path / "file.h5"
    write(path, comm)
    data, true = path.read_bytes(), checkpoint.inspect(path)
    rng = np.random.default_rng(1)
    with h5py.File(path) as file:
        maps = [file[name].id.get_offset() for name in ("contact/pressure", "material/branch 0")]
    places = [*range(150), *rng.integers(4096, len(data), 300), *(start + i for start in maps for i in range(NX * NY))]
    for place in places:
        changed = bytearray(data)
        changed[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(changed)
        found = look(path, comm)
        if place >= checkpoint.SEAL:
            assert isinstance(found, str)
            assert "damaged" in found
        elif isinstance(found, Contents):  # bytes to spare
            assert (found.step, found.time, found.chain, found.units) == (true.step, true.time, true.chain, true.units)


def _newer(data: bytes) -> bytes:
    return data.replace(b"format 2", b"format 3", 1)


def _older(data: bytes) -> bytes:
    return data.replace(b"format 2", b"format 1", 1)


def _unsealed(data: bytes) -> bytes:
    return bytes(4096) + data[4096:]


DAMAGE: list[tuple[Callable[[bytes], bytes], str]] = [
    (lambda data: data[: len(data) // 2], "is damaged: it has .* bytes instead of"),
    (lambda data: data[:60], "is damaged: its seal cannot be read"),
    (lambda data: data + b"more", "is damaged: it has .* bytes instead of"),
    (lambda data: b"", "is incomplete or damaged: it has no seal"),
    (_unsealed, "is incomplete or damaged: it has no seal"),
    (_newer, "has format 3 of a newer parcontact; format 2 was expected"),
    (_older, "has format 1 of an older parcontact; format 2 was expected"),
    (lambda data: data.replace(b'"bytes"', b'"butes"', 1), "is damaged: its seal cannot be read"),
]


@pytest.mark.parametrize(("act", "message"), DAMAGE)
def test_damage_in_a_sentence(comm: MPI.Intracomm, tmp_path: Path, act: Callable[[bytes], bytes], message: str) -> None:
    path = tmp_path / "file.h5"
    write(path, comm)
    path.write_bytes(act(path.read_bytes()))
    with pytest.raises(InputError, match=message) as raised:
        checkpoint.inspect(path)
    assert str(raised.value).startswith(str(path))
    assert "\n" not in str(raised.value)


def test_info(comm: MPI.Intracomm, tmp_path: Path) -> None:
    path = tmp_path / "file.h5"
    write(path, comm)
    text, sound = info.describe_path(path)
    assert sound
    for part in ("step 7", "t = 0.25 s", "6 x 9 points", "2 ranks", "contact/pressure", "modulus = 6.0", "sound"):
        assert part in text
    with h5py.File(path) as file:
        start = file["contact/pressure"].id.get_offset()
    data = bytearray(path.read_bytes())
    data[start + 8 * NX] ^= 1
    path.write_bytes(data)
    text, sound = info.describe_path(path)
    assert not sound
    assert "1 of 9 rows of contact/pressure do not match" in text
    with pytest.raises(InputError, match="does not exist"):
        info.describe_path(tmp_path / "absent.h5")
    (tmp_path / "other.h5").write_bytes(b"something else")
    with pytest.raises(InputError, match="it is not an HDF5 file"):
        info.describe_path(tmp_path / "other.h5")
    with h5py.File(tmp_path / "other.h5", "w"):
        pass
    with pytest.raises(InputError, match="neither a checkpoint nor a field file"):
        info.describe_path(tmp_path / "other.h5")
