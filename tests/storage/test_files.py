"""Files that are whole or not there, what is put aside, and tables that grow."""

import math
import os
import resource
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from parcontact.columns import MEASURES, choose_columns
from parcontact.errors import InputError, InUseError
from parcontact.files import files, outputs, tables, wisdom
from parcontact.files.checkpoint import TableMark
from parcontact.files.hdf5 import Link, Provenance
from parcontact.files.outputs import Claim, Directory
from parcontact.files.recorder import MeasuresFile, Recorder, Recording, StepRow, cut_back_table
from parcontact.files.tables import GrowingTable, lacking_points, of_table, read_results, requested_points
from parcontact.job import load
from parcontact.march.choices import choices
from parcontact.parallel.slab import Slab
from parcontact.physics.records import Measures


def test_names_of_unfinished_files_cannot_be_guessed(tmp_path: Path) -> None:
    """Two in a row differ, and what is there already is never opened."""
    path = tmp_path / "table"
    assert files.unused(path) != files.unused(path)
    with files.replaced(path) as file:
        file.write(b"new")
        part = next(tmp_path.iterdir())
        with pytest.raises(FileExistsError):
            part.open("xb")
    assert [found.name for found in tmp_path.iterdir()] == ["table"]
    with pytest.raises(ZeroDivisionError), files.replaced(path) as file:
        file.write(b"half" * (1 // 0))
    assert (path.read_bytes(), len(list(tmp_path.iterdir()))) == (b"new", 1)


def test_links_and_directories_too(tmp_path: Path) -> None:
    """What a link leads to is not asked: the link itself is a user's. An error leaves all as it was."""
    marked = tmp_path / "marked"
    marked.write_text(files.MARK)
    link, directory = tmp_path / "link", tmp_path / "directory"
    link.symlink_to(marked)
    directory.mkdir()
    for path in (link, directory):
        with pytest.raises(ZeroDivisionError), files.replaced(path, files.is_marked):
            raise ZeroDivisionError
        assert not list(tmp_path.glob("*.aside"))
        with files.replaced(path, files.is_marked) as file:
            file.write(b"new")
        assert path.read_text() == "new"
        path.with_name(f"{path.name}.aside").rename(tmp_path / f"kept {path.name}")
    assert (tmp_path / "kept link").readlink() == marked
    assert (tmp_path / "kept directory").is_dir()


def test_a_line_without_room_leaves_the_table_as_it_was(tmp_path: Path) -> None:
    """Under a limit of the size of files, as on a full disk."""
    path, limits = tmp_path / "table.csv", resource.getrlimit(resource.RLIMIT_FSIZE)
    table = GrowingTable(path, ["step", "time"])
    table.append(["0", "0.0"])
    before = path.read_bytes()
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 3, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            table.append(["1", "0.125"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert path.read_bytes() == before
    table.append(["1", "0.125"])
    table.sync()
    table.close()
    again = GrowingTable(path, ["step", "time"])
    again.append(["2", "0.25"])
    again.close()
    assert path.read_text() == "step,time\n0,0.0\n1,0.125\n2,0.25\n"


# -- output directories: one run at a time, known by its marker -------------------------------------------------------

PLAIN: dict[str, Any] = {"grid": {"points": [8, 8]}, "surface": [{"shape": "flat"}], "material": {"model": "elastic"}}


def directory_at(path: Path, verb: str = "run") -> Directory:
    return Directory(path, Slab.alone(8, 8), verb)


def make(here: Directory, job: Path, data: dict[str, Any] = PLAIN) -> None:
    with here.claimed():
        here.refuse_foreign(job, data, False)
        here.make(job, "resolved", Claim(data))


@pytest.fixture
def job(tmp_path: Path) -> Path:
    path = tmp_path / "job.yaml"
    path.write_text("given")
    return path


def test_second_run_is_refused(tmp_path: Path, job: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It writes nothing, and may have the directory as soon as the first has ended."""
    monkeypatch.setattr(outputs, "MAX_SECONDS_TO_RELEASE", 0.1)
    first, second = directory_at(tmp_path / "out"), directory_at(tmp_path / "out")
    with first.claimed():
        with pytest.raises(InUseError, match=rf"in use by another run \(process {os.getpid()} on "), second.claimed():
            raise AssertionError
        first.make(job, "resolved", Claim(PLAIN))
    make(second, job)
    assert second.claim is not None
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        outputs.MARKER,
        "checkpoint",
        "job.resolved.yaml",
        "job.yaml",
    ]


def test_nothing_is_left_of_a_job_that_was_refused(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), directory_at(tmp_path / "deep" / "out").claimed():
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []


def test_other_files_and_other_jobs_are_refused(tmp_path: Path, job: Path) -> None:
    """Those of others, and other scenes under another verb; the lock, `stop` and theory may be there before."""
    out = tmp_path / "out"
    out.mkdir()
    for name in ("theory.csv", ".hidden", "notes.txt"):
        (out / name).write_text("mine")
    with pytest.raises(InputError, match=r"not empty and was not made by this program: it has notes\.txt; give --out"):
        make(directory_at(out), job)
    (out / "notes.txt").unlink()
    make(directory_at(out), job)
    make(directory_at(out, "steady"), job)
    keep = r"grid.points was \[8, 8\], is \[9, 9\]; give --set grid.points=\[8,8\] to keep its mesh, or give --out"
    with pytest.raises(InputError, match=keep):
        make(directory_at(out, "study"), job, {**PLAIN, "grid": {"points": [9, 9]}})
    (out / outputs.MARKER).write_text("{")
    with pytest.raises(InputError, match="is damaged, so the owner of"):
        make(directory_at(out), job)


def test_the_directory_of_a_sweep_is_stated(tmp_path: Path, job: Path) -> None:
    """A sweep has no marker of its own, its cases have."""
    for case in ("000", "001"):
        make(directory_at(tmp_path / "out" / "cases" / case), job)
    with pytest.raises(
        InputError, match=r"out belongs to a sweep and has 2 of its cases; give --out for .* with --case"
    ):
        make(directory_at(tmp_path / "out"), job)


def test_differences_of_jobs() -> None:
    """Keys of sections and of lists of parts, with both values; lists of numbers are one value."""
    then = {
        "grid": {"points": [8, 8]},
        "surface": [{"shape": "wave", "seed": 1}],
        "numerics": {"kernel": "love", "x": 1},
    }
    now = {
        "grid": {"points": [8, 9]},
        "surface": [{"shape": "wave", "seed": 2}],
        "numerics": {"kernel": "love", "x": 2},
    }
    found = outputs.differences(then, now, ("grid", "surface", "numerics.kernel", "initial"))
    assert found == "grid.points was [8, 8], is [8, 9]; surface.0.seed was 1, is 2"


# -- fFTW's wisdom is kept for runs with the same transforms, where nobody else can have put it -----------------------

NOBODY = 65534  # a user other than the one who runs the tests
JOB = """\
grid: {points: [16, 4], size: [1.0e-3, 2.5e-4]}
surface: {shape: wave, amplitude: 1.0e-6, waves: [1, 0]}
material: {model: elastic, shear_modulus: 1.0e6}
history: [{pressure: 1.0e4}]
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="gives a directory to somebody else")
def test_plans_in_a_directory_of_others_are_not_read(cache: Path, tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text(JOB)
    job, slab = load(tmp_path / "job.yaml"), Slab.alone(16, 4)
    wisdom.keep(choices(job).transforms, slab)
    (kept,) = (cache / "parcontact" / "plans").iterdir()
    assert wisdom._place(choices(job).transforms, slab) == kept
    os.chown(kept.parent, NOBODY, NOBODY)
    assert wisdom._place(choices(job).transforms, slab) is None
    wisdom.keep(choices(job).transforms, slab)
    assert [path.name for path in kept.parent.iterdir()] == [kept.name]


def test_plans_are_those_of_a_precision(cache: Path, tmp_path: Path) -> None:
    """An operator in single precision has transforms of its own."""
    (tmp_path / "job.yaml").write_text(JOB)
    slab, mixed = Slab.alone(16, 4), "numerics.precision=mixed"
    jobs = [load(tmp_path / "job.yaml", [mixed, f"numerics.tolerance={size}"]) for size in ("1e-3", "1e-4")]
    assert len({wisdom._place(choices(job).transforms, slab) for job in jobs} - {None}) == 2


def test_wisdom_of_a_checkpoint(cache: Path) -> None:
    """It is used for as many ranks; what is none is left alone, as is what was kept before."""
    slab = Slab.alone(16, 4)
    saved = wisdom.gather(slab)
    assert wisdom._adopt(saved.tobytes(), slab)
    assert not wisdom._adopt(b"none", slab)
    wisdom.keep(["a"], slab)
    (kept,) = (cache / "parcontact" / "plans").iterdir()
    before = kept.stat().st_mtime_ns
    wisdom.keep(["a"], slab)
    wisdom.recall(["a"], slab, None)
    assert kept.stat().st_mtime_ns == before


def test_more_wisdom_replaces_less(cache: Path) -> None:
    """A trial of few steps plans fewer transforms than a run; those that are missing would be chosen anew each time."""
    slab = Slab.alone(16, 4)
    wisdom.keep(["a"], slab)
    (kept,) = (cache / "parcontact" / "plans").iterdir()
    kept.write_bytes(b"less")
    wisdom.keep(["a"], slab)
    assert kept.read_bytes() == wisdom.gather(slab).tobytes()


# -- which points of a friction curve are asked for, and which its table lacks ----------------------------------------


def test_a_point_that_is_asked_for_again_is_one() -> None:
    assert requested_points((0.1, 1.0, 0.1), (1e5, 1e5)) == requested_points((0.1, 1.0), (1e5,))
    assert requested_points((0.1, 0.1), (1e5,), (20.0, 20.0)) == [(0.1, 1e5, 20.0)]


def test_what_a_table_lacks() -> None:
    """Speeds and pressures to 1e-6; a temperature that was not asked for is no other one. Speeds are solved first."""
    none, there = math.nan, of_table({"velocity": [0.1, 1.0], "pressure": [1e5, 1e5]})
    assert lacking_points(requested_points((1.0, 0.5, 0.1), (1e5,)), there) == [1]
    assert lacking_points(
        [(0.1 * (1 + 5e-7), 1e5, none), (0.1 * (1 + 2e-6), 1e5, none), (0.1, 1.1e5, none)], there
    ) == [1, 2]
    heated = of_table({"velocity": [0.1, 1.0], "pressure": [1e5, 1e5], "temperature": [20.0, -5.0]})
    assert lacking_points(requested_points((0.1, 1.0), (1e5,), (20.0, -5.0)), heated) == [1, 2]


# -- measures.csv: exact numbers, cut back without repeating or losing a row ------------------------------------------


def row(step: int, lost: tuple[float, ...] = ()) -> StepRow:
    return StepRow(step, 0.1 * step, measures=Measures(pressure=1 / 3), dissipated=sum(lost), branch_dissipation=lost)


def written(path: Path, count: int, branches: int = 0) -> None:
    file = MeasuresFile(path, TableMark(), branches)
    for step in range(count):
        file.write(row(step, (0.1,) * branches))
    file.close()


@pytest.mark.parametrize(
    ("forces", "signed"), [((-3.0, 0.0), 0.5), ((3.0, 0.0), -0.5), ((0.0, 2.0), 0.0), ((-3.0, 4.0), 0.3), ((0, 0), 0.0)]
)
def test_signed_friction(tmp_path: Path, forces: tuple[float, float], signed: float) -> None:
    """Over a normal force F the column is -force_x/F, exactly where the force is along x; friction is |force|/F."""
    friction = 0.5 if any(forces) else 0.0
    found = Measures(1.0, *forces, friction)
    assert found.friction_x == pytest.approx(signed, rel=2e-16, abs=0.0)
    assert math.copysign(1.0, found.friction_x) == (-1.0 if signed < 0.0 else 1.0)
    file = MeasuresFile(tmp_path / "measures.csv", TableMark(), 1)
    file.write(StepRow(1, measures=found, branch_dissipation=(0.1,)))
    file.close()
    table = tables.read_columns(tmp_path / "measures.csv")
    assert list(table).index("friction_x") == list(table).index("dissipated_0") + 1
    assert table["friction_x"] == [found.friction_x]


def test_cut_back(tmp_path: Path) -> None:
    path = tmp_path / "measures.csv"
    written(path, 6)
    whole = path.read_text()
    with path.open("a") as file:
        file.write("6,0.6,0.")  # a row that was cut off
    assert cut_back_table(path, 3, TableMark(), 0)[1] == []
    assert path.read_text() == "".join(whole.splitlines(keepends=True)[:5])
    file_again = MeasuresFile(path, TableMark())
    for step in (4, 5):
        file_again.write(row(step))
    file_again.close()
    assert path.read_text() == whole


def test_what_is_lost_is_said(tmp_path: Path) -> None:
    path = tmp_path / "measures.csv"
    assert "is missing" in cut_back_table(path, 3, TableMark(), 0)[1][0]
    written(path, 3)
    assert "ends with step 2: the rows up to step 5 are lost" in cut_back_table(path, 5, TableMark(), 0)[1][0]


def test_the_row_without_room_is_added(tmp_path: Path) -> None:
    """The last one of a checkpoint, also if it is the first of all."""
    path = tmp_path / "measures.csv"
    for count in (3, 1):
        written(path, count)
        whole = path.read_text()
        mark = TableMark(count, whole.splitlines()[-1])
        path.unlink()
        written(path, count - 1)
        assert cut_back_table(path, count - 1, mark, 0) == (mark, [])
        assert path.read_text() == whole
        path.unlink()


def test_all_records_are_on_the_disk_before_a_checkpoint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    provenance, place = Provenance((Link("", 1),)), SimpleNamespace(slab=Slab.alone(4, 3), path=tmp_path)
    recording = Recording(1, maps=("pressure",), size=(1.0, 1.0))
    recorder = Recorder(place, recording, provenance, None, quiet=True)  # type: ignore[arg-type]
    flushed = set[str]()
    monkeypatch.setattr(os, "fsync", lambda handle: flushed.add(Path(f"/proc/self/fd/{handle}").resolve().name))
    recorder.sync(provenance)
    recorder.close()
    assert flushed >= {"measures.csv", "fields.h5"}


def test_rows_up_to_the_last_checkpoint_are_needed(tmp_path: Path) -> None:
    """The directory belongs to a run that has not finished, or may still run."""
    checkpoints, path = tmp_path / "checkpoint", tmp_path / "measures.csv"
    checkpoints.mkdir()
    for name in ("step-2.h5", "step-10.h5", "step-11.h5.part", "step-x.h5"):
        (checkpoints / name).touch()
    written(path, 11)
    assert read_results(path)["step"][-1] == 10.0
    path.unlink()
    written(path, 10)
    with pytest.raises(InputError, match="checkpoint after step 10, and the table lacks rows"):
        read_results(path)


def test_other_columns(tmp_path: Path) -> None:
    """The dissipation of branches may be asked for later, or no longer."""
    path = tmp_path / "measures.csv"
    written(path, 3)
    assert cut_back_table(path, 2, TableMark(), 2)[1] == []
    assert list(tables.read_columns(path)) == [column.name for column in choose_columns(MEASURES, 2)]
    assert math.isnan(tables.read_columns(path)["dissipated_1"][2])
    assert cut_back_table(path, 2, TableMark(), 0)[1] == []
    assert list(tables.read_columns(path)) == [column.name for column in choose_columns(MEASURES)]
    written(tmp_path / "split.csv", 2, branches=2)
    assert tables.read_columns(tmp_path / "split.csv")["dissipated_1"] == [0.1, 0.1]
