"""Jobs that are right: the contract's own example, short forms, defaults, round trips."""

from pathlib import Path
from typing import Any

import pytest

from parcontact.errors import InputError
from parcontact.job import Elastic, JobError, Ramp, Stage, describe_job, listing, load
from parcontact.job.reading import shown_job

from .texts import SMALL, job_of, mistakes_of, replaced

CONTRACT = """
title: Rubber pressed on a road, then sliding      # free text
grid:
  points: [1024, 1024]          # nx, ny; one number means both
  size: [1.0e-3, 1.0e-3]        # Lx, Ly [m]
  boundary: periodic            # periodic (default) | free (zero padded, isolated contact)
surface:                        # one mapping, or a list whose heights add up
  - {shape: rough, hurst: 0.9, long_wavelength: 2.5e-4, rolloff_wavelength: 2.5e-4, short_wavelength: 7.8125e-6,
     rms_slope: 0.02, seed: 1}  # exactly one of rms_slope | rms_height | psd_constant [m^4]
  - {shape: sphere, radius: 1.0e-2, profile: paraboloid}   # or exact; center: [x, y] defaults to the middle
  - {shape: cylinder, radius: 1.0e-2, axis: y}
  - {shape: wave, amplitude: 5.0e-7, waves: [4, 0], phase: 0.0}   # A cos(2 pi (wx x/Lx + wy y/Ly) + phase)
  - {shape: file, path: road.npy, scale: 1.0e-6}           # also .h5 (dataset: name) and .txt
  - {shape: flat}
material:
  model: zener                  # elastic | zener
  poisson: 0.5
  modulus_inf: 1.0e6            # zener: the extra parallel spring G_inf of Eq. (8) [Pa]; 0 allowed
  branches:                     # zener: either form, may be mixed
    - {G0: 2.75e6, G1: 3.0556e5, eta1: 3055.6}             # the paper's spring in series with Kelvin
    - {modulus: 2.475e6, relaxation_time: 1.0e-3}          # Prony: modulus * exp(-t / relaxation_time)
initial: {state: virgin}        # virgin (default) | {state: steady, velocity: 0.01, pressure: 1.0e5}
history:                        # stages, run in order
  - {name: press, pressure: 1.0e5, duration: 1.0e-3, time_step: {first: 1.0e-7, growth: 1.2}}
  - {name: slide, pressure: 1.0e5, velocity: 3.0, distance: 5.0e-4, cells_per_step: 1}
numerics:
  integrator: exponential       # exponential (default, 2nd order) | backward-euler (the paper's)
  tolerance: 1.0e-4             # of the certified stop
  max_iterations: 500
  kernel: spectral
  precision: double             # double | mixed
output:
  directory: out/rough          # default: out/<job file stem>
  fields: [pressure, displacement, gap]     # default: none
  every: 64                     # steps between saved fields
checkpoint: {every: 200, keep: 2}           # steps; {minutes: 10} also
"""


def test_defaults(tmp_path: Path) -> None:
    job = job_of(tmp_path, SMALL, name="small.yaml")
    assert job.path == tmp_path / "small.yaml"
    assert (job.title, job.grid.points, job.grid.size, job.grid.boundary) == ("", (64, 64), (1e-3, 1e-3), "periodic")
    assert job.surface[0].phase == 0.0
    assert job.material == Elastic(poisson=0.5, shear_modulus=1e6)
    assert (job.initial.state, job.initial.velocity, job.initial.pressure) == ("virgin", (0.0, 0.0), None)
    (stage,) = job.history
    assert (stage.name, stage.seconds, stage.velocity) == ("stage 1", 0.0, (0.0, 0.0))
    assert (job.numerics.integrator, job.numerics.tolerance, job.numerics.max_iterations) == ("exponential", 5e-3, 500)
    assert (job.numerics.kernel, job.numerics.precision) == ("spectral", "double")
    assert job.numerics.accept_unconverged is False
    assert (job.output.directory, job.output.fields, job.output.every) == (Path("out/small"), (), 1)
    assert (job.output.energy, job.output.branch_dissipation) == (False, False)
    assert (job.checkpoint.every, job.checkpoint.minutes, job.checkpoint.keep) == (None, 10.0, 2)
    assert job.steady is None


def test_free_boundary_takes_the_love_kernel(tmp_path: Path) -> None:
    assert job_of(tmp_path, SMALL, "grid.boundary=free").numerics.kernel == "love"
    assert job_of(tmp_path, SMALL, "numerics={kernel: love}").numerics.kernel == "love"


