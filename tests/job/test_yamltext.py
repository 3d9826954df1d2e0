"""Texts that are made to break a reader, or that a broken program has written: one sentence each, soon."""

import os
from pathlib import Path

import pytest

from parcontact.job import JobError, load, yaml_text
from parcontact.job.reading import read_job

from .texts import SMALL, mistakes_of, with_material, with_stage, with_surface

ROUGH = "{shape: rough, hurst: 0.8, long_wavelength: 2e-4, short_wavelength: 1e-4, rms_slope: 0.1, seed: %s}"


@pytest.mark.parametrize("value", ["false", "3", "text", "{a: 1}"])
def test_a_scalar_where_a_list_of_stages_or_branches_is_due(tmp_path: Path, value: str) -> None:
    (mistake,) = mistakes_of(tmp_path, SMALL.partition("history")[0] + f"history: {value}\n")
    assert mistake.startswith("job.yaml:4:10: history must be a list of stages, got ")
    (mistake,) = mistakes_of(tmp_path, with_material(f"{{model: zener, modulus_inf: 1, branches: {value}}}"))
    assert mistake.startswith("job.yaml:3:52: material.branches must be a list of branches, got ")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (SMALL.replace("points: 64", "points: 1e18"), "1:16: grid.points must be at most 2147483647, got 10000000"),
        (SMALL.replace("points: 64", "points: 1" + "0" * 39), "1:16: grid.points must be at most 2147483647, got 1000"),
        (SMALL.replace("points: 64", "points: " + "9" * 4000), "1:16: grid.points must be at most 2147483647, got 999"),
        (SMALL.replace("points: 64", "points: " + "9" * 5000), "1:16: !!int does not belong in a job"),
        (SMALL.replace("[1, 0]", "[1e30, 0]"), "2:49: surface.waves.0 must be at most 2147483647, got 1"),
        (with_surface(ROUGH % ("1" + "0" * 39)), "2:106: surface.seed must be a whole number of zero or more"),
        (SMALL + "title: !!int ''\n", "6:8: !!int does not belong in a job"),
        (SMALL + "title: !!float ''\n", "6:8: !!float does not belong in a job"),
        (SMALL + "title: !!bool ''\n", "6:8: !!bool does not belong in a job"),
        (SMALL + "title: \ud800\n", "1:1: is not a text file in UTF-8: invalid continuation byte"),
        (SMALL + r'output: {"\ud800": 1}', "6:10: a key must be a word, got '\\ud800'"),
        (SMALL + r'"\udfff": 1', "6:1: a key must be a word, got '\\udfff'"),
        (SMALL + "numerics: {tolerence: }\n", "6:12: numerics.tolerence is not a known key; did you mean tolerance?"),
        (with_material("{include: ~nosuchuser/x.yaml}"), "3:21: material.include must name a material file, got '~no"),
        (with_material("{include: " + "x" * 5000 + "}"), "3:21: material.include must name a material file, got 'xxx"),
        (with_surface("{shape: file, path: ~nosuchuser/x.npy}"), "2:30: surface.path must be the name of a file, got"),
        (with_surface("{shape: file, path: " + "x" * 5000 + ".npy}"), "2:30: surface.path must be the name of a file"),
        (SMALL + "output: {directory: " + "x" * 5000 + "}\n", "6:21: output.directory must be the name of a file, got"),
        (SMALL + "output: {directory: ~nosuchuser}\n", "6:21: output.directory must be the name of a file, got"),
        (SMALL + "steady: {velocities: 1e-3:100:1000000000}\n", "6:22: steady.velocities must be a range first:last:"),
        (SMALL + "steady: {velocities: 1:2:" + "9" * 5000 + "}\n", "6:22: steady.velocities must be numbers or a"),
        (SMALL + "title: " + "[" * 5000 + "]" * 5000, "1:1: cannot be read as YAML: it is nested too deeply"),
        (SMALL + "title: " + "[" * 20000 + "]" * 20000, "1:1: cannot be read as YAML: it is nested too deeply"),
    ],
)  # fmt: skip
def test_one_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    (mistake,) = mistakes_of(tmp_path, text)
    assert mistake.startswith(f"job.yaml:{sentence}")
    assert len(mistake) < 600


def by_sequence(width: int = 9, depth: int = 12) -> str:
    rows = [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * width)}]" for i in range(1, depth)]
    return "\n".join(["a0: &a0 [x]", *rows])


def by_map(width: int = 9, depth: int = 12) -> str:
    rows = [f"a{i}: &a{i} {{{', '.join(f'k{j}: *a{i - 1}' for j in range(width))}}}" for i in range(1, depth)]
    return "\n".join(["a0: &a0 {x: 1}", *rows])


def by_merge(width: int = 3, depth: int = 40) -> str:
    rows = [f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * width)}]}}" for i in range(1, depth)]
    return "\n".join(["a0: &a0 {x: 1}", *rows])


BOMBS = [by_sequence(), by_map(), by_merge()]


@pytest.mark.parametrize("bomb", BOMBS, ids=["sequence", "map", "merge"])
def test_aliases_that_multiply(tmp_path: Path, bomb: str) -> None:
    """In a job, and in a material that it includes."""
    sentence = "1:1: has more than 100000 values after expansion of its aliases, the limit for a job"
    assert mistakes_of(tmp_path, f"{SMALL}{bomb}\n") == [f"job.yaml:{sentence}"]
    (tmp_path / "m.yaml").write_text(bomb)
    (mistake,) = mistakes_of(tmp_path, with_material("{include: m.yaml}"))
    assert mistake.endswith(f"m.yaml:{sentence}")


