"""Heat of sliding: how warm the rubber becomes below the contact (`physics.heat`, `physics.heat_memory`)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import DTypeLike
from pydantic import Field

from ..columns import added_by
from ..errors import InputError, RunError
from ..history.timeline import Timeline
from ..job import Grid
from ..job.checks import limits
from ..job.sections.part import Part, Rule
from ..job.sections.quantities import Positive
from ..job.text.fault import Fault
from ..parallel import spectra
from ..parallel.fft import Spectrum
from ..parallel.slab import Array
from ..physics.entries import Entry, Saved
from ..physics.exponentials import Exponentials, fit
from ..physics.heat import Conductor, Depths, depths_of
from ..physics.heat_memory import Heating, HeatMemory
from ..physics.prony import Prony
from ..physics.units import Units
from .effect import Decision, Effect, Instant
from .relaxation import factor_at, feeds_back, temperature_of

LOOSEST, SHARE = 1e-3, 0.1  # accuracy: of the memory of heat: a share of the job's accuracy, this at most
DECAYED = 10.0  # accuracy: heat of the longest wave of the box is forgotten when so many times its diffusion is over


def _shifts(thermal: Thermal | None, material: Any) -> Iterator[Fault]:
    if thermal is not None and thermal.feedback != "none" and math.isnan(temperature_of(material)):
        yield Fault(
            "needs a material whose relaxation times depend on temperature: give material a shift, or feedback: none",
            ("thermal", "feedback"),
        )


def _no_warm_start(thermal: Thermal | None, initial: Any) -> Iterator[Fault]:
    if thermal is not None and thermal.feedback != "none" and initial.state == "steady":
        yield Fault("does not go with thermal.feedback: slide into the steady state with a stage", ("initial",))


def _in_curves(thermal: Thermal | None, history: Any, grid: Grid) -> Iterator[Fault]:
    if thermal is None or thermal.counterbody is None:
        return
    if history:
        yield Fault(
            "is for friction curves: leave out the history, or the counterbody, and all heat goes into the rubber",
            ("thermal", "counterbody"),
        )
    if grid.boundary == "free":
        yield Fault("needs grid.boundary: periodic", ("thermal", "counterbody"))


class Counterbody(Part):
    """The rigid body, as it conducts heat."""

    label: ClassVar[str] = "counterbody"
    conductivity: Positive = Field(description="a positive conductivity of the rigid body [W/(m K)]")
    diffusivity: Positive = Field(description="a positive thermal diffusivity of the rigid body [m^2/s]")

    @property
    def conductor(self) -> Conductor:
        """The rigid body."""
        return Conductor(self.conductivity, self.diffusivity)


class Thermal(Part):
    """The `thermal` section: how the rubber conducts heat, and whether warm rubber relaxes faster."""

    label: ClassVar[str] = "thermal"
    conductivity: Positive = Field(description="a positive conductivity of the rubber [W/(m K)]")
    diffusivity: Positive = Field(description="a positive thermal diffusivity of the rubber [m^2/s]")
    feedback: Literal["none", "mean"] = "none"
    distance: Positive | None = Field(default=None, description="a positive distance [m]")
    counterbody: Counterbody | None = Field(default=None, description="a mapping with conductivity and diffusivity")

    @property
    def conductor(self) -> Conductor:
        """The rubber."""
        return Conductor(self.conductivity, self.diffusivity)

    def sliding_time(self, grid: Grid, speed: float) -> float:
        """Return for how long steady sliding has warmed the rubber [s]: over the distance, or else through a periodic
        box once; for ever in a free one."""
        free = grid.boundary == "free"
        return (self.distance or (math.inf if free else max(grid.size))) / speed


def exponentials_of(job: Any) -> Exponentials:
    """Return the sum of exponentials of a job: from its shortest step since it slides to its longest wave of heat."""
    body = job.section("thermal").conductor
    longest = DECAYED / (body.diffusivity * (2.0 * np.pi / max(job.grid.size)) ** 2)
    steps, slides = [longest / 10.0], False
    for span in Timeline.of(job).spans:
        slides = slides or span.moves
        if slides and span.count:
            steps += span.extremes
    return fit(min(step for step in steps if step > 0.0), longest, min(LOOSEST, SHARE * job.numerics.asked.strictest))


class ThermalColumns:
    """The mean temperature rise of the contact, weighted by heat, and the highest one of the surface [K].

    Under a surface at rest the weights are as in the last sliding. `rise` is the map of the surface [K].
    """

    section: ClassVar[type[Part]] = Thermal
    columns: ClassVar[tuple[str, ...]] = added_by("thermal")
    rules: ClassVar[tuple[Rule, ...]] = (
        Rule(("thermal", "material"), _shifts),
        Rule(("thermal", "initial"), _no_warm_start),
        Rule(("thermal", "history", "grid"), _in_curves),
    )
    lifts: ClassVar[tuple[Any, ...]] = (limits.no_temperature,)

    @staticmethod
    def decide(job: Any) -> Decision:
        section: Thermal | None = job.section("thermal")
        if section is None:
            return Decision("thermal", False, "there is no thermal section")
        why = f"feedback is {section.feedback}"
        return Decision("thermal", True, f"{why}; {exponentials_of(job).kept} exponentials" if job.history else why)

    @staticmethod
    def facts(job: Any) -> Iterator[str]:
        """Say what the distance of steady sliding is where the job gives none."""
        if job.section("thermal").distance is None:
            free = job.grid.boundary == "free"
            way = "without end" if free else f"{max(job.grid.size):g} m, the longer side of the box, since it was cold"
            yield f"thermal.distance is not given: in friction curves the rubber has slid {way}"

    @staticmethod
    def maps(job: Any) -> Sequence[DTypeLike]:
        """Return the types of the map of temperatures, and of those that hold its spectra."""
        count, rubs = 2 + exponentials_of(job).kept, job.section("interface") is not None
        return [np.float64] * (count + rubs + math.ceil(count / spectra.per_map(job.grid.nx)))

    def __init__(self, scene: Any) -> None:
        self._scene, self._setup, self._slab, job = scene, scene.setup, scene.slab, scene.job
        self._feeds_back, self._factor = feeds_back(job), 1.0  # of relaxation times over those of the job's temperature
        self._rubs, self._pulled = scene.choices.interface is not None, job.section("adhesion") is not None
        body = job.section("thermal").conductor
        self.memory = HeatMemory(scene.setup.fft, job.grid.size, body, exponentials_of(job), self._rubs)
        self.rise, self._flash, self._highest = self._slab.zeros(), 0.0, 0.0
        self._force, self._area = np.zeros(2), 0.0  # of the body [N], and in contact, at the end of the last step
        self._warmed = False  # whether there was any heat
        self._depths, self._share = Depths(np.zeros(0), np.zeros(0)), 0.0  # of the last heat, and that in the body

    def follow(self, instant: Instant) -> None:
        step, pressure = instant.step, instant.pressure
        if self._pulled:
            pressure = np.maximum(pressure, 0.0)
        rubbed = np.where(instant.touching, 1.0, 0.0) if self._rubs else None
        sums = float(np.count_nonzero(instant.touching)), float(pressure.sum(dtype=np.float64))
        area, mean = (value / self._slab.points for value in self._slab.sum(*sums))
        scales = 1.0 / area if area > 0.0 else 0.0, 1.0 / mean if mean > 0.0 else 0.0
        heating = self._heat(instant)
        begins = any(step.velocity) and not self._warmed
        self._warmed |= begins
        if begins or (self._warmed and not step.dt):
            self.memory.take(rubbed, pressure, scales)
        if self._warmed and step.dt:
            pressed = self._setup.fft.forward(pressure)
            if any(step.velocity):
                at = self._setup.half_space, self._setup.units.length, step.velocity, self._prony
                self._depths = depths_of(pressed, self._setup.fft, *at)
                self._share = heating.pressed[1] / (heating.whole[1] or 1.0)
            heating = replace(heating, depths=self._depths)
            inside = self.memory.advance(step.dt, heating, rubbed, pressed, scales, self.rise)
            outside = 0.0 if rubbed is None else float((self.rise * rubbed).sum()) * scales[0] / self._slab.points
            outside, self._highest = self._slab.reduce([outside], [float(self.rise.max(initial=-math.inf))])
            self._flash = self._share * inside + (1.0 - self._share) * outside
            self._feed_back()

    @property
    def _prony(self) -> Prony:
        """The relaxation function as it is now, in the run's units."""
        cold = self._setup.prony
        return cold._replace(relaxation_times=cold.relaxation_times * self._factor)

    def _feed_back(self) -> None:
        """Let the rubber relax as at the flash temperature, if the job asks for that. Raises RunError."""
        if self._feeds_back:
            try:
                self._factor = factor_at(self._scene.job.material, self._flash)
            except InputError as error:
                raise RunError(f"the flash temperature leaves what the material allows: {error}") from None
            self._scene.warm(self._factor)

    def _heat(self, instant: Instant) -> Heating:
        """Return the heat of a step, by the forces at both of its ends, and remember those of its end."""
        measures, velocity = instant.measures, instant.step.velocity
        speed, box = math.hypot(*velocity), self._setup.grid.lx * self._setup.grid.ly
        own = measures.force_interface
        force = np.array([measures.force_x, measures.force_y]) + own * np.array(velocity) / (speed or 1.0)
        pressed = tuple(max(0.0, -float(each @ velocity)) / box for each in (self._force, force))
        share = self._area / measures.contact_area if measures.contact_area > 0.0 else 0.0
        self._force, self._area = force, measures.contact_area
        return Heating((own * speed / box * (share if self._warmed else 1.0), own * speed / box), pressed)

    def values(self) -> Sequence[float]:
        return self._flash, self._highest

    # -- checkpoints --------------------------------------------------------------------------------------------------

    def entries(self, units: Units) -> dict[str, Entry]:
        """Return the map, all spectra as maps, and what has no room in these; collective."""
        known, depths = self.memory.sum, self._depths
        found = {
            "rise": Entry(self.rise, 1.0, "K"),
            "mean": Entry(self.memory.mean.waves, 1.0, "J/m^2"),
            "temperatures": Entry(np.array([self._flash, self._highest]), 1.0, "K"),
            "force": Entry(self._force.copy(), 1.0, "N"),
            "state": Entry(np.array([self._warmed, self._area, self._share])),
            "depths": Entry(np.concatenate([depths.wavenumbers, depths.shares])),
            "grid": Entry(np.array([known.first, known.spacing]), given=True),
        }
        per = spectra.per_map(self._slab.nx)
        columns = spectra.edges(self._slab.nx)
        for number, name, spectrum in self._spectra():
            rest = found.setdefault(f"edges {number // per}", Entry(np.zeros(self._slab.shape), optional=True))
            where, field = columns * (number % per), np.empty(self._slab.shape)
            spectra.to_map(self._setup.fft, spectrum, field, np.asarray(rest.value)[:, where : where + columns])
            found[name] = Entry(field, optional=True)
        return found

    def _spectra(self) -> Iterator[tuple[int, str, Spectrum]]:
        """Yield all spectra with a number and a name; more waves along the depth come last."""
        yield 0, "pressed", self.memory.pressed
        if self._rubs:
            yield 1, "rubbed", self.memory.rubbed
        yield from ((2 + number, f"wave {number}", wave) for number, wave in enumerate(self.memory.waves))

    def restore(self, saved: Saved) -> None:
        """Go on from a checkpoint; collective. Waves of shorter steps than before, which it lacks, begin at 0."""
        per, columns = spectra.per_map(self._slab.nx), spectra.edges(self._slab.nx)
        for number, name, spectrum in self._spectra():
            if name in saved:
                rest, where = saved[f"edges {number // per}"], columns * (number % per)
                spectra.from_map(self._setup.fft, saved[name], rest[:, where : where + columns], spectrum)
        self.memory.mean.waves[...] = saved["mean"]
        self._flash, self._highest = map(float, saved["temperatures"])
        self._force, (warmed, self._area, self._share) = np.array(saved["force"]), map(float, saved["state"])
        self._warmed, self._depths = bool(warmed), Depths(*np.split(np.array(saved["depths"]), 2))
        self._feed_back()


def rise_of(effects: Mapping[str, Effect]) -> Array:
    """Return this rank's rows of the temperature rise [K]; raises InputError without the effect that has it."""
    thermal = effects.get("thermal")
    if not isinstance(thermal, ThermalColumns):
        raise InputError("there is no field 'temperature' without a thermal section in the job")
    return thermal.rise.copy()
