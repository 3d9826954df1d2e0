"""Jobs with one mistake: the sentence about it, and its line and column."""

import re
from pathlib import Path

import pytest

from parcontact.job import JobError, load

SURFACE = "surface: {shape: wave, amplitude: 1e-6, waves: [1, 0]}"
MATERIAL = "material: {model: elastic, shear_modulus: 1e6}"
HISTORY = "history: [{pressure: 1e5}]"
LINES = ["grid: {points: 64, size: 1e-3}", SURFACE, MATERIAL, HISTORY]


def mistakes(path: Path, line: str) -> list[str]:
    """The mistakes in the job of LINES in which `line` replaces that of its section, or comes last."""
    section = line.split(":")[0]
    others = [line if other.split(":")[0] == section else other for other in LINES]
    path.write_text("\n".join(others if line in others else [*others, line]), encoding="utf-8")
    with pytest.raises(JobError) as caught:
        load(path)
    return caught.value.mistakes


# what a line says: the one mistake in it, without the name of the file

GRID = {
    "grid: {points: 64, size: -1.0}": "1:26: grid.size must be a positive length [m], got -1.0",
    "grid: {points: 64, size: [1, 0]}": "1:30: grid.size.1 must be a positive length [m], got 0",
    "grid: {points: 64, size: .inf}": "1:26: grid.size must be a positive length [m], got inf",
    "grid: {points: 64, size: 1 mm}": "1:26: grid.size must be a positive length [m], got '1 mm'; write 1.0e-3",
    "grid: {points: 64, size: 1 Pa}": "1:26: grid.size must be a positive length [m], got '1 Pa'",
    "grid: {points: 64, size: true}": "1:26: grid.size must be a positive length [m], got true",
    "grid: {points: 64, size: [1, 1, 1]}": "1:26: grid.size must be a positive length [m], got [1, 1, 1]",
    "grid: {points: 0, size: 1}": "1:16: grid.points must be a positive whole number of points, got 0",
    "grid: {points: 6.5, size: 1}": "1:16: grid.points must be a positive whole number of points, got 6.5",
    "grid: {points: 64}": "1:7: grid.size is missing; it must be a positive length [m]",
    "grid: {points: 64, size: }": "1:25: grid.size is missing; it must be a positive length [m]",
    "grid: {points: 64, size: 1, boundary: open}": (
        "1:39: grid.boundary must be periodic | free | [periodic, free], got 'open'"
    ),
    "grid: {pionts: 1, points: 64, size: 1}": "1:8: grid.pionts is not a known key; did you mean points?",
    "grid: {points: 64, size: 1, zz: 1}": "1:29: grid.zz is not a known key; known keys: points, size, boundary",
}

SHAPES = "rough | sphere | cylinder | cone | pyramid | punch | wave | file | array | topography | flat"
SURFACES = {
    "surface: wave": "2:10: surface must be one shape, or a list of shapes, got 'wave'",
    "surface: []": "2:10: surface needs at least one shape, such as shape: flat",
    "surface: [3]": (f"2:11: surface.0 must be a mapping with shape: {SHAPES}, got 3"),
    "surface: {radius: 1}": f"2:10: surface.shape is missing; it must be {SHAPES}",
    "surface: [{shape: spher}]": f"2:19: surface.0.shape must be {SHAPES}, got 'spher'; did you mean sphere?",
    "surface: {shape: sphere}": "2:10: surface.radius is missing; it must be a positive length [m]",
    "surface: {shape: sphere, radius: 1, axis: y}": (
        "2:37: surface.axis is not a key of shape sphere; known keys: shape, radius, profile, center"
    ),
    "load: 1.0": "5:1: load is not a known key; give it to the stages of history",
    "material: {model: elastic, E: 3.0e6}": (
        "3:28: material.E is not a key of model elastic; moduli here are shear moduli: shear_modulus is "
        "E/(2 (1 + poisson)), a third of Young's modulus E for rubber"
    ),
    "history: [{load: 1.0e5}]": (
        "4:12: history.0.load is not a known key; give a pressure [Pa], a force [N] or an approach [m]"
    ),
    "surface: {shape: sphere, radius: 1, profile: parabola}": (
        "2:46: surface.profile must be paraboloid | exact, got 'parabola'; did you mean paraboloid?"
    ),
    "surface: {shape: sphere, radius: 1, center: 0}": "2:45: surface.center must be a position [x, y] [m], got 0",
    "surface: {shape: cylinder, radius: 1, axis: z}": "2:45: surface.axis must be x | y, got 'z'",
    "surface: {shape: wave, amplitude: .nan, waves: [1, 0]}": (
        "2:35: surface.amplitude must be a finite height [m], got nan"
    ),
    "surface: {shape: wave, amplitude: 1, waves: [1, .5]}": (
        "2:49: surface.waves.1 must be two whole numbers of waves in the box, along x and along y, got 0.5"
    ),
    "surface: {shape: wave, amplitude: 1, waves: 4}": (
        "2:45: surface.waves must be two whole numbers of waves in the box, along x and along y, got 4"
    ),
    "surface: {shape: wave, amplitude: 1, waves: [32, -33]}": (
        "2:50: surface.waves.1 must be within -32 and 32 waves for 64 points (Nyquist), got -33"
    ),
    "surface: {shape: file, path: x.csv}": "2:30: surface.path must end in .npy or .h5 or .txt, got 'x.csv'",
}

