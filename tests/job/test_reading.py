"""All mistakes of a job at once, and those that take several keys or sections to see."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml
from marched_jobs import ROOT

from parcontact import __main__
from parcontact.job import model, yaml_text

from . import texts
from .texts import SMALL

job_of, mistakes_of = partial(texts.job_of, Path()), partial(texts.mistakes_of, Path())


@pytest.fixture(autouse=True)
def _work_in_tmp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages call files by their path from the working directory."""
    monkeypatch.chdir(tmp_path)


BAD = """\
titel: Rubber
grid:
  points: [64, 0]
  size: -1.0
  boundary: peridic
surface:
  - {shape: wave, amplitude: 1e-6, waves: [1, 0.5]}
  - {shape: sphere, radius: 0, hurst: 1}
  - {shape: file, path: road.npy}
material:
  model: zener
  poisson: 0.6
  branches:
    - {G0: 2.75e6, G1: -1, eta1: .inf}
    - {modulus: 2.475e6}
history:
  - {pressure: 1.0e5, force: 1, duration: 1.0e-3}
  - {name: 3, velocity: 3.0, distance: 5.0e-4, duration: 1, cells_per_step: 1, time_step: {first: 0, growth: 0.5}}
  - {pressure: {from: -1, too: 2}, distance: 1, cells_per_step: 1}
numerics:
  tolerance: 2
  tolerance: 1e-3
output: {fields: [gaps], branch_dissipation: true}
"""


def test_every_mistake_in_order(tmp_path: Path) -> None:
    assert mistakes_of(BAD, "numerics.kernel=spec", "nonsense", "history.9.name=x") == [
        "job.yaml:1:1: titel is not a known key; did you mean title?",
        "job.yaml:3:16: grid.points.1 must be a positive whole number of points, got 0",
        "job.yaml:4:9: grid.size must be a positive length [m], got -1.0",
        "job.yaml:5:13: grid.boundary must be periodic | free | [periodic, free], got 'peridic'; "
        "did you mean periodic?",
        "job.yaml:7:47: surface.0.waves.1 must be two whole numbers of waves in the box, along x and along y, got 0.5",
        "job.yaml:8:29: surface.1.radius must be a positive length [m], got 0",
        "job.yaml:8:32: surface.1.hurst is not a key of shape sphere; known keys: shape, radius, profile, center",
        f"job.yaml:9:25: surface.2.path must be an existing file, got 'road.npy' (looked for {tmp_path / 'road.npy'})",
        "job.yaml:12:12: material.poisson must be a Poisson ratio [-] above -1 and up to 0.5, got 0.6",
        "job.yaml:14:24: material.branches.0.G1 must be a shear modulus [Pa] of zero or more, got -1",
        "job.yaml:15:7: material.branches.1.relaxation_time is missing; it must be a positive time [s]",
        "job.yaml:17:5: history.0 needs exactly one of pressure | force | approach, got pressure and force",
        "job.yaml:18:5: history.1 needs exactly one of pressure | force | approach, got none",
        "job.yaml:18:5: history.1 takes at most one of duration | distance | cycles, got duration and distance",
        "job.yaml:18:5: history.1 takes at most one of time_step | cells_per_step, got time_step and cells_per_step",
        "job.yaml:18:12: history.1.name must be text (put numbers in quotes), got 3",
        "job.yaml:18:99: history.1.time_step.first must be a positive time step [s], got 0",
        "job.yaml:18:110: history.1.time_step.growth must be a factor [-] of one or more, got 0.5",
        "job.yaml:19:27: history.2.pressure.too is not a known key; did you mean to?",
        "job.yaml:19:46: history.2.distance needs a velocity [m/s] that is not zero",
        "job.yaml:19:65: history.2.cells_per_step needs a velocity [m/s] that is not zero",
        "job.yaml:21:14: numerics.tolerance must be a tolerance [-] above 0 and below 1, got 2",
        "job.yaml:22:3: numerics.tolerance is given twice, first in line 21",
        "job.yaml:23:19: output.fields.0 must be pressure | displacement | gap | height | fluid_pressure | traction | "
        "temperature, got "
        "'gaps'; did you mean gap?",
        "job.yaml:23:46: output.branch_dissipation needs energy: true",
        "--set history.9.name=x: history is a list with entries history.0 to history.2, and has no 9",
        "--set nonsense: must have the form key.path=value, like grid.points=512",
        "--set numerics.kernel=spec: numerics.kernel must be spectral | love, got 'spec'; did you mean spectral?",
    ]