@pytest.mark.parametrize(
    ("text", "number"),
    [("1e-3", 1e-3), ("1E3", 1e3), ("+1.e-3", 1e-3), (".5e0", 0.5), ("1_000", 1e3), ("7", 7.0), ("2.", 2.0)],
)
def test_numbers(tmp_path: Path, text: str, number: float) -> None:
    assert job_of(tmp_path, SMALL, f"grid.size={text}").grid.lx == number


def test_an_empty_value_is_an_absent_key(tmp_path: Path) -> None:
    assert job_of(tmp_path, SMALL, "numerics=", "title=").numerics.tolerance == 5e-3


def test_anchors_and_merges(tmp_path: Path) -> None:
    text = SMALL.replace(
        "  - {pressure: 1e5}\n", "  - &first {pressure: 1e5}\n  - {<<: *first, name: again}\n  - *first\n"
    )
    assert [stage.name for stage in job_of(tmp_path, text).history] == ["stage 1", "again", "stage 3"]


@pytest.mark.parametrize("control", ["pressure", "force", "approach"])
def test_ramps(tmp_path: Path, control: str) -> None:
    stage = f"{{{control}: {{from: 1, to: 3}}, duration: 2, time_step: 0.5, velocity: [0, -1]}}"
    (stage_read,) = job_of(tmp_path, replaced(SMALL.split("history")[0], history=f"[{stage}]")).history
    assert (stage_read.control, stage_read.load, stage_read.load.constant) == (control, Ramp(1.0, 3.0), False)
    assert [stage_read.load.at(fraction, fraction) for fraction in (0.0, 0.5, 1.0)] == [1.0, 2.0, 3.0]
    assert (stage_read.time_step, stage_read.velocity) == (0.5, (0.0, -1.0))


def test_the_duration_of_an_approach_follows_from_its_velocity(tmp_path: Path) -> None:
    """Both ways, next to a sliding velocity, in steps that are chosen or given; |to - from| / velocity to rounding."""
    down = "{approach: {from: -1e-6, to: 2e-6, velocity: 1.5e-6}, velocity: 3.0}"
    up = "{approach: {from: 2e-6, to: -1e-6, velocity: 3e-5}, time_step: 0.01}"
    press, pull = job_of(tmp_path, replaced(SMALL.split("history")[0], history=f"[{down}, {up}]")).history
    assert (press.seconds, pull.seconds) == pytest.approx((2.0, 0.1), rel=1e-15)
    assert (press.load.start, press.load.end, press.speed) == (-1e-6, 2e-6, 3.0)
    assert press.chooses
    assert pull.time_step == 0.01
    assert "approach -1e-06 to 2e-06 m at 1.5e-06 m/s, velocity" in listing.listed_line(press)


def test_a_maxwell_fluid_is_legal(tmp_path: Path) -> None:
    job = job_of(tmp_path, replaced(SMALL, material="{model: zener, branches: [{G0: 1e6, G1: 0, eta1: .inf}]}"))
    assert job.material.modulus_inf == 0.0
    job = job_of(tmp_path, replaced(SMALL, material="{model: zener, branches: [{modulus: 1, relaxation_time: 1}]}"))
    assert job.material.long_modulus == 0.0


ROUND_TRIPS = {
    "small": SMALL,
    "contract": CONTRACT,
    "texts that look like something else": replaced(SMALL, title="'1e-3'").replace(
        "{pressure", "{name: 'no', pressure"
    ),
    "steady": replaced(SMALL, steady="{velocities: '1e-3:1e2:31', waves: true}", title='"ünïcode: [x] # 1"'),
    "energies": replaced(SMALL, output="{energy: true, branch_dissipation: true}"),
    "everything": replaced(
        SMALL.split("history")[0],
        material="{model: zener, branches: [{G0: 1e6, G1: 0, eta1: .inf}]}",
        history="[{force: {from: 0, to: 1e-2}, velocity: [1e-7, 2], distance: 1, time_step: 1e-5}, {approach: -1e-9}, "
        "{approach: {from: -1e-9, to: 3e-9, velocity: 7e-10}}]",
        initial="{state: steady, pressure: 3, velocity: 0.123456789012345678}",
        output="{fields: [gap], every: 3, directory: /somewhere/else}",
        numerics="{integrator: backward-euler, precision: mixed, accept_unconverged: true}",
        checkpoint="{keep: 5}",
    ),
}