MATERIALS = {
    "material:": "3:10: material is missing; it must be a mapping with model: elastic | zener | dma",
    "material: {shear_modulus: 1}": "3:11: material.model is missing; it must be elastic | zener | dma",
    "material: {model: elastc}": (
        "3:19: material.model must be elastic | zener | dma, got 'elastc'; did you mean elastic?"
    ),
    "material: {model: Prony}": "3:19: material.model must be elastic | zener | dma, got 'Prony'; did you mean zener?",
    "material: {model: elastic}": ("3:11: material.shear_modulus is missing; it must be a positive shear modulus [Pa]"),
    "material: {model: elastic, shear_modulus: 1, branches: []}": (
        "3:46: material.branches is not a key of model elastic; known keys: model, poisson, shear_modulus, hardness"
    ),
    "material: {model: elastic, shear_modulus: 1, poisson: -1}": (
        "3:55: material.poisson must be a Poisson ratio [-] above -1 and up to 0.5, got -1"
    ),
    "material: {model: zener, modulus_inf: -1}": (
        "3:39: material.modulus_inf must be a shear modulus [Pa] of zero or more, got -1"
    ),
    "material: {model: zener}": (
        "3:11: material has no stiffness: modulus_inf and all branches are zero; give one of them a modulus [Pa]"
    ),
    "material: {model: zener, branches: [{G0: 1, G1: 0, eta1: 0}, {modulus: 0, relaxation_time: 1}]}": (
        "3:11: material has no stiffness: modulus_inf and all branches are zero; give one of them a modulus [Pa]"
    ),
    "material: {model: zener, branches: 5}": "3:36: material.branches must be a list of branches, got 5",
    "material: {model: zener, branches: [{g0: 5}]}": (
        "3:37: material.branches.0 must have the keys G0, G1, eta1, modulus, relaxation_time or g, tau, got g0"
    ),
    "material: {model: zener, branches: [{G0: 1, modulus: 5}]}": (
        "3:37: material.branches.0 mixes forms of a branch: give G0, G1, eta1, modulus, "
        "relaxation_time or g, tau, got G0, modulus"
    ),
}

