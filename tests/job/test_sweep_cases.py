"""The `sweep` section: cases, and mistakes at their places."""

from pathlib import Path

import pytest

from parcontact.errors import InputError, JobError
from parcontact.job import Case, choose, load, load_cases

from .texts import SMALL

TOGETHER = "  - {grid.points: [16, 32], grid.size: [2e-3, 4e-3]}\n"
TIMES = "  - {history.0.pressure: [1e5, 2e5, 3e5]}\n"


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return Path("job.yaml")


def cases_of(path: Path, sweep: str, *overrides: str) -> tuple[Case, ...]:
    path.write_text(f"{SMALL}sweep:\n{sweep}")
    return load_cases(path, overrides)


def mistakes_of(path: Path, sweep: str, *overrides: str) -> list[str]:
    with pytest.raises(JobError) as caught:
        cases_of(path, sweep, *overrides)
    return caught.value.mistakes


def test_keys_of_a_mapping_move_together_and_mappings_multiply(path: Path) -> None:
    """The last mapping goes the fastest; each case is a job like any other, with a directory of its own."""
    cases = cases_of(path, TOGETHER + TIMES)
    assert [case.number for case in cases] == list(range(6))
    jobs = [case.job for case in cases]
    assert [job.grid.nx for job in jobs] == [16, 16, 16, 32, 32, 32]
    assert [job.grid.lx for job in jobs] == [2e-3, 2e-3, 2e-3, 4e-3, 4e-3, 4e-3]
    assert [job.history[0].load.start for job in jobs] == [1e5, 2e5, 3e5, 1e5, 2e5, 3e5]
    assert jobs[4].output.directory == Path("out/job/cases/004")
    assert cases[4].settings == {"grid.points": 32, "grid.size": 4e-3, "history.0.pressure": 2e5}
    assert str(cases[4]) == "case 4: grid.points = 32, grid.size = 0.004, history.0.pressure = 200000.0"


def test_a_resolved_case_is_that_case(path: Path, tmp_path: Path) -> None:
    case = cases_of(path, TOGETHER + TIMES)[4]
    (tmp_path / "again.yaml").write_text(case.job.resolved())
    assert load(tmp_path / "again.yaml") == case.job


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


def test_whole_sections_and_materials(path: Path) -> None:
    sweep = (
        "  - material.include: [synthetic_tyre]\n    surface: [[{shape: flat}]]\n    numerics: [{tolerance: 1e-6}]\n"
    )
    path.write_text(SMALL.replace("material: {model: elastic, shear_modulus: 1e6}\n", "") + f"sweep:\n{sweep}")
    (case,) = load_cases(path)
    assert case.job.material.model == "zener"
    assert case.job.surface[0].shape == "flat"
    assert case.job.numerics.tolerance == 1e-6


def test_overrides_reach_every_case_and_the_sweep_itself(path: Path) -> None:
    cases = cases_of(path, TIMES, "grid.points=8", "output.directory=here")
    assert {case.job.grid.nx for case in cases} == {8}
    assert cases[2].job.output.directory == Path("here/cases/002")
    assert len(cases_of(path, TIMES, "sweep=[{history.0.pressure: [1e5]}]")) == 1
    assert len(load_cases(path, ["sweep.0={history.0.pressure: [1e5, 2e5]}"])) == 2


def test_one_case(path: Path) -> None:
    cases = cases_of(path, TIMES)
    assert load(path, case=1) == cases[1].job
    assert choose(cases, None) == cases
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
            "job.yaml:7:5: keys of one mapping move together and need as many values each, got 2 of grid.points, 1 of "
            "grid.size",
        ),
        (
            "  - {grid: [{points: 8, size: 1}], grid.points: [16]}",
            "job.yaml:7:36: grid.points is swept a second time, first as grid at job.yaml:7:6",
        ),
        ("  - {grid.points: 1:2000:1001}", "job.yaml:7:3: sweep has 1001 cases, and 1000 is the most"),
    ],
)
def test_mistakes(path: Path, line: str, mistake: str) -> None:
    assert mistakes_of(path, f"{line}\n") == [mistake]


def test_a_mistake_of_some_cases_names_the_first_of_them(path: Path) -> None:
    """One that a setting makes elsewhere; what all cases have in common is said once, as without a sweep."""
    rough = "[{shape: rough, hurst: 0.9, long_wavelength: 1e-3, short_wavelength: 1e-4, rms_slope: 0.1}]"
    found = mistakes_of(path, "  - {grid.points: [64, 16, 8]}\n", f"surface={rough}", "material.poisson=2")
    assert sorted(found) == [
        "--set material.poisson=2: material.poisson must be a Poisson ratio [-] above -1 and up to 0.5, got 2",
        f"--set surface={rough}: surface.0.short_wavelength must be at least two cells, 0.000125 m (Nyquist), got "
        "0.0001, which needs 20 points along x (in case 1: grid.points = 16)",
        f"--set surface={rough}: surface.0.short_wavelength must be at least two cells, 0.00025 m (Nyquist), got "
        "0.0001, which needs 20 points along x (in case 2: grid.points = 8)",
    ]


def test_an_override_of_what_is_swept_is_a_mistake(path: Path) -> None:
    (found,) = mistakes_of(path, TIMES, "history.0.pressure=1")
    assert found.startswith("--set history.0.pressure=1: history.0.pressure is swept; change the sweep instead")


def test_a_misspelt_sweep_is_found(path: Path) -> None:
    path.write_text(f"{SMALL}sweeps:\n{TIMES}")
    with pytest.raises(JobError, match=r"sweeps is not a known key; did you mean sweep\?"):
        load_cases(path)
