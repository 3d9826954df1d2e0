"""Limits of a job: rules that relate its sections, and the memory and disk space that it needs at least.

A job that breaks a rule is refused. Rules concern loads and material, surface and mesh, history and number of steps. A
job that needs more memory or disk space than this machine has gets a warning.
"""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Iterator
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import Any

from ..errors import Doubt, InputError, Kind
from .advice import SAME_LENGTH, Sections, doubt_size, has_wave, one_cell
from .calculation import FIELDS_NEED, Grid, Numerics, Output, Study
from .materials import AnyMaterial, heated
from .parts import AUTO, Rule, rules_of
from .stages import FORCE, PRESSURE, GeometricStep, Initial, Oscillation, Stage, Steady
from .surfaces import SAME_CELL, Flat, HeightArray, OnOneMesh, Rough, RoughSpectrum, Topography
from .yaml_text import Fault

LOADS = {"pressure": PRESSURE, "force": FORCE}
BY_SPECTRUM = Rough | RoughSpectrum | Flat
MOST_STEPS = 10**8  # tuning: most steps of a history; at 1 ms each they take more than a day


def kernel_fits(grid: Grid, numerics: Numerics) -> Iterator[Fault]:
    if not all(grid.cyclic) and numerics.kernel == "spectral":
        yield Fault("must be love when grid.boundary is free: the spectral kernel is periodic", ("numerics", "kernel"))


def no_strip(what: str, grid: Grid) -> Iterator[Fault]:
    """Yield an error if the box is periodic along one axis and free along the other. `what` names the part of the job
    that is not computed in such a box, such as steady sliding."""
    if any(grid.cyclic) and not all(grid.cyclic):
        yield Fault(
            f"must be periodic or free with {what}, got [periodic, free], a box for which it is not solved",
            ("grid", "boundary"),
        )


def steady_sections(initial: Initial, steady: Steady | None) -> list[str]:
    """Return the sections of a job that ask for steady sliding."""
    return ["initial"] * (initial.state == "steady") + ["steady"] * (steady is not None)


def no_steady_strip(grid: Grid, initial: Initial, steady: Steady | None) -> Iterator[Fault]:
    if steady_sections(initial, steady):
        yield from no_strip("steady sliding", grid)


def waves_are_independent(grid: Grid, steady: Steady | None) -> Iterator[Fault]:
    if steady is not None and steady.waves and grid.boundary == "free":
        yield Fault("needs a periodic box: waves in a free box are not independent", ("steady", "waves"))


def waves_fit(grid: Grid, surface: tuple[Any, ...], bands: Any) -> Iterator[Fault]:
    """Yield errors for waves shorter than two cells (Nyquist), and for a shortest wave longer than the box."""
    if bands is not None:
        return
    steps = zip((grid.dx, grid.dy), grid.size, "xy", grid.points, strict=True)
    cell, size, axis, _ = max((one for one in steps if one[-1] > 1), key=itemgetter(0), default=(0.0, 0.0, "", 0))
    for index, shape in enumerate(surface):
        if isinstance(shape, Rough) and shape.short_wavelength < 2 * cell * (1 - SAME_LENGTH):
            if large := next(doubt_size(index, shape, grid), None):
                yield Fault(f"has {large.body}", ("grid", "size"))
                continue
            needed = math.ceil(2 * size / shape.short_wavelength * (1 - SAME_LENGTH))
            got = f"got {shape.short_wavelength!r}, which needs {needed} points along {axis}"
            sentence = f"must be at least two cells, {2 * cell:.6g} m (Nyquist), {got}"
            yield Fault(sentence, ("surface", index, "short_wavelength"))
        given = isinstance(shape, Rough | RoughSpectrum | Topography) and shape.short_wavelength
        if given and given > grid.longest_side:
            sentence = f"must fit into the box of {grid.longest_side:.6g} m, got {given!r}"
            yield Fault(sentence, ("surface", index, "short_wavelength"))
        elif isinstance(shape, Rough) and not has_wave(grid, shape.short_wavelength, shape.long_wavelength):
            sentence = f"must leave a wave of the grid down to short_wavelength, {shape.short_wavelength:g} m, but has "
            yield Fault(f"{sentence}none, got {shape.long_wavelength!r}", ("surface", index, "long_wavelength"))
        for number, (waves, n) in enumerate(zip(getattr(shape, "waves", ()), grid.points, strict=False)):
            if abs(waves) > n / 2:
                sentence = f"must be within {-(n // 2)} and {n // 2} waves for {n} points (Nyquist), got {waves}"
                yield Fault(sentence, ("surface", index, "waves", number))