ROUGH = "{shape: rough, hurst: 0.8, long_wavelength: 2e-4, short_wavelength: 1e-4, rms_slope: 0.1}"


def test_roughness() -> None:
    text = SMALL.replace("{shape: wave, amplitude: 1e-6, waves: [1, 0]}", ROUGH)
    wave = "surface.short_wavelength"
    none_of = "surface needs exactly one of rms_slope | rms_height | psd_constant, got"
    for override, sentence in {
        "surface.rms_slope=": f"job.yaml:2:10: {none_of} none",
        "surface.rms_height=1": f"job.yaml:2:10: {none_of} rms_slope and rms_height",
        f"{wave}=3e-4": f"{wave} must not be longer than long_wavelength and rolloff_wavelength, 0.0002 m, got 0.0003",
        f"{wave}=3.1e-5": f"{wave} must be at least two cells, 3.125e-05 m (Nyquist), got 3.1e-05, which needs "
        "65 points along x",
        "grid.size=1": "grid.size has a side of 1 m, 5000 times surface.0.long_wavelength, 0.0002 m; is it in m? 1 mm "
        "would be 0.001",
        "surface.rolloff_wavelength=3e-4": "surface.rolloff_wavelength must not be longer than "
        "long_wavelength, 0.0002 m, got 0.0003",
        "surface.long_wavelength=-1": "surface.long_wavelength must be a positive wavelength [m], got -1",
        "surface.hurst=1.5": "surface.hurst must be a Hurst exponent above 0 and up to 1, got 1.5",
        "surface.seed=-1": "surface.seed must be a whole number of zero or more, got -1",
        "surface.seed=true": "surface.seed must be a whole number of zero or more, got true",
        "surface.psd_constant=0": "surface.psd_constant must be a positive spectral constant [m^4], got 0",
        "surface.amplitudes=fix": "surface.amplitudes must be random | fixed, got 'fix'; did you mean fixed?",
        "grid.size=1e-5": "surface.short_wavelength must fit into the box of 1e-05 m, got 0.0001",
    }.items():
        found = mistakes_of(text, override)
        expected = sentence if sentence.startswith("job") else f"--set {override}: {sentence}"
        assert expected.replace("--set grid.size=1e-5", "job.yaml:2:78") in found
    assert job_of(text, "surface.short_wavelength=3.125e-5").surface[0].short_wavelength == 3.125e-5


def test_steady_needs_pressures() -> None:
    by_approach = SMALL.replace("{pressure: 1e5}", "{approach: 1e-6}")
    assert mistakes_of(by_approach, "steady.velocities=1") == [
        (
            "--set steady.velocities=1: steady.pressures is missing; "
            "it must be positive pressures [Pa] when no stage of the history has a pressure or force"
        )
    ]


# -- the schema of job files: every job fits it, mistakes of many kinds do not, and all keys are in it ----------------

