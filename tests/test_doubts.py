"""Warnings are data, and each kind of them has one sentence."""

import math
import pickle
import re
from pathlib import Path

import numpy as np
import pytest

import parcontact
from parcontact.bands.choice import cut_bands, doubts_of_bands
from parcontact.job import Job, meaning
from parcontact.march.rigid_surface import WARN_FLAT_MAP
from parcontact.march.sanity import WARN_CELLS, WARN_SEAM
from parcontact.printed import rounded_down, rounded_up

HOUSE = Path(parcontact.__file__).parent


def test_kinds_have_names_of_their_own_and_are_called() -> None:
    """Each kind is next to its test: the module that makes it calls it, too."""
    names, calls = list[str](), 0
    for path in HOUSE.rglob("*.py"):
        text = path.read_text()
        made = re.findall(r'^(\w+) = Kind\(\s*"([^"]+)"', text, re.MULTILINE)
        names += [name for _, name in made]
        calls += len(made)
        for constant, _ in made:
            assert len(re.findall(rf"\b{constant}\b", text)) > 1 or constant == "SAID", constant
    assert calls > 50
    assert len(set(names)) == len(names)


def test_numbers_in_sentences() -> None:
    """Shares in per cent, lengths with units, and how many times, also beyond all numbers."""
    contact = {"where": "step 3", "excess": 0.2031, "most": 0.15, "finer": "128 points"}
    assert "about 20 % too large (limit: 15 %" in str(WARN_CELLS("", contact))
    text = str(WARN_FLAT_MAP("surface", {"file": "a.npy", "lx": 1.23456e-3, "ly": 0.5, "span": 2.3456e-6}))
    assert text.startswith("surface: a.npy: the map is 1.235 mm x 500 mm, and its heights differ by 2.35 µm only")
    seam = {"axis": "x", "jump": 1e-6, "times": 3.14159, "tilt": 0.0}
    assert "3.14 times the largest step" in str(WARN_SEAM("surface", seam))
    assert "far above the largest step" in str(WARN_SEAM("surface", {**seam, "times": float("inf")}))


def test_who_follows_rounded_advice_keeps_the_limit() -> None:
    """Least values are rounded up and largest down, to three digits; a number of few digits stays as it is."""
    for value, up, down in ((0.00133333, "0.00134", "0.00133"), (0.002, "0.002", "0.002"), (9.999, "10", "9.99")):
        assert (rounded_up(value), rounded_down(value)) == (up, down)
    assert (rounded_up(1.4e-3, 1), rounded_up(2e-3, 1), rounded_up(0.0), rounded_up(math.inf)) == (
        "0.002",
        "0.002",
        "0",
        "inf",
    )


@pytest.mark.parametrize("wave", [3.33333e-4, 2.71828e-4, 1e-4 / 7.0])
def test_a_box_as_large_as_advised_gets_no_advice(wave: float) -> None:
    """It was given the same size again, which had been rounded down."""
    rough = {"shape": "rough", "hurst": 0.8, "short_wavelength": wave / 2, "rms_slope": 0.1}
    data = {
        "grid": {"points": 64, "size": 3.9 * wave},
        "surface": {**rough, "long_wavelength": wave},
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "history": [{"pressure": 1e4}],
    }
    (doubt,) = Job.model_validate(data).doubts
    size, longest = re.findall(r"grid.size of (\S+) m or a long_wavelength of (\S+) m", str(doubt))[0]
    larger, finer = {**data, "grid": {"points": 64, "size": float(size)}}, {**rough, "long_wavelength": float(longest)}
    assert Job.model_validate(larger).doubts == ()
    assert Job.model_validate({**data, "surface": finer}).doubts == ()


@pytest.mark.parametrize(
    ("points", "velocity", "warns"),
    [
        ([1, 64], [0.1, 0.0], True),
        ([1, 64], [0.1, 0.1], False),
        ([64, 1], [0.1, 0.0], False),
        ([64, 1], [0.0, 0.1], True),
    ],
)
def test_ridges_along_the_sliding_have_no_friction(points: list[int], velocity: list[float], warns: bool) -> None:
    """On a grid, and in bands."""
    rough = {"shape": "rough", "hurst": 0.8, "long_wavelength": 2e-4, "short_wavelength": 1e-4, "rms_slope": 0.1}
    elastic = {"model": "elastic", "shear_modulus": 1e6}
    slide = {"pressure": 1e4, "velocity": velocity, "distance": 1e-5}
    on_a_grid = {"grid": {"points": points, "size": 1e-3}, "history": [slide]}
    in_bands = {"bands": {"points": points}, "steady": {"velocities": [0.1], "pressures": [1e4], "direction": velocity}}
    for asked in (on_a_grid, in_bands):
        job = Job.model_validate({"surface": rough, "material": elastic, **asked})
        found = job.doubts if "grid" in asked else doubts_of_bands(job, cut_bands(job))
        assert ["consists of ridges along" in str(doubt) for doubt in found].count(True) == warns


def test_jobs_are_not_asked_for_keys_that_they_give(tmp_path: Path) -> None:
    """Units of heights are for files, and for those without them."""
    np.save(tmp_path / "road.npy", np.random.default_rng(1).normal(size=(16, 16)))
    ask, surface = meaning.doubt_slope, {"shape": "file", "path": tmp_path / "road.npy"}
    wave = {"shape": "wave", "amplitude": 1e-3, "waves": [1, 0]}
    for part, words in (
        (surface, "Heights in um need scale: 1.0e-6 (shape: file). Missing"),
        ({**surface, "scale": 1e-6}, "in m? Missing points"),
        ({**surface, "shape": "topography", "size": [1e-3, 1e-3]}, "need unit: um (shape: topography). Missing"),
        ({**surface, "shape": "topography", "size": [1e-3, 1e-3], "unit": "um", "nodata": 0.0}, "in m?"),
        (wave, "in m?"),
    ):
        data = {
            "grid": {"points": 16, "size": 1e-3},
            "surface": part,
            "material": {"model": "elastic", "shear_modulus": 1e6},
            "history": [{"pressure": 1e4}],
        }
        (doubt,) = ask(1.0, Job.model_validate(data).surface)
        assert words in str(doubt)
        assert not words.endswith("m?") or str(doubt).endswith(words)


def test_jobs_have_doubts_and_their_sentences() -> None:
    data = {
        "grid": {"points": 16, "size": 1e-3},
        "surface": {"shape": "wave", "amplitude": 1e-3, "waves": [1, 0]},
        "material": {"model": "elastic", "shear_modulus": 1e13},
        "history": [{"pressure": 1e4}],
    }
    job = Job.model_validate(data)
    assert [(doubt.kind, doubt.place) for doubt in job.doubts] == [("steep", "surface"), ("hard", "material")]
    assert job.doubts[1].numbers == {"modulus": 1e13, "most": 1e12}
    assert job.warnings == tuple(map(str, job.doubts)) == tuple(map(str, pickle.loads(pickle.dumps(job.doubts))))
