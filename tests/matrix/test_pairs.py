"""Each pair of sections of a job in a small scene runs, or is refused in a sentence; `limits` has the table."""

import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from conftest import WORLD, Main

from parcontact.door import manual_texts
from parcontact.job.model import Job

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="for one process")

Data = dict[str, Any]
SCENE: Data = {
    "grid": {"points": 16, "size": 1e-3},
    "surface": [
        {"shape": "rough", "hurst": 0.8, "rms_slope": 0.05, "long_wavelength": 5e-4, "short_wavelength": 2.5e-4}
    ],
    "material": {
        **{"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]},
        "shift": {"law": "arrhenius", "energy": 5e4, "reference": 20.0},
    },
    "numerics": {"accuracy": 0.3},
}
WAVE = [{"shape": "wave", "amplitude": 4e-6, "waves": [2, 0]}]
SLIDE = {"pressure": 1e5, "velocity": 0.1, "distance": 1.25e-4, "cells_per_step": 1}
HISTORY: Data = {"history": [{"pressure": 1e5, "duration": 1e-3, "time_step": 5e-4}, SLIDE]}
CURVE: Data = {"steady": {"velocities": [0.1], "pressures": [1e5]}}
HEAT = {"conductivity": 0.2, "diffusivity": 1e-7}
SHEAR = {"shear_stress": 1e5}
SECTIONS: dict[str, Data] = {  # name in the table: what it adds to a job
    "adhesion": {"adhesion": {"work": 0.05}},
    "bands": {"bands": {"count": 2, "points": 16, "waves": 2}, **CURVE},
    "body": {"body": {"thickness": 1e-3}},
    "free": {"grid": {"boundary": "free"}},
    "strip": {"grid": {"boundary": ["periodic", "free"]}},
    "hardness": {"material": {"hardness": 1e7}},
    "initial": {"initial": {"state": "steady", "velocity": 0.1, "pressure": 1e5}, **HISTORY},
    "interface": {"interface": SHEAR},
    "stick": {"interface": {**SHEAR, "stick": True}},
    "creep": {"interface": {**SHEAR, "stick": True}, "surface": WAVE, "history": [{**SLIDE, "creep": 0.01}]},
    "leakage": {"leakage": {}},
    "energy": {"output": {"energy": True}},
    "steady": CURVE,
    "study": {"study": {"mesh": [8, 16]}, **HISTORY},
    "sweep": {"sweep": [{"numerics.max_iterations": [400, 500]}]},
    "thermal": {"thermal": HEAT},
    "feedback": {"thermal": {**HEAT, "feedback": "mean"}},
    "conductor": {"thermal": {**HEAT, "counterbody": HEAT}, **CURVE},
    "softening": {"softening": {"table": [[1e-3, 1, 1], [0.1, 0.5, 0.7]]}, **CURVE},
    "counterbody": {"counterbody": {"model": "elastic", "shear_modulus": 5e6}},
}
IN_EVERY_JOB = {"title", "grid", "surface", "material", "numerics", "history", "output", "checkpoint"}


def merged(first: Data, second: Data) -> Data:
    common = [key for key in first.keys() & second.keys() if isinstance(first[key], dict)]
    return {**first, **second, **{key: merged(first[key], second[key]) for key in common}}


def job_of(*names: str) -> Data:
    """Return a job with some sections; it has a history unless they ask for a curve only, and no grid next to bands."""
    job = SCENE
    for name in names:
        job = merged(job, SECTIONS[name])
    if "bands" in job and job["grid"] == SCENE["grid"]:
        job = {key: section for key, section in job.items() if key != "grid"}
    return job if "history" in job or "steady" in job else {**job, **HISTORY}


def verbs_of(job: Data) -> list[str]:
    begins = "study" if "study" in job else "run"
    return [begins] * ("history" in job) + ["steady"] * ("steady" in job)


def tried(main: Main, *names: str) -> str:
    """Return `yes` if a job with some sections runs, `no` if it is refused in a sentence."""
    job, file = job_of(*names), Path(f"{'_'.join(names)}.yaml")
    file.write_text(yaml.safe_dump(job))
    for verb in verbs_of(job):
        code, shown, said = main(verb, file, "--quiet")
        assert "Traceback" not in shown + said, (names, verb, said)
        assert code in (0, 2), (names, verb, code, said)
        if code:
            assert re.search(r"\w+ \w+ \w+", said), (names, verb, said)
            return "no"
    return "yes"


def rows_of_page() -> dict[str, set[str]]:
    """Return the names on the right of each row of the table on the page, by the name on the left."""
    table = re.search(r"(?m)^\| section or key \|.*\n\|-.*\n((?:\|.*\n)+)", manual_texts.page("limits", {}))
    assert table is not None, "the page has no table of pairs"
    rows = [re.findall(r"`(\w+)`", line) for line in table[1].splitlines()]
    return {first: set(rest) for first, *rest in rows}


def test_all_sections_are_in_the_table() -> None:
    """A new section needs a line of `SECTIONS`, and a row of the page."""
    assert {key for added in SECTIONS.values() for key in added} | IN_EVERY_JOB == set(Job.words())
    assert list(rows_of_page()) == list(SECTIONS)


@pytest.mark.parametrize("name", SECTIONS)
def test_a_row_of_the_table(name: str, main: Main) -> None:
    """Each section runs on its own, and with those before it as the page has it."""
    before = list(SECTIONS)[: list(SECTIONS).index(name)]
    assert tried(main, name) == "yes"
    refused = {other for other in before if tried(main, other, name) == "no"}
    rows = rows_of_page()
    assert rows[name] & {*before} == refused
    assert {other for other in before if name in rows[other]} == refused