@pytest.mark.parametrize("text", ROUND_TRIPS.values(), ids=ROUND_TRIPS.keys())
def test_resolved_round_trip(tmp_path: Path, text: str) -> None:
    (tmp_path / "road.npy").touch()
    job = job_of(tmp_path, text)
    (tmp_path / "deeper").mkdir()
    again = job_of(tmp_path / "deeper", job.resolved(), name="job.resolved.yaml")
    assert again == job
    assert hash(again) == hash(job)
    assert again.resolved() == job.resolved()
    assert again.output.directory == job.output.directory


def test_describe_has_keys_values_and_units(tmp_path: Path) -> None:
    (tmp_path / "road.npy").touch()
    assert describe_job(job_of(tmp_path, SMALL)).startswith("grid.points")  # without a title
    table = " ".join(describe_job(job_of(tmp_path, CONTRACT)).split())
    for part in (
        "grid.points [1024, 1024]", "grid.size [0.001, 0.001] m", "material.modulus_inf 1e+06 Pa", "rms_slope 0.02,",
        "G0 2.75e+06 Pa, G1 305560 Pa, eta1 3055.6 Pa s", "pressure 100000 Pa", "velocity [3, 0] m/s", "phase 0 rad",
        "time_step (first 1e-07 s, growth 1.2)", "numerics.accept_unconverged no", "cell [9.76563e-07, 9.76563e-07] m",
    ):  # fmt: skip
        assert part in table


@pytest.mark.parametrize(
    "title", ["2026-01-01", "010", "1e3", "0x1F", "yes", "~", "12:30", "a: b", "# no", "é\u2028", "=", "<<"]
)
def test_a_resolved_job_reads_back_with_any_title(tmp_path: Path, title: str) -> None:
    """By the reader of pictures, too."""
    job = job_of(tmp_path, SMALL)
    titled = job.model_copy(update={"title": title})
    path = tmp_path / "job.resolved.yaml"
    path.write_text(titled.resolved())
    assert shown_job(path).title == title


@pytest.mark.parametrize("given", ["accuracy: 0.1", "tolerance: 1.0e-3, integrator: backward-euler"])
def test_a_shown_job_has_what_its_errors_follow_from(tmp_path: Path, given: str) -> None:
    """Texts state errors by the tolerance and cycles by the accuracy; a layer has no theory of a half space."""
    job = job_of(tmp_path, f"{SMALL}numerics: {{{given}}}\nbody: {{thickness: 1.0e-3}}\n")
    path = tmp_path / "job.resolved.yaml"
    path.write_text(job.resolved().replace("numerics: {", "numerics: {slope: spectral, "))  # a key of version 0.1.0
    shown = shown_job(path)
    for name in ("accuracy", "tolerance", "integrator"):
        assert getattr(shown.numerics, name) == getattr(job.numerics, name)
    assert shown.section("body") == job.section("body")


def test_a_resolved_job_that_is_none(tmp_path: Path) -> None:
    path = tmp_path / "job.resolved.yaml"
    path.write_text("[1, 2")
    with pytest.raises(InputError, match=r"job\.resolved\.yaml is incomplete: it lacks the section checkpoint"):
        shown_job(path)


# -- sections of effects, as a job's own keys -------------------------------------------------------------------------


@pytest.mark.parametrize("section", listing.own_sections())
def test_an_empty_section_of_an_effect_is_an_absent_one(tmp_path: Path, section: str) -> None:
    assert job_of(tmp_path, SMALL + f"{section}:\n") == job_of(tmp_path, SMALL)
    with pytest.raises(InputError, match=f"zzzzzz is not a known key; known keys: .*\\b{section}\\b"):
        job_of(tmp_path, SMALL + "zzzzzz: 1\n")


# -- a job as lines to read, and as a file to run again ---------------------------------------------------------------


def test_words_have_no_unit() -> None:
    """A stage that chooses its steps says auto, and not auto s."""
    line = listing.listed_line(Stage.model_validate({"pressure": 1.0e5, "duration": 1.0}))
    assert line.endswith("duration 1 s, time_step auto")
    line = listing.listed_line(Stage.model_validate({"pressure": 1.0e5, "duration": 1.0, "time_step": 0.5}))
    assert line.endswith("time_step 0.5 s")


# -- jobs that no run could begin are mistakes, found when they are read ----------------------------------------------

FLUID = "{model: zener, modulus_inf: 0, branches: [{modulus: 1e6, relaxation_time: 1}]}"
LINE = "{points: [64, 1], size: [1e-3, 1e-5]}"
CURVE = "{velocities: [1], pressures: [1e4]}"
ROUGH = "{shape: rough, hurst: 0.8, long_wavelength: %s, short_wavelength: %s, rms_slope: 0.1}"


