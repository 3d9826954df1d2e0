"""The effect of heat: columns, map and memory of the temperatures below the contact (`effects.heat.solver`)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import DTypeLike
from pydantic import Field

from ...columns import added_by
from ...errors import InputError, RunError
from ...job import Grid, limits
from ...job.history import Timeline
from ...job.listing import effects_of
from ...job.parts import Part, Positive, Rule, rules_of
from ...job.yaml_text import Fault
from ...parallel import fft
from ...parallel.fft import Spectrum
from ...parallel.slab import Array
from ...physics.prony import Exponentials, fit_exponentials
from ...physics.records import Entry, Saved, Units
from ..branches import factor_at, temperature_of
from ..effect import Changes, Decision, Effect, Instant
from . import ERROR
from .solver import Conductor, Depths, Heating, HeatMemory, depths_of

LOOSEST, SHARE = 1e-3, 0.1  # accuracy: error of the memory of heat: at most, and as a share of the job's accuracy
DECAYED = 10.0  # accuracy: duration of the memory of heat over the diffusion time of the longest wave


def _shifts(thermal: Thermal, material: Any) -> Iterator[Fault]:
    if thermal.feedback != "none" and math.isnan(temperature_of(material)):
        yield Fault(
            "needs a material whose relaxation times depend on temperature: give material a shift, or feedback: none",
            ("thermal", "feedback"),
        )


def _no_warm_start(thermal: Thermal, initial: Any) -> Iterator[Fault]:
    if thermal.feedback != "none" and initial.state == "steady":
        sentence = "cannot be used with thermal.feedback: the steady state would be that of cold rubber"
        yield Fault(f"{sentence}; slide into the steady state with a stage", ("initial",))


def _in_curves(thermal: Thermal, history: Any, grid: Grid, bands: Any) -> Iterator[Fault]:
    if thermal.counterbody is None:
        return
    if bands is not None:
        sentence = "cannot be used with bands, whose heat all goes into the rubber; leave it out"
        yield Fault(sentence, ("thermal", "counterbody"))
    if history:
        yield Fault(
            "is for friction curves: leave out the history, or the counterbody, and all heat goes into the rubber",
            ("thermal", "counterbody"),
        )
    if grid.boundary == "free":
        sentence = "needs grid.boundary: periodic: the share of heat is solved for in a box that repeats"
        yield Fault(sentence, ("thermal", "counterbody"))


def _no_strip_of_heat(thermal: Thermal, grid: Grid) -> Iterator[Fault]:
    return limits.no_strip("thermal", grid)


class Counterbody(Part):
    """The section `thermal.counterbody`: the rigid body conducts a part of the heat of the interface."""

    label: ClassVar[str] = "counterbody"
    conductivity: Positive = Field(description="a positive conductivity of the rigid body [W/(m K)]")
    diffusivity: Positive = Field(description="a positive thermal diffusivity of the rigid body [m^2/s]")

    @property
    def conductor(self) -> Conductor:
        """The rigid body as a conductor of heat."""
        return Conductor(self.conductivity, self.diffusivity)


class Thermal(Part):
    """The `thermal` section: conduction of heat in the rubber, and whether warm rubber relaxes faster."""

    label: ClassVar[str] = "thermal"
    conductivity: Positive = Field(description="a positive conductivity of the rubber [W/(m K)]")
    diffusivity: Positive = Field(description="a positive thermal diffusivity of the rubber [m^2/s]")
    feedback: Literal["none", "mean"] = "none"
    distance: Positive | None = Field(default=None, description="a positive distance [m]")
    counterbody: Counterbody | None = Field(default=None, description="a mapping with conductivity and diffusivity")

    @property
    def conductor(self) -> Conductor:
        """The rubber as a conductor of heat."""
        return Conductor(self.conductivity, self.diffusivity)

    def sliding_time(self, grid: Grid, speed: float) -> float:
        """Return the time [s] for which sliding at a `speed` [m/s] has warmed the rubber. The rubber has slid over the
        distance of the key `distance`. Without this key it has slid over the length of a periodic box, or for an
        infinite time in a free box."""
        free = grid.boundary == "free"
        return (self.distance or (math.inf if free else max(grid.size))) / speed


def exponentials_of(job: Any) -> Exponentials:
    """Return the sum of exponentials that describes the conduction of heat in the rubber of a job. The sum is accurate
    for times from the shortest sliding step to DECAYED diffusion times of the longest wave in the box."""
    body = job.section("thermal").conductor
    longest = DECAYED / (body.diffusivity * (2.0 * np.pi / max(job.grid.size)) ** 2)
    steps, slides = [longest / 10.0], False
    for span in Timeline.from_job(job).spans:
        slides = slides or span.moves
        if slides and span.count:
            steps += span.extremes
    return fit_exponentials(
        min(step for step in steps if step > 0.0), longest, min(LOOSEST, SHARE * job.numerics.asked.strictest)
    )


@dataclass(frozen=True)
class ThermalMemory:
    """Memory of heat after a step.

    `heat` holds the waves of temperature, and `rise` is the map of the temperature rise of the surface [K]. `flash` is
    the flash temperature and `highest` the highest rise of the surface [K]. `force` [N] is the tangential force due to
    the body, and `area` the contact area, both at the end of the step. `warmed` is True if heat has ever been released.
    The body released the fraction `share` of the last heat, at the depths `depths`; the surface released the rest.
    `error` is the relative error of friction, infinite if it is unknown.
    """

    heat: HeatMemory
    rise: Array
    flash: float = 0.0
    highest: float = 0.0
    force: tuple[float, float] = (0.0, 0.0)
    area: float = 0.0
    warmed: bool = False
    depths: Depths = field(default_factory=lambda: Depths(np.zeros(0), np.zeros(0)))
    share: float = 0.0
    error: float = math.inf


def _rubs(job: Any) -> bool:
    """Return True if any effect shears the contact area, so that heat is released on the surface."""
    effects = effects_of(type(job).model_fields).values()
    shears = (effect.shear(job) is not None for effect in effects if effect.decide(job).on)
    return any(shears) or job.sheared_first


def _pulls(job: Any) -> bool:
    """Return True if an effect lets surfaces pull each other."""
    return any(limits.loads_press in lifted for lifted in job.asked("lifts"))


def feeds_back(job: Any) -> bool:
    """Return True if the heat of sliding changes the relaxation times of a job's material."""
    return bool(job.section("thermal").feedback != "none")