def constants_are_of_surfaces(grid: Grid, surface: tuple[Any, ...], bands: Any) -> Iterator[Fault]:
    """Yield an error if a roughness on one row or column of points is given by the constant [m^4] of a surface's
    spectrum."""
    points = grid.points if bands is None else getattr(bands, "points", None) or ()
    if 1 not in points:
        return
    for index, shape in enumerate(surface):
        if isinstance(shape, Rough) and shape.psd_constant is not None:
            sentence = "is the constant of a surface's spectrum [m^4], and one row of points is a profile"
            yield Fault(f"{sentence}; give rms_slope or rms_height", ("surface", index, "psd_constant"))


def bands_fit(bands: Any, surface: tuple[Any, ...], steady: Steady | None, output: Output) -> Iterator[Fault]:
    """Yield errors for bands of a surface without a spectrum, and for outputs that do not exist in bands. The first
    shape may be a measured map if a shape with a spectrum follows."""
    if bands is None:
        return
    for index, shape in enumerate(surface):
        if not isinstance(shape, BY_SPECTRUM) and not (index == 0 and isinstance(shape, Topography)) and shape:
            sentence = (
                "must be rough in a job with bands (self-affine, or a spectrum); only the first may be a topography"
            )
            yield Fault(sentence, ("surface", index, "shape"))
        if getattr(shape, "anisotropy", None) is not None:
            yield Fault("cannot be used with bands, which are isotropic", ("surface", index, "anisotropy"))
    if not any(shape is None or isinstance(shape, Rough | RoughSpectrum) for shape in surface):
        yield Fault("needs a rough shape in a job with bands, for the spectrum of the finer waves", ("surface",))
    if steady is not None and steady.waves:
        yield Fault("cannot be used with bands: bands.csv has the friction of each band", ("steady", "waves"))
    if output.fields:
        yield Fault("cannot be used with bands: no grid has all waves; leave it out", ("output", "fields"))


def study_fits(
    study: Study | None, grid: Grid, surface: tuple[Any, ...], history: tuple[Stage, ...]
) -> Iterator[Fault]:
    """Yield an error if a study has no history to compare, or if one of its meshes has no whole number of points."""
    if study is None:
        return
    if not history:
        yield Fault("compares histories: the job needs a history", ("study",))
    if study.mesh and any(isinstance(shape, OnOneMesh) for shape in surface):
        yield Fault("must be left out: the heights of a file are given on one mesh", ("study", "mesh"))
    for index, mesh in enumerate(study.mesh):
        if grid.ny > 1 and mesh * grid.ny % grid.nx:
            sentence = f"must give a whole number of points along y in a box of {grid.nx} x {grid.ny}, got {mesh}"
            yield Fault(sentence, ("study", "mesh", index))


def some_shape(surface: tuple[Any, ...]) -> Iterator[Fault]:
    if not surface:
        yield Fault("needs at least one shape, such as shape: flat", ("surface",))


def _refuse_field(name: str, output: Output) -> Iterator[Fault]:
    if name in output.fields:
        yield Fault(f"includes {name}, which needs {FIELDS_NEED[name]}", ("output", "fields"))


no_field = {name: partial(_refuse_field, name) for name in FIELDS_NEED}  # checks that effects which have a map lift


def no_rolling(history: tuple[Stage | None, ...]) -> Iterator[Fault]:
    """Yield an error for rolling, unless an effect of the job lifts this rule."""
    for index, stage in enumerate(history):
        if stage is not None and stage.rolls:
            sentence = "needs interface: {stick: true}: without it all that touches slides"
            yield Fault(sentence, ("history", index, "creep"))


