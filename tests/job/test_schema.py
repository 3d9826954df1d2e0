"""The schema of job files: every job fits it, mistakes of many kinds do not, and all keys are in it."""

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml
from marching import ROOT

from parcontact import __main__
from parcontact.job import schema
from parcontact.job.text import yamltext

JOBS = sorted(path for path in (ROOT / "jobs").rglob("*.yaml") if path.name != "rubber.yaml")
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
    found = schema.schema()
    jsonschema.Draft202012Validator.check_schema(found)
    return jsonschema.Draft202012Validator(found)


def right() -> Any:
    return yamltext.parse(RIGHT, "job").data


@pytest.mark.parametrize("path", JOBS, ids=lambda path: path.stem)
def test_every_job_fits(path: Path, validator: jsonschema.Draft202012Validator) -> None:
    validator.validate(yamltext.read(path, str(path)).data)


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
    assert not [key.word for section in schema.sections() for key in section.keys if f'"{key.word}":' not in text]


def test_nothing_is_left_open(validator: jsonschema.Draft202012Validator) -> None:
    """A type for which there is no schema would allow anything; only a material beside an include has some."""
    found = schema.schema()
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
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(schema.schema()))
    assert yaml.safe_load(RIGHT)