class ThermalColumns(Effect[ThermalMemory]):
    """The effect of heat. It has three columns: the flash temperature [K], the highest temperature rise of the surface
    [K], and the relative error of the flash temperature. The flash temperature is the mean temperature rise of the
    contact, weighted by heat.

    At rest the weights are those of the last sliding.
    """

    section: ClassVar[type[Part]] = Thermal
    columns: ClassVar[tuple[str, ...]] = added_by("thermal")
    in_curves: ClassVar[bool] = True
    fields: ClassVar[tuple[str, ...]] = ("temperature",)
    rules: ClassVar[tuple[Rule, ...]] = rules_of(_shifts, _no_warm_start, _in_curves, _no_strip_of_heat)
    lifts: ClassVar[tuple[Any, ...]] = (limits.no_field["temperature"],)

    @staticmethod
    def decide(job: Any) -> Decision:
        section: Thermal | None = job.section("thermal")
        if section is None:
            return Decision("thermal", False, "there is no thermal section")
        why = f"feedback is {section.feedback}"
        return Decision("thermal", True, f"{why}; {exponentials_of(job).kept} exponentials" if job.history else why)

    @staticmethod
    def curve_options(job: Any) -> Iterator[str]:
        """Yield the options of a job for which friction curves have further columns (`Column.when`): `thermal`, and
        `feedback` if warm rubber relaxes faster."""
        yield from ("thermal", *["feedback"] * feeds_back(job))

    @staticmethod
    def why_not_folded(job: Any) -> str:
        """Return the reason why all branches of the material must have maps; '' if there is none."""
        return "heat changes them" if feeds_back(job) else ""

    @staticmethod
    def facts(job: Any) -> Iterator[str]:
        """Yield a sentence on the distance of steady sliding if the job gives no distance."""
        if job.section("thermal").distance is None:
            free = job.grid.boundary == "free"
            way = "without end" if free else f"{max(job.grid.size):g} m, the longer side of the box, since it was cold"
            way = "the box of the coarsest band, since it was cold" if job.bands is not None else way
            yield f"thermal.distance is not given: in friction curves the rubber has slid {way}"

    @staticmethod
    def maps(job: Any) -> Sequence[DTypeLike]:
        """Return the types of the maps in a checkpoint: the map of temperatures, and the maps into which spectra are
        packed."""
        count = 2 + exponentials_of(job).kept
        return [np.float64] * (count + _rubs(job) + math.ceil(count / fft.per_map(job.grid.nx)))

    def __init__(self, scene: Any) -> None:
        self._setup, self._slab, self._job = scene.setup, scene.slab, scene.job
        self._feeds_back = feeds_back(scene.job)
        self._rubs, self._pulled = _rubs(scene.job), _pulls(scene.job)

    def at_rest(self) -> ThermalMemory:
        job, fft = self._job, self._setup.fft
        body = job.section("thermal").conductor
        heat = HeatMemory(fft, job.grid.size, body, exponentials_of(job), self._rubs)
        return ThermalMemory(heat, self._slab.zeros())

    def follow(self, instant: Instant, memory: ThermalMemory) -> Changes[ThermalMemory]:
        """Return the memory of heat and temperatures after a step, with what else the step changes. The waves of heat
        and the map of temperatures are changed in place."""
        step, pressure = instant.step, instant.pressure
        if self._pulled:
            pressure = np.maximum(pressure, 0.0)
        rubbed = np.where(instant.touching, 1.0, 0.0) if self._rubs else None
        if instant.sheared is not None:
            rubbed = instant.sheared.slipping
        sums = [0.0 if one is None else float(one.sum(dtype=np.float64)) for one in (rubbed, pressure)]
        of_rubbed, of_pressure = (self._slab.points / one if one > 0.0 else 0.0 for one in self._slab.sum(*sums))
        scales = of_rubbed, of_pressure
        begins = any(step.velocity) and not memory.warmed
        now = replace(memory, warmed=memory.warmed or begins)
        heating, now = self._heat(instant, now)
        if begins or (now.warmed and not step.dt):
            now.heat.set_heating(rubbed, pressure, scales)
        if now.warmed and step.dt:
            pressed = self._setup.fft.forward(pressure)
            if any(step.velocity):
                setup, share = self._setup, heating.pressed[1] / (heating.whole[1] or 1.0)
                times = setup.prony.relaxation_times * self.time_factor(memory)
                at = setup.half_space, setup.units.length, step.velocity, setup.prony._replace(relaxation_times=times)
                now = replace(now, share=share, error=instant.error_friction, depths=depths_of(pressed, setup.fft, *at))
            heating = replace(heating, depths=now.depths)
            inside = now.heat.advance(step.dt, heating, rubbed, pressed, scales, now.rise)
            outside = 0.0 if rubbed is None else float((now.rise * rubbed).sum()) * scales[0] / self._slab.points
            outside, highest = self._slab.reduce([outside], [float(now.rise.max(initial=-math.inf))])
            now = replace(now, flash=now.share * inside + (1.0 - now.share) * outside, highest=highest)
        return Changes(now)

    def time_factor(self, memory: ThermalMemory) -> float:
        """Return the relaxation times at the flash temperature, divided by the job's relaxation times; 1 without
        feedback. Raises RunError outside the range of the material's shift."""
        if not (self._feeds_back and memory.warmed):
            return 1.0
        try:
            return factor_at(self._job.material, memory.flash)
        except InputError as error:
            raise RunError(f"the flash temperature is outside the range of the material's shift: {error}") from None

    def _heat(self, instant: Instant, memory: ThermalMemory) -> tuple[Heating, ThermalMemory]:
        """Return the heat of a step, from the forces before and after it, and the memory with the force and area after
        it."""
        measures, velocity, sheared = instant.measures, instant.step.velocity, instant.sheared
        speed, box = math.hypot(*velocity), self._setup.grid.lx * self._setup.grid.ly
        own = measures.force_interface
        along = tuple(own * each / (speed or 1.0) for each in velocity)
        force = measures.force_x + along[0], measures.force_y + along[1]
        pressed = tuple(max(0.0, -float(np.dot(each, velocity))) / box for each in (memory.force, force))
        share = memory.area / measures.contact_area if measures.contact_area > 0.0 else 0.0
        rubbed = own * speed / box * (share if memory.warmed else 1.0), own * speed / box
        if sheared is not None:
            mean = sheared.lost / (box * instant.step.dt) if instant.step.dt else 0.0
            rubbed = mean, mean
        return Heating(rubbed, pressed), replace(memory, force=force, area=measures.contact_area)

    def values(self, memory: ThermalMemory) -> Sequence[float]:
        """Return the flash temperature [K], the highest rise [K], and the relative error of the flash temperature. This
        error is ERROR times the error of friction, NaN if that error is unknown."""
        known = memory.flash != 0.0 and math.isfinite(memory.error)
        return memory.flash, memory.highest, ERROR * memory.error if known else math.nan

    def field(self, memory: ThermalMemory, name: str) -> Array:
        """Return this rank's rows of the map of temperature rises [K]."""
        return memory.rise.copy()

    # -- checkpoints --------------------------------------------------------------------------------------------------

    def entries(self, memory: ThermalMemory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries; collective. Each spectrum is saved as a map. A spectrum has more columns than
        a map, so that further maps have the other columns."""
        known, depths = memory.heat.sum, memory.depths
        found = {
            "rise": Entry(memory.rise, 1.0, "K"),
            "mean": Entry(memory.heat.mean.waves, 1.0, "J/m^2"),
            "flash temperature": Entry(memory.flash, 1.0, "K"),
            "highest temperature": Entry(memory.highest, 1.0, "K"),
            "force": Entry(np.array(memory.force), 1.0, "N"),
            "is warmed": Entry(float(memory.warmed)),
            "contact area": Entry(memory.area),
            "share of the body": Entry(memory.share),
            "error of friction": Entry(memory.error, optional=True),
            "depths": Entry(np.concatenate([depths.wavenumbers, depths.shares])),
            "grid": Entry(np.array([known.first, known.spacing]), given=True),
        }
        per = fft.per_map(self._slab.nx)
        columns = fft.edges(self._slab.nx)
        for number, name, spectrum in self._spectra(memory):
            rest = found.setdefault(f"edges {number // per}", Entry(np.zeros(self._slab.shape), optional=True))
            where, field = columns * (number % per), np.empty(self._slab.shape)
            fft.to_map(self._setup.fft, spectrum, field, np.asarray(rest.value)[:, where : where + columns])
            found[name] = Entry(field, optional=True)
        return found

    def _spectra(self, memory: ThermalMemory) -> Iterator[tuple[int, str, Spectrum]]:
        """Yield all spectra with a number and a name; additional waves along the depth come last."""
        yield 0, "pressed", memory.heat.pressed
        if self._rubs:
            yield 1, "rubbed", memory.heat.rubbed
        yield from ((2 + number, f"wave {number}", wave) for number, wave in enumerate(memory.heat.waves))

    def restored(self, memory: ThermalMemory, saved: Saved) -> ThermalMemory:
        """Return the memory of a checkpoint; collective. If the job has shorter steps than the run that wrote the
        checkpoint, the memory gets further waves of temperature, which start at 0."""
        per, columns = fft.per_map(self._slab.nx), fft.edges(self._slab.nx)
        for number, name, spectrum in self._spectra(memory):
            if name in saved:
                rest, where = saved[f"edges {number // per}"], columns * (number % per)
                fft.from_map(self._setup.fft, saved[name], rest[:, where : where + columns], spectrum)
        memory.heat.mean.waves[...] = saved["mean"]
        x, y = saved["force"].tolist()
        return replace(
            memory,
            flash=float(saved["flash temperature"]),
            highest=float(saved["highest temperature"]),
            force=(x, y),
            area=float(saved["contact area"]),
            warmed=bool(saved["is warmed"]),
            share=float(saved["share of the body"]),
            error=float(saved.get("error of friction", math.inf)),
            depths=Depths(*np.split(np.array(saved["depths"]), 2)),
        )
