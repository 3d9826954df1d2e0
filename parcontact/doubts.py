"""Warnings as data (kind, place, numbers), and the sentences that users read.

Code that checks a job, a surface or a contact returns `Doubt`s. No code compares or parses the sentences. Those of
capabilities are in their folders."""

import math
import string
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .capabilities import stated
from .printed import per_cent, quantity, rounded_down, rounded_up


@dataclass(frozen=True)
class Doubt:
    """A warning: its `kind` (a key of SENTENCES), its `place` (such as a key of the job), and the numbers (SI units)
    and names in its sentence."""

    kind: str
    place: str
    numbers: Mapping[str, object] = field(default_factory=dict)

    @property
    def body(self) -> str:
        """Return the sentence without the place."""
        return FORMATTER.vformat(SENTENCES[self.kind], (), self.numbers)

    def __str__(self) -> str:
        return f"{self.place}: {self.body}" if self.place else self.body

    @property
    def subject(self) -> tuple[str, ...]:
        """Return kind, place and names except `where`: doubts with the same subject differ in numbers only."""
        names = (value for name, value in self.numbers.items() if isinstance(value, str) and name != "where")
        return self.kind, self.place, *names


class ParcontactWarning(UserWarning):
    """A warning about a job or its results.

    `kind` names the problem, `place` the key of the job or `""`, and `numbers` has the values of the sentence in SI
    units. Python's filters treat two warnings that differ in these numbers alone as the same: a line that calls this
    package many times shows each problem once.
    """

    def __init__(self, doubt: Doubt) -> None:
        super().__init__(doubt)
        self.kind: str = doubt.kind
        self.place: str = doubt.place
        self.numbers: Mapping[str, object] = doubt.numbers

    def __str__(self) -> str:
        return _WarningText(self.args[0])


class _WarningText(str):
    """The sentence of a warning, equal to every other one with the same subject, as Python's filters compare texts."""

    subject: tuple[str, ...]

    def __new__(cls, doubt: Doubt) -> "_WarningText":
        text = super().__new__(cls, doubt)
        text.subject = doubt.subject
        return text

    def __eq__(self, other: object) -> bool:
        return self.subject == other.subject if isinstance(other, _WarningText) else super().__eq__(other)

    def __hash__(self) -> int:
        return hash(self.subject)


class _Formatter(string.Formatter):
    """Formats like `str.format`, and with `!p` (a share in per cent), `!m` and `!M` (a length with its unit in four and
    three digits), `!t` (a multiple), and `!u` and `!d` (a number that is rounded up or down, so that a job that follows
    the advice keeps the limit)."""

    def convert_field(self, value: Any, conversion: Any) -> Any:
        if conversion == "p":
            return per_cent(value)
        if conversion == "t":
            return f"{value:.3g} times" if math.isfinite(value) else "far above"
        if conversion in ("u", "d"):
            return (rounded_up if conversion == "u" else rounded_down)(value)
        if conversion in ("m", "M"):
            return quantity(value, "m", 4 if conversion == "m" else 3)
        return super().convert_field(value, conversion)


