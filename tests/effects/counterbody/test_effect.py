"""Jobs with a counterbody that deforms: closed forms, what is refused, and that a rigid or absent one costs nothing."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from conftest import WORLD
from marched_jobs import column, marched

from parcontact.effects.branches import relaxation_of
from parcontact.effects.counterbody.effect import CounterbodyThatDeforms, frequencies
from parcontact.errors import InputError, JobError
from parcontact.files.hdf5 import references_of
from parcontact.job import Job, load
from parcontact.job.listing import plain_data, plain_job
from parcontact.job.model import json_schema
from parcontact.march import choices, mesh, scene
from parcontact.march.curve import request
from parcontact.march.steady import SteadySliding
from parcontact.parallel.slab import Slab
from parcontact.physics.prony import complex_modulus
from parcontact.results import prediction

BODIES = ("material", "counterbody")
LENGTH, PRESSURE, AMPLITUDE, TIME = 1e-3, 1e5, 4e-8, 1e-3
WAVE = 2.0 * math.pi * 2.0 / LENGTH  # [rad/m]
RUBBER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 9e6, "relaxation_time": TIME}]}
OTHER = {"model": "zener", "modulus_inf": 5e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-2}]}
STIFF = {"model": "elastic", "shear_modulus": 5e6}
SLIDE = {"pressure": PRESSURE, "velocity": 0.2, "distance": 2e-4, "cells_per_step": 1}
STEADY = {"velocities": [0.2], "pressures": [PRESSURE]}
SHIFT = {"law": "wlf", "C1": 10.0, "C2": 80.0, "reference": 20.0}
WARM = {**RUBBER, "shift": {**SHIFT, "vertical": {"law": "density", "expansion": 6e-4}}}
OTHER_WARM = {**OTHER, "shift": {"law": "arrhenius", "energy": 5e4, "reference": 0.0}}


def data_of(**more: Any) -> dict[str, Any]:
    """A wave on 32 cells, in full contact."""
    data = {
        "grid": {"points": [32, 4], "size": [LENGTH, LENGTH / 8]},
        "surface": {"shape": "wave", "amplitude": AMPLITUDE, "waves": [2, 0]},
        "material": RUBBER,
        "counterbody": STIFF,
        "history": [SLIDE],
        "numerics": {"tolerance": 1e-10},
        **more,
    }
    return {key: value for key, value in data.items() if value is not None}


def job(**more: Any) -> Job:
    return Job.model_validate(data_of(**more))


def moduli(omega: Any, spring: float, term: float, time: float) -> Any:
    return spring + term * 1j * omega * time / (1.0 + 1j * omega * time)


def friction_of(found: Job, velocity: float) -> float:
    sliding = SteadySliding(scene.set_up(found, Slab.alone(*found.grid.points)))
    return sliding.solve((velocity, 0.0), PRESSURE).measures.friction


def of_surface(friction: float) -> float:
    """Friction as the loss modulus of the pair [MPa]."""
    return friction * PRESSURE / (WAVE * AMPLITUDE) ** 2 / 1e6


@pytest.mark.parametrize(("x", "expected"), [(0.1, 0.58824), (1.0, 0.86207), (3.0, 0.32751), (10.0, 0.09984)])
def test_steady_friction_of_one_wave(x: float, expected: float) -> None:
    """mu p0/(k A)^2 is the loss modulus of 1/(1/G1 + 1/G2) at the frequency of the wave, to five digits."""
    found = job(history=None, steady={"velocities": [x / TIME / WAVE], "pressures": [PRESSURE]})
    assert of_surface(friction_of(found, x / TIME / WAVE)) == pytest.approx(expected, abs=6e-6)


def test_a_relaxing_counterbody_in_steady_sliding() -> None:
    """It counts with its long-term modulus."""
    found = [friction_of(job(history=None, steady=STEADY, counterbody=body), 0.2) for body in (OTHER, STIFF)]
    assert found[0] == pytest.approx(found[1], rel=1e-12)


def test_a_slide_ends_at_its_steady_state() -> None:
    """After ten relaxation times of the pair, 2.5 times those of the rubber: exp(-10) of the beginning is left."""
    slide = {**SLIDE, "distance": 25.0 * TIME * 0.2}
    end = marched(job(history=[slide]))[1][-1].measures.friction
    assert end == pytest.approx(friction_of(job(history=None, steady=STEADY), 0.2), rel=1e-4)


def ball(load: float, history: list[dict[str, Any]], **more: Any) -> Job:
    grid = {"points": 64, "size": LENGTH, "boundary": "free"}
    history = [{"force": load, **stage} for stage in history]
    return job(grid=grid, surface={"shape": "sphere", "radius": 1e-2}, history=history, **more)


def test_hertz_on_two_elastic_bodies() -> None:
    """1/E* = (1 - nu1)/(2 G1) + (1 - nu2)/(2 G2), a^3 = 3 F R/(4 E*), approach a^2/R, peak 3 F/(2 pi a^2); to the
    error of a mesh with 15 cells in the radius."""
    radius, ball_radius = 0.24 * LENGTH, 1e-2
    modulus = 1.0 / (0.5 / 2e6 / 2.0 + 0.7 / 3e6 / 2.0)
    force = 4.0 * modulus * radius**3 / 3.0 / ball_radius
    bodies = {"model": "elastic", "shear_modulus": 2e6}, {"model": "elastic", "shear_modulus": 3e6, "poisson": 0.3}
    measures = marched(ball(force, [{}], material=bodies[0], counterbody=bodies[1]))[1][-1].measures
    assert math.sqrt(measures.contact_area_corrected * LENGTH**2 / math.pi) == pytest.approx(radius, rel=5e-3)
    assert measures.approach == pytest.approx(radius**2 / ball_radius, rel=5e-3)
    assert measures.max_pressure == pytest.approx(1.5 * force / math.pi / radius**2, rel=1e-2)


def test_pressing_on_a_body_that_relaxes_too() -> None:
    """Creep compliances add: a^3 = 3 F R (1 - nu) (J1 + J2)/8 and approach a^2/R under a constant load (Lee and Radok),
    to the error of the mesh."""
    force, ball_radius = 2.5e-3, 1e-2
    hold = {"duration": 4e-2, "time_step": 5e-4}
    rows = marched(ball(force, [{}, hold], counterbody=OTHER))[1]
    times, approach = column(rows, "time"), column(rows, "approach")
    compliance = np.zeros_like(times)
    for spring, term, time in ((1e6, 9e6, TIME), (5e6, 1e6, 1e-2)):
        retarded = time * (spring + term) / spring
        compliance += 1.0 / spring - term / spring / (spring + term) * np.exp(-times / retarded)
    radii = np.cbrt(3.0 * force * ball_radius * 0.5 * compliance / 8.0)
    kept = times > 1e-3
    assert radii[kept].max() < 0.4 * LENGTH
    assert radii[kept].max() / radii[kept].min() > 1.4
    np.testing.assert_allclose(approach[kept], radii[kept] ** 2 / ball_radius, rtol=1e-2)


@pytest.mark.parametrize("temperature", [None, -5.0, 40.0])
def test_bodies_are_shifted_before_they_are_one(temperature: float | None) -> None:
    """1/M = 1/(b1 G1(a1 w)) + 1/(b2 G2(a2 w)) with the laws by hand; a_T of the pair made cold is another modulus."""
    found = job(material=WARM, counterbody=OTHER_WARM, history=[{"pressure": PRESSURE}])
    found = found if temperature is None else found.at_temperature(temperature)
    own, other = (20.0, 0.0) if temperature is None else (temperature, temperature)
    slow = 10.0 ** (-10.0 * (own - 20.0) / (80.0 + own - 20.0))
    stiff = (1.0 - 6e-4 * (own - 20.0)) * (own + 273.15) / 293.15
    late = math.exp(5e4 / 8.314462618 * (1.0 / (other + 273.15) - 1.0 / 273.15))
    omega = np.logspace(-6, 8, 50)
    parts = stiff * moduli(omega, 1e6, 9e6, slow * TIME), moduli(omega, 5e6, 1e6, late * 1e-2)
    series = relaxation_of(found.material)
    np.testing.assert_allclose(complex_modulus(omega, *series), 1.0 / (1.0 / parts[0] + 1.0 / parts[1]), rtol=1e-8)
    assert found.material.fitted.time_factor == pytest.approx(slow)


def test_only_a_counterbody_has_a_shift() -> None:
    found = job(material=STIFF, counterbody=OTHER_WARM, history=[{"pressure": PRESSURE}]).at_temperature(40.0)
    late = math.exp(5e4 / 8.314462618 * (1.0 / 313.15 - 1.0 / 273.15))
    expected = 1.0 / (1.0 / 5e6 + 1.0 / moduli(1e3, 5e6, 1e6, late * 1e-2))
    assert complex(complex_modulus(1e3, *relaxation_of(found.material))) == pytest.approx(expected, rel=1e-8)


def test_temperatures_beyond_either_shift_are_refused() -> None:
    factors = {"law": "factors", "temperatures": [0.0, 30.0], "logs": [0.0, -2.0], "reference": 10.0}
    found = job(history=None, steady=STEADY, material=WARM, counterbody={**OTHER, "shift": factors})
    with pytest.raises(InputError, match="30"):
        found.at_temperature(40.0)


FLUID = {**OTHER, "modulus_inf": 0.0}
LOAD = [{"pressure": PRESSURE}]
ROLLING = {**SLIDE, "creep": 0.1}
REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "slides": ({"counterbody": OTHER}, "history.0.velocity needs an elastic counterbody"),
    "steady start": (
        {"counterbody": OTHER, "history": LOAD, "initial": {"state": "steady", "velocity": 0.2, "pressure": PRESSURE}},
        "initial needs an elastic counterbody",
    ),
    "both": ({"counterbody": OTHER, "history": LOAD, "steady": STEADY}, "steady cannot be used with a history"),
    "flows": ({"counterbody": FLUID, "history": None, "steady": STEADY}, "counterbody needs a long-term modulus"),
    "layer": ({"body": {"thickness": 1e-3, "base": "bonded"}}, "counterbody needs a half space"),
    "sticks": (
        {"counterbody": {**STIFF, "poisson": 0.3}, "interface": {"coefficient": 0.5, "stick": True}},
        "interface.stick needs counterbody.poisson of 0.5, got 0.3",
    ),
    "heat": ({"thermal": {"conductivity": 0.2, "diffusivity": 1e-7, "feedback": "none"}}, "losses in it heat it"),
    "softens": (
        {"history": None, "steady": STEADY, "softening": {"table": [[1e-3, 1.0, 1.0], [0.1, 0.5, 0.8]]}},
        "only the rubber softens",
    ),
    "yields": ({"counterbody": {**STIFF, "hardness": 1e6}}, "counterbody.hardness is a key of material"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str, tmp_path: Path) -> None:
    more, sentence = REFUSED[name]
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(data_of(**more)))
    with pytest.raises(JobError) as caught:
        load(tmp_path / "job.yaml")
    assert sentence in str(caught.value)


def test_a_curve_of_a_job_that_presses_is_refused() -> None:
    """Velocities of the command line make no steady section, for which the counterbody would have relaxed."""
    with pytest.raises(InputError, match="needs a steady section in place of its history"):
        request(job(counterbody=OTHER, history=LOAD), [0.2])
    assert request(job(history=LOAD), [0.2]).velocities == (0.2,)


def test_different_poisson_ratios_are_said() -> None:
    (doubt,) = (text for text in job(counterbody={**STIFF, "poisson": 0.3}).warnings if "counterbody" in text)
    assert "(0.5 and 0.3)" in doubt
    assert not [text for text in job().warnings if "counterbody" in text]


def test_a_rigid_counterbody_changes_nothing() -> None:
    """To rounding, which the relaxation times of the pair have."""
    surface = {"shape": "wave", "amplitude": 4e-6, "waves": [2, 0]}
    rigid, none = (
        marched(job(surface=surface, counterbody=body))[1] for body in ({**STIFF, "shear_modulus": 1e30}, None)
    )
    assert 0.05 < none[-1].measures.contact_area < 0.9
    for name in ("friction", "contact_area", "mean_gap", "max_pressure"):
        np.testing.assert_allclose(column(rigid, name), column(none, name), rtol=1e-9, atol=1e-16)  # at rest: rounding


def test_an_absent_one_is_not_called(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(found: Any) -> Any:
        raise AssertionError

    monkeypatch.setattr(CounterbodyThatDeforms, "changed_material", staticmethod(fail))
    plain = job(counterbody=None, interface={"shear_stress": 1e4})
    assert "counterbody" not in choices.choices(plain).effects
    assert plain.material is plain.material.given


def test_a_resolved_job_has_both_bodies_as_given(tmp_path: Path) -> None:
    compound = tmp_path / "compound.yaml"
    compound.write_text(yaml.safe_dump({"material": OTHER}))
    text = yaml.safe_dump(data_of(counterbody={"include": "compound", "poisson": 0.49}, history=LOAD))
    (tmp_path / "job.yaml").write_text(text)
    found = load(tmp_path / "job.yaml")
    data = yaml.safe_load(found.resolved())
    assert data["material"]["branches"] == RUBBER["branches"]
    assert (data["counterbody"]["modulus_inf"], data["counterbody"]["poisson"]) == (5e6, 0.49)
    assert str(compound) in found.included
    again = Job.model_validate(data)
    assert again == found
    np.testing.assert_array_equal(relaxation_of(again.material)[1], relaxation_of(found.material)[1])
    assert plain_job(again)["counterbody"] == data["counterbody"]


def test_moduli_of_the_pair_are_said() -> None:
    """At the frequency of the wave, 400 Hz."""
    (said,) = (fact for fact in job().facts if "both bodies as one" in fact)
    soft = moduli(2.0 * math.pi * 400.0, 1e6, 9e6, TIME)
    both = soft * 5e6 / (soft + 5e6)
    assert said.endswith(f"; {both.real:.4g} + {both.imag:.4g}i Pa at 400 Hz")
    assert len(next(iter(job(counterbody=OTHER, history=LOAD).facts)).split(" Hz")) == 4


def test_the_theory_takes_the_pair() -> None:
    """As for the one material with the moduli of the pair, G 5/(5 + G) of a spring and one branch by hand."""
    rough = {"shape": "rough", "hurst": 0.8, "long_wavelength": 2.5e-4, "short_wavelength": 1e-4, "rms_slope": 0.1}
    one = {
        "model": "zener",
        "modulus_inf": 5e6 / 6.0,
        "branches": [{"modulus": 50e6 / 15.0 - 5e6 / 6.0, "relaxation_time": TIME * 15.0 / 6.0}],
    }
    grid = {"points": 32, "size": LENGTH}
    found = (
        job(grid=grid, surface=rough, history=None, steady=STEADY, material=body, counterbody=other)
        for body, other in ((RUBBER, STIFF), (one, None))
    )
    both, alone = ([row.friction for row in prediction.predict_steady(each, request(each))] for each in found)
    assert both[0] > 0.0
    assert both == pytest.approx(alone, rel=1e-10)


def test_editors_know_its_keys() -> None:
    """The counterbody takes the forms of `material`, with `include`."""
    found = json_schema()["properties"]
    assert found["counterbody"]["anyOf"][0] == found["material"]["anyOf"][0]
    kinds = [set(re.findall(r"defs/(\w+)", str(found[name]["anyOf"][1]))) for name in BODIES]
    assert kinds[0] == kinds[1] == {"Elastic", "Zener", "Dma"}


def test_frequencies_of_a_road_in_bands() -> None:
    """Its longest wave at the lowest velocity, and its shortest one at the highest."""
    rough = {"shape": "rough", "hurst": 0.8, "long_wavelength": 1e-3, "short_wavelength": 1e-4, "rms_slope": 0.1}
    bands = {"count": 2, "points": 16}
    steady = {"velocities": [0.1, 1.0], "pressures": [PRESSURE]}
    found = frequencies(job(grid=None, bands=bands, surface=rough, history=None, steady=steady))
    assert found == pytest.approx([1e2, 1e3, 1e4])


@pytest.mark.mpi
def test_ranks_get_the_pair() -> None:
    """Friction of one wave on all ranks."""
    found = WORLD.bcast(job(history=None, steady=STEADY))
    sliding = SteadySliding(scene.set_up(found, Slab(WORLD, *found.grid.points)))
    soft = moduli(0.2 * WAVE, 1e6, 9e6, TIME)
    friction = sliding.solve((0.2, 0.0), PRESSURE).measures.friction
    assert of_surface(friction) * 1e6 == pytest.approx((soft * 5e6 / (soft + 5e6)).imag, rel=1e-6)


def test_a_relaxing_counterbody_has_its_references() -> None:
    pressed = job(material=STIFF, counterbody=OTHER, history=LOAD)
    assert references_of(plain_data(pressed)) == references_of(plain_data(job(counterbody=None, history=LOAD)))


def test_points_follow_from_the_pair() -> None:
    """As for the one material with the modulus of the pair, 1/(1/1 + 1/0.2) MPa."""
    rough = {
        "shape": "rough",
        "hurst": 0.9,
        "long_wavelength": 1.25e-4,
        "short_wavelength": 3.125e-5,
        "rms_slope": 0.02,
    }
    scene_of = {"grid": {"points": "auto", "size": 5e-4}, "surface": rough, "numerics": {"accuracy": 0.02}}
    bodies = [{"model": "elastic", "shear_modulus": modulus} for modulus in (1e6, 2e5, 1e6 / 6.0)]
    given = {"history": [{"pressure": 5e3}], **scene_of}
    both, one, hard = (
        mesh.load(data_of(material=body, counterbody=other, **given)).grid.points
        for body, other in ((bodies[0], bodies[1]), (bodies[2], None), (bodies[0], None))
    )
    assert both == one != hard