def test_thousands_of_mistakes_are_counted(tmp_path: Path) -> None:
    branches = "  - {modulus: -1, relaxation_time: 0}\n" * 3000
    found = mistakes_of(tmp_path, with_material(f"\n  model: zener\n  branches:\n{branches}"))
    assert len(found) == 21
    assert found[0].startswith("job.yaml:6:15: material.branches.0.modulus must be a shear modulus [Pa]")
    assert found[-1] == "... and 5980 more mistakes"


def test_only_regular_files_of_bounded_size_are_read(tmp_path: Path) -> None:
    """A pipe would hang, a device never ends, a sparse file eats the memory."""
    os.mkfifo(tmp_path / "pipe.yaml")
    with (tmp_path / "sparse.yaml").open("wb") as file:
        file.truncate(10_000_000_000)
    for path, reason in (
        (tmp_path / "pipe.yaml", "it is not a regular file"),
        (Path("/dev/zero"), "it is not a regular file"),
        (tmp_path / "sparse.yaml", "it is larger than 2 MB, the limit for a job"),
    ):
        with pytest.raises(JobError, match=f"cannot be read: {reason}"):
            load(path)
    (mistake,) = mistakes_of(tmp_path, with_material("{include: sparse.yaml}"))
    assert mistake.endswith("sparse.yaml: cannot be read: it is larger than 2 MB, the limit for a job")
    (mistake,) = mistakes_of(tmp_path, with_material("{include: pipe.yaml}"))
    assert "material.include must name a material file" in mistake
    os.mkfifo(tmp_path / "road.npy")
    (mistake,) = mistakes_of(tmp_path, with_surface("{shape: file, path: road.npy}"))
    assert "must be an existing file, got 'road.npy'" in mistake


@pytest.mark.parametrize("name", ["x" * 5000, "~nosuchuser/job.yaml", "a\0b"])
def test_names_of_jobs_that_no_file_can_have(name: str) -> None:
    with pytest.raises(JobError, match="cannot be read: "):
        load(name)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (SMALL.replace("shear_modulus: 1e6", "shear_modulus: 1e300"), "material.shear_modulus must be from 1e-60"),
        (SMALL.replace("size: 1e-3", "size: [1e-3, 1e-300]"), "grid.size.1 must be from 1e-60 to"),
        (SMALL.replace("amplitude: 1e-6", "amplitude: 1e300"), "surface.amplitude must be from 1e-60"),
        (with_stage("{pressure: 1e300}"), "history.0.pressure must be from 1e-60 to 1e+60"),
        (with_stage("{pressure: 1, duration: 1e30, time_step: 1}"), "history.0.time_step leads to 1e+30 steps; a hist"),
        (SMALL + "steady: {velocities: [1], pressures: [5e-324]}\n", "steady.pressures.0 must be from 1e-60"),
        (SMALL + "numerics: {accuracy: 5e-324}\n", "numerics.accuracy must be from 1e-60"),
    ],
)  # fmt: skip
def test_values_that_overflow_later(tmp_path: Path, text: str, sentence: str) -> None:
    found = mistakes_of(tmp_path, text)
    assert sentence in found[0]


def test_an_include_that_changes_nothing_is_stated(tmp_path: Path) -> None:
    """Keys that the job gives itself win over those of a file that --set includes."""
    own = with_material("{model: zener, modulus_inf: 1e6, branches: [{modulus: 1e6, relaxation_time: 1}]}")
    assert mistakes_of(tmp_path, own, "material.include=synthetic_tyre") == [
        "--set material.include=synthetic_tyre: has no effect on model, modulus_inf, branches, which the job gives "
        "itself; use --set material={include: synthetic_tyre} to replace the material"
    ]


def test_an_include_is_searched_in_the_directory_of_the_job_only(tmp_path: Path) -> None:
    """A file in a shared parent must not change the physics unseen; what was read is known by path and hash."""
    (tmp_path / "materials").mkdir()
    (tmp_path / "deep" / "materials").mkdir(parents=True)
    (tmp_path / "materials" / "m.yaml").write_text("{model: elastic, shear_modulus: 2e6}")
    text = with_material("{include: m}")
    (mistake,) = mistakes_of(tmp_path / "deep", text)
    assert (
        "must name a material file, got 'm' (looked for m.yaml and materials/m.yaml in the directory of the job file"
        in mistake
    )
    alongside = tmp_path / "deep" / "materials" / "m.yaml"
    alongside.write_bytes(b"abc: 1\n")
    _, (included,), _ = read_job(tmp_path / "deep" / "job.yaml", ())
    assert included.path == alongside
    # printf 'abc: 1\n' | sha256sum
    assert included.sha256 == "be10690b979a6439e0a095045129e20996ed424d61bb7149016297110c1b4303"


def test_a_sweep_of_more_cases_than_a_length_can_be(tmp_path: Path) -> None:
    axes = ", ".join(f"{{history.0.a{i}: {list(range(100))}}}" for i in range(12))
    (mistake,) = mistakes_of(tmp_path, f"{SMALL}sweep: [{axes}]\n")
    assert mistake == "job.yaml:6:8: sweep has 1000000000000000000000000 cases; at most 1000 are allowed"


def test_a_key_that_is_indented_more_than_the_one_before() -> None:
    """The column is what is wrong; the brace that is open comes later."""
    said = "".join(map(str, yaml_text.parse("title: x\n grid: {points", "job.yaml").mistakes))
    assert "job.yaml:2:6" in said
    assert "keys of one mapping must begin in the same column" in said
