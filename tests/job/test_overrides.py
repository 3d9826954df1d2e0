"""Where a job's text comes from: YAML and its mistakes, overrides, included materials."""

from functools import partial
from pathlib import Path

import pytest

from parcontact.errors import InputError
from parcontact.job import Case, JobError, load, load_cases, select_cases
from parcontact.job.calculation import Bands

from . import texts
from .texts import SMALL, with_material

COMPOUND = """\
model: zener
modulus_inf: 1e6
branches:
  - {modulus: 3e6, relaxation_time: 1e-3}
  - {modulus: 2e6, relaxation_time: 1e-2}
"""


job_of, mistakes_of = partial(texts.job_of, Path()), partial(texts.mistakes_of, Path())


@pytest.fixture(autouse=True)
def _work_in_tmp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages call files by their path from the working directory."""
    monkeypatch.chdir(tmp_path)


# --- YAML


@pytest.mark.parametrize(
    ("text", "mistake"),
    [
        ("", "job.yaml:1:1: the job must be a mapping of keys, got nothing"),
        ("- 1\n", "job.yaml:1:1: the job must be a mapping of keys, got [1]"),
        ("a: 1\nb: [1,\n  2\n", ("job.yaml:4:1: cannot be read as YAML: expected ',' or ']', but got '<stream end>' "
         "(while parsing a flow sequence in line 2)")),
        ("a: b: c\n", "job.yaml:1:5: cannot be read as YAML: mapping values are not allowed here; "
            "keys of one mapping must begin in the same column, and a text with a colon needs quotes"),
        ("a: 1\n\tb: 2\n", "job.yaml:2:1: cannot be read as YAML: found character '\\t' that "
         "cannot start any token; indent by blanks, not by tabs"),
        ("a: *b\n", "job.yaml:1:4: cannot be read as YAML: found undefined alias 'b'"),
        ("a: 1\n---\nb: 1\n", ("job.yaml:2:1: cannot be read as YAML: but found another document "
         "(expected a single document in the stream in line 1)")),
        (b"title: caf\xe9\n", "job.yaml:1:1: is not a text file in UTF-8: invalid continuation byte at position 10"),
    ],
)  # fmt: skip
def test_text_that_cannot_be_read(text: str | bytes, mistake: str) -> None:
    assert mistakes_of(text) == [mistake]


@pytest.mark.parametrize(
    ("line", "mistake"),
    [
        ("title: x\ntitle: y", "7:1: title is given twice, first in line 6"),
        ("title: &x [*x]", "1:1: cannot be read as YAML: it is nested too deeply, or an alias contains itself"),
        ("title: !!timestamp 2001-01-01", "6:8: !!timestamp does not belong in a job"),
        ("title: !!python/object:os.system {}", "6:8: !!python/object:os.system does not belong in a job"),
        ("1: x", "6:1: a key must be a word, got '1'"),
        ("body: {thickness: 1,0e-3}", "6:21: a key must be a word, got '0e-3'; write decimals with a point"),
        ("body: {thickness: 1,02}", "6:21: a key must be a word, got '02'; write decimals with a point"),
        ("body: {thickness: 1 mm}", "6:19: body.thickness must be a positive thickness [m], got '1 mm'; write 1.0e-3"),
        ("? [a]\n: x", "6:3: a key must be a word, got a list or a mapping"),
        ("<<: 3", "6:5: << must be a mapping, or a list of mappings"),
    ],
)
def test_what_yaml_allows_and_a_job_does_not(line: str, mistake: str) -> None:
    assert mistakes_of(f"{SMALL}{line}\n") == [f"job.yaml:{mistake}"]


def test_two_loads_of_a_stage_are_a_ramp_or_two_stages() -> None:
    assert mistakes_of(SMALL.replace("pressure: 1e5", "pressure: [1e5, 2e5]")) == [
        "job.yaml:5:16: history.0.pressure must be a pressure [Pa] of zero or more, got a list; give {from: 100000.0, "
        "to: 200000.0} for a ramp, or a stage for each"
    ]


def test_a_missing_file_and_a_directory(tmp_path: Path) -> None:
    with pytest.raises(JobError, match=r"^nowhere\.yaml: cannot be read: there is no such file$"):
        load("nowhere.yaml")
    with pytest.raises(JobError, match=r"cannot be read: Is a directory$"):
        load(tmp_path)
    (tmp_path / "job.resolved.yaml").touch()
    with pytest.raises(JobError, match=r"Is a directory; the job of the run in it is .*/job\.resolved\.yaml$"):
        load(tmp_path)


# --- overrides


def test_later_overrides_win() -> None:
    assert job_of(SMALL, "grid={points: 32, size: 2}", "grid.points=16", "grid.points=8").grid.nx == 8


def test_overrides_reach_a_lone_surface_by_number_and_without() -> None:
    assert job_of(SMALL, "surface.0.amplitude=2e-6").surface[0].amplitude == 2e-6
    assert job_of(SMALL, "surface.amplitude=2e-6").surface[0].amplitude == 2e-6
    assert job_of(SMALL, "surface.0={shape: flat}").surface[0].shape == "flat"


def test_overrides_of_what_is_auto() -> None:
    """`auto` is a mapping without keys to them; points of a grid have no keys."""
    lines = (
        "bands: auto",
        "surface: {shape: rough, hurst: 0.8, rms_slope: 0.1, long_wavelength: 1e-3, short_wavelength: 1e-5}",
        "material: {include: synthetic_tyre}",
        "steady: {velocities: [1.0], pressures: [1e5]}",
    )
    bands = job_of("\n".join(lines) + "\n", "bands.cutoff_slope=1.3", "bands.samples=3").bands
    assert bands == Bands(cutoff_slope=1.3, samples=3)
    with pytest.raises(InputError, match=r"grid\.points is 'auto', not a mapping of keys, and has no 0"):
        job_of(SMALL.replace("points: 64", "points: auto"), "grid.points.0=64")


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        ("grid.points=-512", "grid.points must be a positive whole number of points, got -512"),
        ("grid.pionts=512", "grid.pionts is not a known key; did you mean points?"),
        ("gird.points=512", "gird is not a known key; did you mean grid?"),
        ("grid={points: 4, size: 1, points: 5}", "points is given twice"),
        ("grid.points", "must have the form key.path=value, like grid.points=512"),
        ("=512", "must have the form key.path=value, like grid.points=512"),
        ("grid..points=512", "must have the form key.path=value, like grid.points=512"),
        ("grid.points=[1", ("cannot be read as YAML: expected ',' or ']', but got '<stream end>' "
         "(while parsing a flow sequence in line 1)")),
        ("grid.points.0=1", "grid.points is 64, not a mapping of keys, and has no 0; give grid.points as a whole"),
        ("history.1.pressure=1", "history is a list with one entry, history.0, and has no 1"),
        ("history.last.pressure=1", ("history is a list with one entry, history.0, and has no last; "
         "did you mean history.0.last?")),
        ("history.0.pressure.to=-1", ("history.0.pressure is 100000.0, not a mapping of keys, and has no to; "
         "give history.0.pressure as a whole")),
        ("history.0.pressure=-1", ("history.0.pressure must be a pressure [Pa] of zero or more, got -1; pulling needs "
         "adhesion")),
        ("history.0.velocity=[1, x]", ("history.0.velocity.1 must be a velocity [m/s]: a number along x, or [vx, vy], "
         "got 'x'")),
        ("numerics.tolerance=0", "numerics.tolerance must be a tolerance [-] above 0 and below 1, got 0"),
        ("material.model=zenner", "material.model must be elastic | zener | dma, got 'zenner'; did you mean zener?"),
    ],
)  # fmt: skip
def test_mistakes_in_overrides(override: str, sentence: str) -> None:
    assert mistakes_of(SMALL, override) == [f"--set {override}: {sentence}"]


def test_an_index_with_more_digits_than_python_reads_is_a_mistake() -> None:
    (mistake,) = mistakes_of(SMALL, f"history.{'9' * 5000}.pressure=1")
    assert "history is a list with one entry, history.0, and has no 999" in mistake
    assert len(mistake) < 1000


def test_overrides_of_a_file_that_cannot_be_read() -> None:
    assert mistakes_of("a: [", "a.b=1", "c") == [
        (
            "job.yaml:1:5: cannot be read as YAML: expected the node content, but found '<stream end>' "
            "(while parsing a flow node in line 1)"
        ),
        "--set c: must have the form key.path=value, like grid.points=512",
    ]


# --- included materials


def write(path: str, text: str) -> None:
    Path(path).parent.mkdir(exist_ok=True, parents=True)
    Path(path).write_text(text, encoding="utf-8")


def test_include_by_name() -> None:
    write("paper/materials/rubber.yaml", COMPOUND)
    job = job_of(with_material("{include: rubber, poisson: 0.4}"), name="paper/fig.yaml")
    assert (job.material.model, job.material.poisson, job.material.modulus_inf) == ("zener", 0.4, 1e6)
    assert [branch.modulus for branch in job.material.branches] == [3e6, 2e6]
    assert "include" not in job.resolved()


def test_a_compound_of_the_program() -> None:
    """From any directory; one of the same name nearby comes first."""
    assert len(job_of(with_material("{include: synthetic_tyre}")).material.branches) == 12
    write("materials/synthetic_tyre.yaml", "{model: elastic, shear_modulus: 1}")
    assert job_of(with_material("{include: synthetic_tyre}")).material.model == "elastic"


def test_the_nearest_material_wins() -> None:
    write("materials/m.yaml", "{model: elastic, shear_modulus: 1}")
    write("near/materials/m.yaml", "{model: elastic, shear_modulus: 2}")
    assert job_of(with_material("{include: m}"), name="near/job.yaml").material.shear_modulus == 2.0


def test_include_by_path_and_a_file_that_says_material() -> None:
    write("jobs/mine.yaml", "material:\n  model: elastic\n  shear_modulus: 3\n")
    assert job_of(with_material("{include: mine.yaml}"), name="jobs/job.yaml").material.shear_modulus == 3.0


def test_overrides_reach_into_an_included_material() -> None:
    write("mine.yaml", COMPOUND)
    text = with_material("{include: elsewhere.yaml}")
    job = job_of(text, "material.branches.1.modulus=9", "material.include=mine.yaml", "material.poisson=0.3")
    assert [branch.modulus for branch in job.material.branches] == [3e6, 9.0]
    assert job.material.poisson == 0.3


def test_mistakes_in_an_included_material_are_found_there() -> None:
    write("materials/bad.yaml", COMPOUND.replace("3e6", "-3.0").replace("modulus_inf", "modulus_iff") + "poisson: 1\n")
    assert mistakes_of(with_material("{include: bad, poisson: 2}"), "material.branches.1.relaxation_time=0") == [
        "job.yaml:3:35: material.poisson must be a Poisson ratio [-] above -1 and up to 0.5, got 2",
        (
            "--set material.branches.1.relaxation_time=0: "
            "material.branches.1.relaxation_time must be a positive time [s], got 0"
        ),
        "materials/bad.yaml:2:1: material.modulus_iff is not a key of model zener; did you mean modulus_inf?",
        ("materials/bad.yaml:4:15: material.branches.0.modulus must be a shear modulus [Pa] of zero or more, got -3.0"),
    ]


def test_a_mistake_in_an_included_file_that_says_material_is_found_there() -> None:
    write("m.yaml", "material:\n  model: elastic\n  shear_modulus: 0\n  poisson: 0\n  poisson: 0.5\n")
    assert mistakes_of(with_material("{include: m.yaml}")) == [
        "m.yaml:3:18: material.shear_modulus must be a positive shear modulus [Pa], got 0",
        "m.yaml:5:3: material.poisson is given twice, first in line 4",
    ]


@pytest.mark.parametrize(
    ("content", "mistake"),
    [
        ("[1, 2", ("m.yaml:1:6: cannot be read as YAML: expected ',' or ']', but got '<stream end>' "
         "(while parsing a flow sequence in line 1)")),
        ("[1, 2]", "m.yaml:1:1: must be one mapping with the keys of a material"),
        ("", "m.yaml:1:1: must be one mapping with the keys of a material"),
        ("{include: n, model: elastic, shear_modulus: 1}", ("m.yaml:1:2: material.include is not a key of model "
         "elastic; known keys: model, poisson, shear_modulus, hardness")),
        ("{shear_modulus: 1}", "m.yaml:1:1: material.model is missing; it must be elastic | zener | dma"),
    ],
)  # fmt: skip
def test_included_files_that_are_no_material(content: str, mistake: str) -> None:
    write("m.yaml", content)
    assert mistakes_of(with_material("{include: m.yaml}")) == [mistake]


def test_an_include_that_is_not_there() -> None:
    must = "material.include must name a material file"
    assert mistakes_of(with_material("{include: rubbr}")) == [
        f"job.yaml:3:21: {must}, got 'rubbr' (looked for rubbr.yaml and materials/rubbr.yaml in the directory of the "
        "job file, and among the program's own: synthetic_tyre)"
    ]
    assert mistakes_of(with_material("{include: no/m.yaml, poisson: 9}")) == [
        f"job.yaml:3:21: {must}, got 'no/m.yaml' (looked from the job file)"
    ]
    assert mistakes_of(SMALL, "material.include=3") == [
        f"--set material.include=3: {must}, got 3 (a name or a path; among the program's own: synthetic_tyre)"
    ]


# -- the `sweep` section: cases, and mistakes at their places ---------------------------------------------------------

TIMES = "  - {history.0.pressure: [1e5, 2e5, 3e5]}\n"


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return Path("job.yaml")


def cases_of(path: Path, sweep: str, *overrides: str) -> tuple[Case, ...]:
    path.write_text(f"{SMALL}sweep:\n{sweep}")
    return load_cases(path, overrides)


def sweep_mistakes(path: Path, sweep: str, *overrides: str) -> list[str]:
    with pytest.raises(JobError) as caught:
        cases_of(path, sweep, *overrides)
    return caught.value.mistakes


def test_a_job_without_a_sweep_is_one_case(path: Path) -> None:
    path.write_text(SMALL)
    (case,) = load_cases(path)
    assert (case.settings, case.job) == ({}, load(path))
    assert load_cases(path, ["sweep=null"]) == (case,)


def test_ranges_and_a_lone_mapping(path: Path) -> None:
    """Powers of ten come out as such."""
    cases = cases_of(path, "  history.0.pressure: 1e4:1e7:7\n")
    assert [case.job.history[0].load.start for case in cases[::2]] == [1e4, 1e5, 1e6, 1e7]
    assert cases[1].job.history[0].load.start == pytest.approx(1e4 * 10**0.5, rel=1e-11)


def test_overrides_reach_every_case_and_the_sweep_itself(path: Path) -> None:
    cases = cases_of(path, TIMES, "grid.points=8", "output.directory=here")
    assert {case.job.grid.nx for case in cases} == {8}
    assert cases[2].job.output.directory == Path("here/cases/002")
    assert len(cases_of(path, TIMES, "sweep=[{history.0.pressure: [1e5]}]")) == 1
    assert len(load_cases(path, ["sweep.0={history.0.pressure: [1e5, 2e5]}"])) == 2


def test_one_case(path: Path) -> None:
    cases = cases_of(path, TIMES)
    assert load(path, case=1) == cases[1].job
    assert select_cases(cases, None) == cases
    with pytest.raises(InputError, match="the sweep has 3 cases, numbered from 0"):
        load(path, case=3)
    with pytest.raises(JobError, match=r"job.yaml:7:3: sweep has 3 cases, numbered from 0; choose one"):
        load(path)
    with pytest.raises(InputError, match="no sweep"):
        load(path, ["sweep=null"], case=0)


@pytest.mark.parametrize(
    ("line", "mistake"),
    [
        ("  - {grid.pionts: [16]}", "job.yaml:7:6: grid.pionts is not a known key; did you mean points?"),
        ("  - {grid.points: [16, x]}", "job.yaml:7:24: grid.points must be a positive whole number of points, got 'x'"),
        ("  - {history.3.pressure: [1]}", "job.yaml:7:6: history is a list with one entry, history.0, and has no 3"),
        (
            "  - {grid.points: []}",
            "job.yaml:7:19: grid.points needs a list of values or a range first:last:count, got []",
        ),
        ("  - {output.directory: [a]}", "job.yaml:7:6: output.directory cannot be swept"),
        ("  - {sweep.0: [a]}", "job.yaml:7:6: sweep.0 cannot be swept"),
        ("  - {grid..points: [8]}", "job.yaml:7:6: must be a key of the job like grid.points, got 'grid..points'"),
        ("  - 3", "job.yaml:7:5: sweep must be a list of mappings from keys to lists of values, got 3"),
        ("  - {}", "job.yaml:7:5: sweep must be a list of mappings from keys to lists of values, got a mapping"),
        (
            "  - {grid.points: [8, 16], grid.size: [1]}",
            "job.yaml:7:5: keys of one mapping change together and need equal numbers of values, "
            "got 2 of grid.points, 1 of "
            "grid.size",
        ),
        (
            "  - {grid: [{points: 8, size: 1}], grid.points: [16]}",
            "job.yaml:7:36: grid.points is swept a second time, first as grid at job.yaml:7:6",
        ),
        (
            "  - {surface.phase: [0, 1], surface.0.phase: [2, 3]}",
            "job.yaml:7:29: surface.0.phase is swept a second time, first as surface.phase at job.yaml:7:6",
        ),
        ("  - {grid.points: 1:2000:1001}", "job.yaml:7:3: sweep has 1001 cases; at most 1000 are allowed"),
    ],
)
def test_mistakes(path: Path, line: str, mistake: str) -> None:
    assert sweep_mistakes(path, f"{line}\n") == [mistake]


def test_a_mistake_of_some_cases_names_the_first_of_them(path: Path) -> None:
    """One that a setting makes elsewhere; what all cases have in common is said once, as without a sweep."""
    rough = "[{shape: rough, hurst: 0.9, long_wavelength: 1e-3, short_wavelength: 1e-4, rms_slope: 0.1}]"
    found = sweep_mistakes(path, "  - {grid.points: [64, 16, 8]}\n", f"surface={rough}", "material.poisson=2")
    assert sorted(found) == [
        "--set material.poisson=2: material.poisson must be a Poisson ratio [-] above -1 and up to 0.5, got 2",
        f"--set surface={rough}: surface.0.short_wavelength must be at least two cells, 0.000125 m (Nyquist), got "
        "0.0001, which needs 20 points along x (in case 1: grid.points = 16)",
        f"--set surface={rough}: surface.0.short_wavelength must be at least two cells, 0.00025 m (Nyquist), got "
        "0.0001, which needs 20 points along x (in case 2: grid.points = 8)",
    ]


def test_an_override_of_what_is_swept_is_a_mistake(path: Path) -> None:
    (found,) = sweep_mistakes(path, TIMES, "history.0.pressure=1")
    assert found.startswith("--set history.0.pressure=1: history.0.pressure is swept; change the sweep instead")
    (found,) = sweep_mistakes(path, "  - {surface.phase: [0, 1]}\n", "surface.0.phase=2")
    assert found.startswith("--set surface.0.phase=2: surface.phase is swept")