HISTORIES = {
    "history:": "4:9: history needs at least one stage, unless there is a steady section",
    "history: []": "4:10: history needs at least one stage, unless there is a steady section",
    "history: [{pressure: 1, velocity: {from: 0, to: 1}}]": (
        "4:35: history.0.velocity must be a velocity [m/s]: a number along x, or [vx, vy]; it does not ramp: a stage "
        "has one velocity, write several stages"
    ),
    "history: {pressure: 1}": "4:10: history must be a list of stages, got a mapping",
    "history: [1]": "4:11: history.0 must be a mapping of keys, got 1",
    "history: [{presure: 1, force: 1}]": "4:12: history.0.presure is not a known key; did you mean pressure?",
    "history: [{name: x}]": "4:11: history.0 needs exactly one of pressure | force | approach, got none",
    "history: [{pressure: 1, force: 1}]": (
        "4:11: history.0 needs exactly one of pressure | force | approach, got pressure and force"
    ),
    "history: [{pressure: -1}]": (
        "4:22: history.0.pressure must be a pressure [Pa] of zero or more, got -1; pulling needs adhesion"
    ),
    "history: [{force: -1}]": (
        "4:19: history.0.force must be a force [N] of zero or more, got -1; pulling needs adhesion"
    ),
    "history: [{approach: deep}]": "4:22: history.0.approach must be a finite approach [m], got 'deep'",
    "history: [{pressure: 0}, {force: 0}]": (
        "4:22: history.0.pressure must not be zero in every stage: there would be no contact"
    ),
    "history: [{pressure: {from: 1}, duration: 1, time_step: 1}]": (
        "4:22: history.0.pressure.to is missing; it must be a pressure [Pa] of zero or more"
    ),
    "history: [{pressure: {from: 1, to: -2}, duration: 1, time_step: 1}]": (
        "4:36: history.0.pressure.to must be a pressure [Pa] of zero or more, got -2; pulling needs adhesion"
    ),
    "history: [{pressure: {from: 1, to: 2, at: 3}, duration: 1, time_step: 1}]": (
        "4:39: history.0.pressure.at is not a known key; known keys: from, to"
    ),
    "history: [{pressure: {from: 1, to: 2}}]": (
        "4:22: history.0.pressure is a ramp, which needs a duration [s] or a distance [m]"
    ),
    "history: [{approach: {from: 0, to: 1e-6}}]": (
        "4:22: history.0.approach is a ramp, which needs a duration [s] or a distance [m], or "
        "a velocity [m/s] in its braces"
    ),
    "history: [{approach: {from: 0, to: 1e-6, velocity: 2e-6}, duration: 1}]": (
        "4:52: history.0.approach.velocity already gives the duration, 0.5 s; leave out the velocity or duration"
    ),
    "history: [{approach: {from: 0, to: 1e-6, velocity: 2e-6}, velocity: 1, distance: 1}]": (
        "4:52: history.0.approach.velocity already gives the duration, 0.5 s; leave out the velocity or distance"
    ),
    "history: [{approach: {from: 1e-6, to: 1e-6, velocity: 1}}]": (
        "4:55: history.0.approach.velocity needs different ends: a constant approach has no velocity"
    ),
    "history: [{pressure: {from: 0, to: 1, velocity: 1}, duration: 1}]": (
        "4:39: history.0.pressure.velocity is not a known key; known keys: from, to"
    ),
    "history: [{pressure: 1, velocity: 1, duration: 1, time_step: auto, cells_per_step: 1}]": (
        "4:11: history.0 takes at most one of time_step | cells_per_step, got time_step and cells_per_step"
    ),
    "history: [{pressure: 1, time_step: auto}]": (
        "4:36: history.0.time_step needs a duration [s] or a distance [m]: without them a stage is one solve"
    ),
    "history: [{pressure: 1, velocity: 1, duration: 1, time_step: 1, cells_per_step: 1}]": (
        "4:11: history.0 takes at most one of time_step | cells_per_step, got time_step and cells_per_step"
    ),
    "history: [{pressure: 1, velocity: 1, duration: 1, distance: 1, time_step: 1}]": (
        "4:11: history.0 takes at most one of duration | distance | cycles, got duration and distance"
    ),
    "history: [{pressure: 1, time_step: 1}]": (
        "4:36: history.0.time_step needs a duration [s] or a distance [m]: without them a stage is one solve"
    ),
    "history: [{pressure: 1, distance: 1, time_step: 1}]": (
        "4:35: history.0.distance needs a velocity [m/s] that is not zero"
    ),
    "history: [{pressure: 1, duration: 1, cells_per_step: 1}]": (
        "4:54: history.0.cells_per_step needs a velocity [m/s] that is not zero"
    ),
    "history: [{pressure: 1, duration: 1, time_step: {first: 1}}]": (
        "4:49: history.0.time_step.growth is missing; it must be a factor [-] of one or more"
    ),
}