@pytest.mark.parametrize(
    ("key", "sections"),
    [
        ("steady", {"steady": CURVE}),
        ("steady", {"steady": CURVE, "grid": "{points: 64, size: 1e-3, boundary: free}"}),
        ("steady", {"steady": CURVE, "grid": LINE, "body": "{thickness: 1e-4}"}),
        ("steady", {"steady": CURVE.replace("{", "{direction: [0, 1], "), "grid": LINE}),
        ("initial", {"initial": "{state: steady, velocity: 1, pressure: 1}"}),
        ("initial", {"initial": "{state: steady, pressure: 1}", "grid": LINE}),
    ],
)
def test_a_body_that_flows_has_no_steady_state(key: str, sections: dict[str, str], tmp_path: Path) -> None:
    (mistake,) = mistakes_of(tmp_path, replaced(SMALL, **{"material": FLUID, **sections}))
    assert f": {key} needs a material with a long-term modulus" in mistake


def test_but_for_a_line_along_which_it_slides(tmp_path: Path) -> None:
    assert job_of(tmp_path, replaced(SMALL, material=FLUID, grid=LINE, steady=CURVE)).steady is not None


def test_energies_count_from_a_body_at_rest(tmp_path: Path) -> None:
    asked = replaced(SMALL, initial="{state: steady, pressure: 1}", output="{energy: true}")
    (mistake,) = mistakes_of(tmp_path, asked)
    assert mistake.startswith("job.yaml:2:18: output.energy needs initial: {state: virgin}")


def test_a_rough_surface_needs_a_wave(tmp_path: Path) -> None:
    """On a box of 1 mm there is none from 0.44 to 0.4 mm: (2, 1) has 0.447 mm, (2, 2) 0.354 mm."""
    (mistake,) = mistakes_of(tmp_path, replaced(SMALL, surface=ROUGH % ("4.4e-4", "4.0e-4")))
    assert mistake.startswith(
        "job.yaml:1:54: surface.long_wavelength must leave a wave of the grid down to short_wavelength"
    )
    assert job_of(tmp_path, replaced(SMALL, surface=ROUGH % ("4.5e-4", "4.0e-4"))).surface


def test_a_layer_is_in_proportion_to_its_box(tmp_path: Path) -> None:
    (mistake,) = mistakes_of(tmp_path, replaced(SMALL, body="{thickness: 1e-13}"))
    assert mistake.startswith("job.yaml:1:19: body.thickness must be at least 1e-09 of the box, 1e-12 m, got 1e-13")


# -- prony series as fractions of the modulus at a sudden strain, as finite-element programs write them ---------------

FRACTIONS = [{"g": 0.5, "tau": 1e-3}, {"g": 0.25, "tau": 1.0}]


def job_with(**material: Any) -> Any:
    data = {"grid": {"points": 4, "size": 1e-3}, "surface": {"shape": "flat"}, "history": [{"pressure": 1e5}]}
    return load({**data, "material": {"model": "zener", **material}})


def test_fractions_that_add_up_to_1_are_a_liquid() -> None:
    thirds = [{"g": share, "tau": 10.0**k} for k, share in enumerate((0.1, 0.2, 0.3, 0.4))]
    assert job_with(modulus_0=1e6, branches=thirds).material.modulus_inf == 0.0


@pytest.mark.parametrize(
    ("material", "said"),
    [
        ({"branches": FRACTIONS}, "material.modulus_0 is missing"),
        (
            {"modulus_0": 1e6, "modulus_inf": 1e5, "branches": FRACTIONS},
            "material.modulus_inf cannot be given with modulus_0",
        ),
        ({"modulus_0": 1e6, "branches": [*FRACTIONS, {"g": 0.26, "tau": 1.0}]}, "fractions g that add up to 1.01"),
        (
            {"modulus_0": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1.0}]},
            "needs branches of the form g, tau",
        ),
        ({"modulus_0": 1e6, "branches": [{"g": 0.5, "tau": 1.0, "modulus": 1e6}]}, "mixes forms of a branch"),
        ({"modulus_0": 1e6, "branches": [{"g": 1.5, "tau": 1.0}]}, "a fraction of modulus_0 .* from 0 to 1, got 1.5"),
    ],
)
def test_mistakes(material: dict[str, Any], said: str) -> None:
    with pytest.raises(JobError, match=said):
        job_with(**material)