JOBS = sorted(
    path for path in (ROOT / "jobs").rglob("*.yaml") if path.name != "rubber.yaml" and path.parent.name != "materials"
)
RIGHT = """
grid: {points: 64, size: 1.0e-3}
surface: {shape: rough, hurst: 0.8, long_wavelength: 5.0e-4, short_wavelength: 1.0e-4, rms_slope: 0.1}
material: {model: zener, branches: [{G0: 1.0e6, G1: 0, eta1: .inf}, {modulus: 1.0e6, relaxation_time: 1.0}]}
history:
  - {pressure: {from: 0, to: 1.0e5}, velocity: [0.1, 0], duration: 1.0, time_step: {first: 1.0e-3, growth: 1.2}}
interface: {shear_stress: 1.0e5}
sweep: {surface.0.seed: [1, 2]}
study: {mesh: 64, integrator: [exponential]}
steady: {velocities: 1e-3:1:5, pressures: 1.0e5}
"""
WRONG = {
    "a key that there is not": ("grid", {"points": 64, "size": 1e-3, "boundry": "free"}),
    "a section that there is not": ("numeric", {}),
    "a word that there is not": ("grid", {"points": 64, "size": 1e-3, "boundary": "open"}),
    "a negative length": ("grid", {"points": 64, "size": -1.0}),
    "more than double precision can use": ("grid", {"points": 64, "size": 1e61}),
    "more points than can be counted": ("grid", {"points": 2**31, "size": 1.0}),
    "half a point": ("grid", {"points": 64.5, "size": 1.0}),
    "three sizes": ("grid", {"points": 64, "size": [1.0, 1.0, 1.0]}),
    "a shape that there is not": ("surface", {"shape": "cone"}),
    "two scales": (
        "surface",
        {"shape": "rough", "hurst": 1, "long_wavelength": 1, "short_wavelength": 1, "rms_slope": 1, "rms_height": 1},
    ),
    "no scale": ("surface", [{"shape": "rough", "hurst": 1, "long_wavelength": 1, "short_wavelength": 1}]),
    "a key of another shape": ("surface", {"shape": "sphere", "radius": 1.0, "axis": "x"}),
    "two loads": ("history", [{"pressure": 1.0, "force": 1.0}]),
    "no load": ("history", [{"name": "rest"}]),
    "text for a number": ("material", {"model": "elastic", "shear_modulus": "soft"}),
    "two forms of a branch": ("material", {"model": "zener", "branches": [{"G0": 1.0, "modulus": 1.0}]}),
    "a tolerance of one": ("numerics", {"tolerance": 1}),
    "a range without a count": ("steady", {"velocities": "1:2"}),
    "a sweep of one value": ("sweep", [{"surface.0.seed": 1}]),
    "no stress": ("interface", {"velocity": 1.0, "width": 1.0}),
}


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft202012Validator:
    found = model.json_schema()
    jsonschema.Draft202012Validator.check_schema(found)
    return jsonschema.Draft202012Validator(found)


def right() -> Any:
    return yaml_text.parse(RIGHT, "job").data


@pytest.mark.parametrize("path", JOBS, ids=lambda path: path.stem)
def test_every_job_fits(path: Path, validator: jsonschema.Draft202012Validator) -> None:
    validator.validate(yaml_text.read_source(path, str(path)).data)


def test_all_forms_of_values_fit(validator: jsonschema.Draft202012Validator) -> None:
    validator.validate(right())
    validator.validate(right() | {"material": {"include": "synthetic_tyre", "temperature": 40}})


@pytest.mark.parametrize("mistake", WRONG)
def test_mistakes_do_not(mistake: str, validator: jsonschema.Draft202012Validator) -> None:
    section, value = WRONG[mistake]
    assert not validator.is_valid(right() | {section: value})


def test_a_job_needs_its_sections(validator: jsonschema.Draft202012Validator) -> None:
    for section in ("grid", "surface", "material"):
        assert not validator.is_valid({key: value for key, value in right().items() if key != section})
    idle = {key: value for key, value in right().items() if key not in ("history", "steady")}
    assert not validator.is_valid(idle)


def test_every_key_is_in_it(validator: jsonschema.Draft202012Validator) -> None:
    text = json.dumps(validator.schema)
    assert not [key.word for section in model.sections() for key in section.keys if f'"{key.word}":' not in text]


def test_nothing_is_left_open(validator: jsonschema.Draft202012Validator) -> None:
    """A type for which there is no schema would allow anything; only a material next to an include has some."""
    found = model.json_schema()
    empty = [path for path, value in walk(found) if value == {} or value == {"description": value_of(value)}]
    assert not empty


def value_of(value: Any) -> Any:
    return value.get("description") if isinstance(value, dict) else None


def walk(node: Any, path: str = "") -> Any:
    yield path, node
    for key, value in node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ():
        yield from walk(value, f"{path}/{key}")


def test_the_verb(capsys: pytest.CaptureFixture[str]) -> None:
    assert __main__.main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(model.json_schema()))
    assert yaml.safe_load(RIGHT)