def some_history(history: tuple[Any, ...], steady: Steady | None) -> Iterator[Fault]:
    if not history and steady is None:
        yield Fault("needs at least one stage, unless there is a steady section", ("history",))
    known = steady is None or steady.pressures is not None or None in history
    if not known and not any(stage.control != "approach" and stage.load.highest > 0.0 for stage in history):
        sentence = "is missing; it must be positive pressures [Pa] when no stage of the history has a pressure or force"
        yield Fault(sentence, ("steady", "pressures"))


def some_load(history: tuple[Any, ...], initial: Initial) -> Iterator[Fault]:
    if not history or None in history or initial.pressure or any(stage.approach for stage in history):
        return
    if not any(stage.load.lowest or stage.load.highest for stage in history):
        yield Fault("must not be zero in every stage: there would be no contact", ("history", 0, history[0].control))


def loads_press(history: tuple[Stage | None, ...]) -> Iterator[Fault]:
    """Yield an error for a tensile load, unless an effect of the job lifts this rule."""
    for index, stage in enumerate(history):
        if stage is None or stage.control == "approach":
            continue
        load, ends = stage.load, tuple[str, ...]()
        if load.lowest >= 0.0:
            continue
        if isinstance(load, Oscillation):
            got = f"must be at most the mean, {load.mean:g}, got {load.amplitude:g}"
            ends = ("amplitude",)
        else:
            got = f"must be {LOADS[stage.control]}, got {load.lowest:g}"
            ends = () if load.constant else ("from" if load.start == load.lowest else "to",)
        yield Fault(f"{got}; pulling needs adhesion", ("history", index, stage.control, *ends))


def temperatures_are_reached(material: AnyMaterial, steady: Steady | None) -> Iterator[Fault]:
    """Yield an error if the shift of the material is not defined at a temperature of steady states."""
    for temperature in (steady.temperatures if steady else None) or ():
        try:
            heated(material, temperature)
        except InputError as error:
            yield Fault(f"has {temperature:g} C: {error}", ("steady", "temperatures"))
            return


def steady_bodies_do_not_flow(
    grid: Grid, material: AnyMaterial, initial: Initial, steady: Steady | None
) -> Iterator[Fault]:
    """Yield an error for steady sliding of a half space without long-term modulus.

    Such a body flows under waves that do not vary along the sliding direction. It has a steady state only in a periodic
    box of one row of points along this direction.
    """
    line = grid.boundary != "free" and min(grid.points) == 1
    yield from refuse_flow(material, initial, steady, grid.points if line else ())


def refuse_flow(
    material: AnyMaterial, initial: Initial, steady: Steady | None, line: tuple[int, ...] = ()
) -> Iterator[Fault]:
    """Yield an error for steady sliding of a body without long-term modulus, since such a body flows.

    It does not flow on a grid with one row of points along the sliding direction. The numbers of points (nx, ny) of
    such a grid are given as `line`, which is () for all other grids.
    """
    if material.fitted.long_modulus > 0.0:
        return
    for key in steady_sections(initial, steady):
        velocity = initial.velocity if key == "initial" or steady is None else steady.unit_direction
        if not any(n > 1 and part != 0.0 for n, part in zip(line, velocity, strict=False)):
            sentence = "needs a material with a long-term modulus: this one flows as long as it is pressed"
            yield Fault(f"{sentence}; give it modulus_inf > 0, or slide in a stage of the history", (key,))


def energies_are_of_steps(history: tuple[Stage, ...], output: Output) -> Iterator[Fault]:
    """Yield an error if a job with energies has no history."""
    if output.energy and not history:
        yield Fault("needs a history: a friction curve has no work and no stored energy", ("output", "energy"))


def energies_count_from_rest(initial: Initial, output: Output) -> Iterator[Fault]:
    if initial.state == "steady" and output.energy:
        yield Fault("needs initial: {state: virgin}: energies start from a body at rest", ("output", "energy"))