FORMATTER = _Formatter()
SENTENCES = {
    # whole sentences, from plug-ins and from tables of measured moduli
    "said": "{text}",
    # a job: slopes, strains, relaxation
    "steep": (
        "its rms slope is {slope:.3g}; the theory assumes small slopes, up to {most:g}. Are heights and lengths in "
        "m?{needed}"
    ),
    "soft": (
        "its instantaneous shear modulus is {modulus:.3g} Pa, below {least:g} Pa and as soft as a gel. Moduli are in "
        "Pa: {modulus:.3g} MPa would be {in_mega:.3g}"
    ),
    "hard": (
        "its instantaneous shear modulus is {modulus:.3g} Pa, above {most:g} Pa and harder than diamond; moduli are in "
        "Pa"
    ),
    "strain at once": (
        "a mean pressure of {pressure:.3g} Pa exceeds 2 G/(1 - nu) = {modulus:.3g} Pa, where strains are far beyond "
        "linear theory; are pressures and moduli both in Pa?"
    ),
    "strain in time": (
        "a mean pressure of {pressure:.3g} Pa, held for {seconds:.3g} s, exceeds 2 G/(1 - nu) = {modulus:.3g} Pa of "
        "the relaxed body, where strains are far beyond linear theory; are pressures and moduli both in Pa?"
    ),
    "light": (
        "under the largest load, {pressure:.3g} Pa, only {touching:.2g} points of the grid would touch, less than 1; "
        "use a larger load. Pressures are in Pa: {pressure:.3g} MPa is {in_mega:.3g}"
    ),
    "at an instant": (
        "its {stages} stages have no duration, so the rubber keeps its instantaneous shear modulus of {modulus:.3g} "
        "Pa; give them a duration [s] to let it relax to {relaxed:.3g} Pa"
    ),
    "elastic": (
        "sliding excites {low:.3g} to {high:.3g} rad/s, all more than {times:g} times {how} than the branches, which "
        "relax at {slow:.3g} to {fast:.3g} rad/s: the body is elastic with its {modulus} modulus; are velocities in "
        "m/s, lengths in m and relaxation times in s?"
    ),
    "imprint": (
        "after {way:.3g} m of its {length:.3g} m the surface has crossed the periodic box, returns to within "
        "{near:.3g} m of its start, and slides over its own imprint, which the body remembers for {memory:.3g} s. "
        "Beyond this distance friction and mu_dyn depend on the box; use a shorter distance or a larger grid.size"
    ),
    # a job: spheres
    "large contact": (
        "the contact would have a radius of {contact:.3g} m or more, above the radius of the sphere, {radius:g} m; the "
        "theory assumes small slopes: use a smaller load"
    ),
    "out of the box": (
        "the contact has a radius of some {contact:.3g} m and leaves the box of {lx:g} x {ly:g} m, whose edge is "
        "{room:.3g} m from its centre; use a larger grid.size, a smaller load or a shorter distance"
    ),
    "slides out of the box": (
        "a free box does not move with the surface: after {way:.3g} m of the {length:.3g} m that it slides, the "
        "contact, with a radius of some {contact:.3g} m, reaches the edge of the box of {lx:g} x {ly:g} m and is cut "
        "off there. Let it slide {way:.3g} m at most, use a larger grid.size, or put surface.0.center farther back"
    ),
    "images": (
        "its images in the periodic box of {lx:g} x {ly:g} m change the load at a given radius of contact by "
        "{change!p} or more (limit: {most!p}); use a grid.size {times!u} times as large, or boundary: free"
    ),
    # a job: the mesh and the steps
    "few long waves": (
        "only {waves:.3g} of the longest waves fit into the box along {axis}; a representative surface needs at least "
        "{least}: use a grid.size of {size!u} m or a long_wavelength of {wave!d} m"
    ),
    "large box": (
        "a side of {length:g} m, {times:.4g} times {key}, {wave:g} m; is it in m? {length:g} mm would be {in_milli:g}"
    ),
    "few cells": (
        "only {cells:.3g} cells per shortest wave along {axis}; {reason} needs {needed:.3g}: use {points} points "
        "({memory:.2g} times the memory{time}) or a short_wavelength of {wave:.4g} m"
    ),
    "few cells of a map": (
        "only {cells:.3g} cells per shortest wave along {axis} ({known:.3g} m, by the spectrum of the "
        "heights{spikes}); {reason} needs {needed:.3g}: use {points} points ({memory:.2g} times the memory{time}), to "
        "which a topography is interpolated (resample an array yourself), or heights without waves shorter than "
        "{wave:.4g} m"
    ),
    "slides in no time": "a stage without duration or distance does not slide; its velocity has no effect",
    "long steps": (
        "time steps of up to {step:.3g} s exceed the shortest relaxation time, {shortest:.3g} s, which backward-euler "
        "must resolve; use shorter steps or integrator: exponential"
    ),
    "skipped waves": (
        "the surface slides {slid:.3g} m in one step, {share:.2g} of its shortest wave; use time steps of at most "
        "{step!d} s (cells_per_step of at most {cells!d})"
    ),
    # a job: a layer
    "thin": (
        "{thickness:g} m is thinner than {least:g} cells of {cell:.3g} m, so edges of contacts are not resolved; use "
        "{more}, or a smaller grid.size"
    ),
    "high for a layer": (
        "the surface is {height:.3g} m high or more, above a third of the layer ({thickness:g} m), so strains are not "
        "small; use a thicker layer, or a lower surface"
    ),
    "deep for a layer": (
        "{approach:.3g} m is more than a third of the layer ({thickness:g} m), so strains are not small; use a smaller "
        "approach, or a thicker layer"
    ),
    "incompressible": (
        "waves of {wave:.3g} m are more than {times:g} times as long as the layer is thick ({thickness:g} m); rubber "
        "yields to them by its compressibility, which a Poisson's ratio of {poisson:g} excludes: use 0.4995"
    ),
    # a job: memory and disk
    "memory": (
        "{nx} x {ny} points need at least {needed:.3g} GB of memory on all ranks together, but {machines} {has:.3g} "
        "GB; use fewer points, or {count} such machines"
    ),
    "disk": (
        "{instants:.4g} instants need {needed:.3g} GB, but {directory} has {free:.3g} GB left; use an output.every "
        "above {every}, or fewer fields"
    ),
    # temperatures
    "kelvin": (
        "{degrees:g} C is hotter than rubber endures (limit: {most:g} C). Temperatures are in deg C: if this is in "
        "kelvin, give {celsius:g}"
    ),
    # measured moduli
    "temperatures": (
        "{degrees} C is outside of the measured {low:g} to {high:g} C: the shift is an extrapolation there"
    ),
    "frequencies": (
        "the job excites {low:.3g} to {high:.3g} Hz, reduced to the reference temperature, {decades:.1f} decades "
        "{side} the measured {first:.3g} to {last:.3g} Hz: moduli are an extrapolation there"
    ),
    # heights
    "seam": (
        "the heights at the two ends along {axis} of the periodic box differ by {jump:.3g} m (rms), {times!t} the "
        "largest step between neighbours inside. Such a step adds friction; cut the map where its ends fit, or let "
        "heights fade to their mean towards the edges"
    ),
    "tilt": (
        "the heights at the two ends along {axis} of the periodic box differ by {jump:.3g} m (rms), {times!t} the "
        "largest step between neighbours inside. Such a step adds friction; the surface is tilted by {tilt:.3g}: "
        "subtract its mean plane"
    ),
    "steep waves": (
        "its rms slope is {slope:.3g} (rms strain {strain:.2g}); linear theory assumes small slopes, and waves shorter "
        "than {steep:.3g} m exceed a slope of {most:g}"
    ),
    "steep waves, cut-off": (
        "its rms slope is {slope:.3g} (rms strain {strain:.2g}); linear theory assumes small slopes, and waves shorter "
        "than {steep:.3g} m exceed a slope of {most:g}. Waves shorter than {usual:.3g} m are usually left out: give "
        "bands.cutoff_slope: {cutoff:g}"
    ),
    "no waves of the map": (
        "the spectrum begins at {longest!M}, and only longer waves are taken from the map, which is {side!M} long and "
        "has hardly any; give the spectrum a long_wavelength of about {seam:.2g} m ({points} points of the map)"
    ),
    # measured maps
    "large map": "{file}: the map is {lx:.4g} x {ly:.4g} m; are lengths in m?",
    "near points": "{file}: the spacing of points is {dx!m}, less than the size of atoms; is the unit right?",
    "flat map": (
        "{file}: the map is {lx!m} x {ly!m}, and its heights differ by {span!M} only; do heights and lengths have the "
        "right units?"
    ),
    "oblong points": (
        "{file}: the spacing of points is {dx!m} along x and {dy!m} along y; is the order of x and y right?"
    ),
    "outliers": (
        "{count} points of the map differ from their neighbours by more than {deviations:g} times the median "
        "deviation{repeated}. Its rms slope is {slope:.3g} with them and {without:.3g} without, and they carry load; "
        "if they are no part of the surface, give outliers: clip{nodata}"
    ),
    # friction curves
    "unsolved point": "{where}",
    "inaccurate points": "estimated error of {of} {where}",
    # contacts
    "edge": (
        "{where}: the contact reaches the edge of the box and is cut off there, so its results are wrong; use a "
        "larger grid.size, a smaller load or a shorter distance"
    ),
    "below a cell": (
        "{where}: spots of contact may be smaller than a cell, so that their area and friction are not known and no "
        "error is stated; use {more}, a smaller grid.size or a larger load"
    ),
    "cells": (
        "{where}: spots of contact are only a few cells wide: contact_area is about {excess!p} too large (limit: "
        "{most!p}); use {more}, a smaller grid.size or a larger load"
    ),
    **{kind: text for texts in stated("SENTENCES") for kind, text in texts.items()},
}
