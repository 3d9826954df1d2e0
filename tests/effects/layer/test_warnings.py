"""Warnings about a layer, from the job alone: each at its limit, and not just below it."""

import math
from typing import Any

import pytest

from parcontact.job import Job
from parcontact.job.history import Timeline
from parcontact.march.sanity import ContactWatch, check_heights
from parcontact.march.scene import set_up
from parcontact.parallel.slab import Slab
from parcontact.physics.records import Measures

ROUGH = {"shape": "rough", "hurst": 0.8, "long_wavelength": 5e-4, "short_wavelength": 2e-4}
WAVE = {"shape": "wave", "amplitude": 1e-6, "waves": [2, 0]}


def warnings(thickness: float, surface: Any = WAVE, **changes: Any) -> list[str]:
    """Return the warnings of a job with a layer that it does not have without."""
    given = {
        "grid": {"points": 64, "size": 1e-3},
        "surface": surface,
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "history": [{"pressure": 1e3}],
        **changes,
    }
    body = {"thickness": thickness, **given.pop("body", {})}
    plain = Job.model_validate(given).warnings
    return [text for text in Job.model_validate({**given, "body": body}).warnings if text not in plain]


def test_a_layer_thinner_than_two_cells() -> None:
    """Where contact may have edges: not on waves alone."""
    cell, rough = 1e-3 / 64, {**ROUGH, "rms_height": 1e-7}
    assert warnings(2.01 * cell, rough) == warnings(1.99 * cell) == []
    (text,) = warnings(1.99 * cell, rough)
    assert "thinner than 2 cells of 1.56e-05 m" in text


@pytest.mark.parametrize(
    ("surface", "height"),
    [([{**WAVE, "amplitude": 2e-5}], math.sqrt(2) * 2e-5), ([{**ROUGH, "rms_height": 1e-5}], 2e-5)],
)
def test_a_surface_higher_than_a_third_of_the_layer(surface: Any, height: float) -> None:
    """The height is twice the rms height, which no wave and no roughness is lower than."""
    assert warnings(3.01 * height, surface) == []
    (text,) = warnings(2.99 * height, surface)
    assert f"the surface is {height:.3g} m high or more" in text


@pytest.mark.parametrize(("sphere", "count"), [([], 1), ([{"shape": "sphere", "radius": 1e-2}], 0)])
def test_heights_that_the_job_does_not_have(sphere: Any, count: int) -> None:
    """Roughness of which twice the rms height is below a third, but not the whole height; an indenter is not high."""
    job = Job.model_validate(
        {
            "grid": {"points": 64, "size": 1e-3},
            "surface": [{**ROUGH, "rms_height": 1e-6}, *sphere],
            "material": {"model": "elastic", "shear_modulus": 1e6},
            "history": [{"pressure": 1e3}],
            "body": {"thickness": 1e-5},
        }
    )
    found = check_heights(set_up(job, Slab.alone(64, 64)))
    assert [doubt.kind for doubt in (*job.doubts, *found)].count("high for a layer") == count


def test_an_indenter_deeper_than_a_third_of_the_layer() -> None:
    sphere = {"shape": "sphere", "radius": 1e-2}
    press = {"approach": {"from": 0.0, "to": 4e-5}, "duration": 1.0, "time_step": 0.5}
    assert warnings(1.21e-4, sphere, history=[press]) == []
    (text,) = warnings(1.19e-4, sphere, history=[press])
    assert text.startswith("history.0.approach: 4e-05 m is more than a third of the layer")


@pytest.mark.parametrize("shape", [{"shape": "sphere", "radius": 1e-2}, {"shape": "cone", "slope": 0.1}])
def test_an_indenter_that_its_load_presses_deep(shape: Any) -> None:
    """The depth is known after the step only. A wave has no depth: its approach counts from its mean plane."""
    sheet = {"thickness": 4.2e-3}
    job = Job.model_validate({**_free(shape), "history": [{"force": 1e-3}], "body": sheet})
    watch = ContactWatch.of(job, Timeline.from_job(job))
    assert watch.check_step(1, Measures(approach=1.39e-3)) == []
    (found,) = watch.check_step(1, Measures(approach=1.41e-3))
    assert str(found).startswith("step 1: the indenter is 0.00141 m deep in the layer, more than a third of its thick")
    assert watch.check_step(2, Measures(approach=2e-3)) == []  # once in a run
    waves = Job.model_validate({**_free(WAVE), "grid": {"points": 16, "size": 1e-3}, "body": sheet})
    assert ContactWatch.of(waves, Timeline.from_job(waves)).check_step(1, Measures(approach=2e-3)) == []


def test_a_contact_on_a_layer_is_no_contact_on_a_half_space() -> None:
    """Hertz's contact would be larger than the sphere and leave the box; on a thin layer it is far smaller."""
    sphere = {**_free({"shape": "sphere", "radius": 8e-3}), "history": [{"force": 50.0}]}
    assert len(Job.model_validate(sphere).warnings) == 2
    assert Job.model_validate({**sphere, "body": {"thickness": 4e-3}}).warnings == ()


def _free(shape: Any) -> dict[str, Any]:
    """Return a job with an indenter in a free box of 26 mm on soft rubber."""
    return {
        "grid": {"points": 16, "size": 2.6e-2, "boundary": "free"},
        "surface": shape,
        "material": {"model": "elastic", "shear_modulus": 3e4},
        "history": [{"pressure": 1e3}],
    }


def test_waves_to_which_rubber_is_compressible() -> None:
    """Longer than 100 thicknesses, on a base to which it is bonded; not if the material is given as compressible."""
    grid, surface = {"points": 1024, "size": 1e-2}, {**WAVE, "waves": [1, 0]}
    assert warnings(1.01e-4, surface, grid=grid) == []
    (text,) = warnings(0.99e-4, surface, grid=grid)
    assert text.startswith("material.poisson: waves of 0.01 m are more than 100 times")
    assert warnings(0.99e-4, surface, grid=grid, body={"base": "smooth"}) == []
    rubber = {"model": "elastic", "shear_modulus": 1e6, "poisson": 0.4995}
    assert warnings(0.99e-4, surface, grid=grid, material=rubber) == []


def test_the_longest_wave_of_a_roughness_lies_along_its_grooves() -> None:
    """It is `ratio` times as long as `long_wavelength`, here as long as the box: 101 thicknesses."""
    for ratio, count in ((1.0, 0), (2.0, 1)):
        surface = {**ROUGH, "rms_height": 1e-7, "anisotropy": {"ratio": ratio}}
        assert sum("more than 100 times" in text for text in warnings(0.99e-5, surface)) == count