def arrays_fit(grid: Grid, surface: tuple[Any, ...]) -> Iterator[Fault]:
    """Yield an error if an array of heights does not have the shape of the grid, or if its coordinates are not spaced
    like the cells of the grid."""
    for index, shape in enumerate(surface):
        if not isinstance(shape, HeightArray):
            continue
        heights, place = shape.heights, ("surface", index, "heights")
        if heights.shape != (grid.ny, grid.nx):
            yield Fault(f"has shape {heights.shape}, but the grid has (ny, nx) = {grid.ny, grid.nx}", place)
            continue
        for axis, spacing, cell in zip("xy", heights.cell, (grid.dx, grid.dy), strict=True):
            if abs(spacing - cell) > SAME_CELL * cell:
                sentence = f"has a spacing of {spacing:.6g} m along {axis}, but cells of the grid are {cell:.6g} m"
                yield Fault(sentence, place)


def loads_are_borne(
    grid: Grid,
    material: AnyMaterial,
    history: tuple[Stage | None, ...],
    initial: Initial,
    steady: Steady | None,
    bands: Any,
) -> Iterator[Fault]:
    """Yield errors for mean pressures that reach the hardness of the material, and for bands or steady sliding of a
    material with a hardness."""
    hardness = material.hardness
    if hardness is None:
        return
    if bands is not None:
        sentence = (
            "cannot be used with bands: finer bands have no largest pressure; leave it out, or give the job a grid"
        )
        yield Fault(sentence, ("material", "hardness"))
        return
    for key in steady_sections(initial, steady):
        sentence = "cannot be used with material.hardness: steady sliding is solved without a largest pressure"
        yield Fault(f"{sentence}; slide into the steady state with a stage", (key,))
    for index, stage in enumerate(history):
        if stage is None or stage.control == "approach":
            continue
        mean = stage.load.highest / (grid.lx * grid.ly if stage.control == "force" else 1.0)
        if mean >= hardness:
            sentence = f"leads to a mean pressure of {mean:.4g} Pa; it must be below material.hardness, {hardness:g} Pa"
            yield Fault(sentence, ("history", index, stage.control))


def refuse_steady(section: str) -> Rule:
    """Return the rule that a job with the `section` cannot ask for steady sliding, as the effect of this section has a
    contact law of its own."""

    def check(_: Any, initial: Initial, steady: Steady | None) -> Iterator[Fault]:
        for key in steady_sections(initial, steady):
            sentence = f"cannot be used with {section}: steady sliding is solved without its contact law"
            yield Fault(f"{sentence}; slide into the steady state with a stage of the history", (key,))

    return Rule((section, "initial", "steady"), check)


def refuse_bands_over_time(section: str) -> Rule:
    """Return the rule that a job with the `section` cannot have both bands and a history."""

    def check(_: Any, bands: Any, history: tuple[Stage | None, ...]) -> Iterator[Fault]:
        if bands is not None and history:
            yield Fault(
                "cannot be used with bands and a history: give bands a steady section, or the history a grid",
                (section,),
            )

    return Rule((section, "bands", "history"), check)


def steps_can_be_made(grid: Grid, history: tuple[Stage | None, ...]) -> Iterator[Fault]:
    """Yield an error if the history has more than MOST_STEPS steps."""
    total = 0.0
    for index, stage in enumerate(history):
        if stage is None:
            return
        total += estimate_steps(stage, grid)
        if total > MOST_STEPS:
            key = "cells_per_step" if stage.cells_per_step is not None else "time_step"
            yield Fault(f"leads to {total:.3g} steps; a history has at most {MOST_STEPS:.0e}", ("history", index, key))
            return


def count_steps(grid: Grid, history: tuple[Stage, ...]) -> int:
    """Return the estimated number of steps with a duration in a history."""
    return math.ceil(sum(estimate_steps(stage, grid) for stage in history))


def first_step(stage: Stage, grid: Grid) -> float:
    """Return the first time step [s] of a stage with a duration, before steps are fitted to its end."""
    if stage.cells_per_step is not None:
        return stage.cells_per_step * one_cell(stage, grid)
    if isinstance(stage.time_step, GeometricStep):
        return stage.time_step.first
    if stage.time_step == AUTO:
        return one_cell(stage, grid) if stage.speed else stage.seconds
    return stage.time_step or 0.0