OTHERS = {
    "initial: {state: steady}": "5:10: initial needs a pressure [Pa] for the steady state to start from",
    "initial: {velocity: 1}": (
        "5:10: initial.state must be steady if velocity or pressure is given: a virgin body has no history"
    ),
    "initial: {state: stedy, pressure: 1}": (
        "5:18: initial.state must be virgin | steady, got 'stedy'; did you mean steady?"
    ),
    "numerics: {tolerance: 1}": "5:23: numerics.tolerance must be a tolerance [-] above 0 and below 1, got 1",
    "numerics: {branch_error: -1}": (
        "5:26: numerics.branch_error must be an error of friction [-] of zero or more and below 1, got -1"
    ),
    "numerics: {max_iterations: 0}": (
        "5:28: numerics.max_iterations must be a positive whole number of iterations, got 0"
    ),
    "numerics: {integrator: backward_euler}": (
        "5:24: numerics.integrator must be exponential | exponential-linear | backward-euler, got "
        "'backward_euler'; did you mean backward-euler?"
    ),
    "output: {fields: [gap, presure]}": (
        "5:24: output.fields.1 must be pressure | displacement | gap | height | fluid_pressure | traction | "
        "temperature, got 'presure'; "
        "did you mean pressure?"
    ),
    "output: {fields: [gap, gap]}": "5:24: output.fields.1 repeats gap",
    "output: {every: 0}": "5:17: output.every must be a positive whole number of steps, got 0",
    "output: {directory: 3}": "5:21: output.directory must be the path of a directory (text), got 3",
    "numerics: {slope: spectral}": (
        "5:12: numerics.slope is not a known key; it was removed; slopes follow from the waves of the surface"
    ),
    "output: {mesh_check: true}": (
        "5:10: output.mesh_check is not a known key; it was removed; `parcontact study` measures the error of the "
        "mesh, with a list study.mesh"
    ),
    "output: {branch_dissipation: true}": "5:30: output.branch_dissipation needs energy: true",
    "checkpoint: {minutes: 10 s}": "5:23: checkpoint.minutes must be a positive wall time in minutes [min], got '10 s'",
    "checkpoint: {every: 1, minutes: 1}": (
        "5:13: checkpoint takes at most one of every | minutes, got every and minutes"
    ),
    "checkpoint: {keep: -1}": "5:20: checkpoint.keep must be a whole number of checkpoints, zero or more, got -1",
    "steady: {velocities: '1:2'}": (
        "5:22: steady.velocities must be numbers or a range first:last:count like 1e-3:1e2:31, got '1:2'"
    ),
    "steady: {velocities: 0:2:3}": (
        "5:22: steady.velocities must be a range first:last:count with first and last positive, got '0:2:3'"
    ),
    "steady: {velocities: [1, -2]}": (
        "5:26: steady.velocities.1 must be positive speeds [m/s]: a list, or first:last:count, got -2"
    ),
    "steady: {velocities: 1, direction: [0, 0]}": (
        "5:36: steady.direction must not be zero in both components, got [0, 0]"
    ),
    "titel: x": "5:1: titel is not a known key; did you mean title?",
    "title: 2024": "5:8: title must be text (put numbers in quotes), got 2024",
}


@pytest.mark.parametrize(("line", "mistake"), (GRID | SURFACES | MATERIALS | HISTORIES | OTHERS).items())
def test_one_mistake(tmp_path: Path, line: str, mistake: str) -> None:
    path = tmp_path / "rough.yaml"
    assert mistakes(path, line) == [f"{path}:{mistake}"]


LISTS = """\
grid: {points: [32, 16], size: [1e-3, 5e-4]}
surface: [{shape: wave, amplitude: 1e-6, waves: [4, 0]}, {shape: sphere, radius: 1e-2, center: [5e-4, 2e-4]}]
material: {model: zener, modulus_inf: 1e6, branches: [{modulus: 1e6, relaxation_time: 1.0}], band: [1e-2, 1e6],
  temperatures: [-20, 60], shift: {law: factors, temperatures: [0, 20, 40], logs: [1.9, 0, -1.1], reference: 20}}
initial: {state: steady, velocity: [0.01, 0.0], pressure: 1e4}
steady: {velocities: [0.1, 1.0], pressures: [1e4, 2e4], temperatures: [0, 20]}
history: [{pressure: {from: 1e4, to: 2e4}, velocity: [0.1, 0.0], distance: 1e-4, cells_per_step: 1}]
output: {fields: [pressure, gap], directory: out}
study: {mesh: [16, 32], cells_per_step: [1, 0.5], integrator: [exponential, backward-euler]}
"""


def test_an_empty_place_in_any_list_is_a_sentence(tmp_path: Path) -> None:
    """Each item of each list is once left empty: its place is named, whatever rules hold for the whole list."""
    (tmp_path / "job.yaml").write_text(LISTS)
    load(tmp_path / "job.yaml")
    places = [item.span() for item in re.finditer(r"(?<=[\[ ])(?<!: )[\w.+-]+(?=[,\]])", LISTS)]
    assert len(places) > 30
    for start, end in places:
        (tmp_path / "job.yaml").write_text(f"{LISTS[:start]}null{LISTS[end:]}")
        with pytest.raises(JobError, match="got nothing"):
            load(tmp_path / "job.yaml")