def estimate_steps(stage: Stage, grid: Grid) -> float:
    """Return the estimated number of steps of a stage, or 0 if the stage has no duration."""
    if not stage.seconds:
        return 0.0
    first = first_step(stage, grid)
    count = stage.seconds / first if first else math.inf
    growth = stage.time_step.growth if isinstance(stage.time_step, GeometricStep) else 1.0
    return count if growth == 1.0 else min(count, math.log1p(count * (growth - 1.0)) / math.log(growth))


RULES = rules_of(
    kernel_fits,
    no_steady_strip,
    waves_are_independent,
    some_shape,
    waves_fit,
    constants_are_of_surfaces,
    arrays_fit,
    some_history,
    some_load,
    loads_press,
    steady_bodies_do_not_flow,
    energies_count_from_rest,
    energies_are_of_steps,
    loads_are_borne,
    temperatures_are_reached,
    steps_can_be_made,
    no_rolling,
    bands_fit,
    study_fits,
)


# -- memory and disk ---------------------------------------------------------------------------------------------------


MAPS, MAPS_FREE = 9.0, 18.0  # tuning: least memory of a periodic and of a free run [8 bytes per point]
GIGA = 1e9
CGROUP = Path("/sys/fs/cgroup/memory.max")


WARN_DISK = Kind(
    "disk",
    "{instants:.4g} instants need {needed:.3g} GB, but {directory} has {free:.3g} GB left; use an output.every "
    "above {every}, or fewer fields",
)


def doubt_needs(job: Sections) -> Iterator[Doubt]:
    """Yield warnings about memory and disk."""
    grid, output = job.grid, job.output
    yield from doubt_memory(grid)
    if output.fields:
        count = count_steps(grid, job.history)
        saved = -(-count // output.every)
        needed, free = float(saved) * len(output.maps) * grid.nx * grid.ny * 8, _free(output.directory)
        if needed > free:
            disk = {"needed": needed / GIGA, "free": free / GIGA, "directory": str(output.directory)}
            yield WARN_DISK("output.fields", {"instants": saved, "every": output.every, **disk})


WARN_MEMORY = Kind(
    "memory",
    "{nx} x {ny} points need at least {needed:.3g} GB of memory on all ranks together, but {machines} {has:.3g} "
    "GB; use fewer points, or {count} such machines",
)


def doubt_memory(grid: Grid) -> Iterator[Doubt]:
    """Yield a warning if the grid does not fit into the memory of all machines on which this program runs."""
    needed = (MAPS if all(grid.cyclic) else MAPS_FREE) * 8.0 * grid.nx * grid.ny
    each, count = _memory(), machines()
    if needed > each * count:
        have = "this machine has" if count == 1 else f"{count} such machines have"
        numbers = {"nx": grid.nx, "ny": grid.ny, "needed": needed / GIGA, "has": each * count / GIGA}
        yield WARN_MEMORY("grid.points", {**numbers, "machines": have, "count": int(needed / each) + 1})


def machines() -> int:
    """Return the number of machines on which this program runs, from the environment variables of its launcher."""

    def number(name: str) -> int:
        text = os.environ.get(name, "")
        return int(text) if text.isdecimal() else 0

    ranks, here = number("OMPI_COMM_WORLD_SIZE"), number("OMPI_COMM_WORLD_LOCAL_SIZE")
    return max(1, number("SLURM_JOB_NUM_NODES"), -(-ranks // here) if here else 1)


def _memory() -> float:
    """Return the memory of this machine, or the limit of this program's control group [bytes]."""
    whole = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    try:
        return min(whole, float(CGROUP.read_text()))
    except (OSError, ValueError):  # no such limit
        return whole


def _free(directory: Path) -> float:
    """Return the free disk space [bytes] of the directory, or of its nearest existing parent."""
    for place in (directory.absolute(), *directory.absolute().parents):
        try:
            return float(shutil.disk_usage(place).free)
        except OSError:
            continue
    return float("inf")
