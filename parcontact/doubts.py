"""Warnings as data: what is doubtful, where, and its numbers; and the sentences in which users read them.

Whoever judges a job, a surface or a contact makes a `Doubt`. Nothing compares or parses the sentences.
"""

import math
import string
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .printed import per_cent, quantity


@dataclass(frozen=True)
class Doubt:
    """Something that is allowed but will probably disappoint: its `kind` (a name in SENTENCES), its `place`, such as a
    key of the job, and the numbers and names of its sentence, in SI units."""

    kind: str
    place: str
    numbers: Mapping[str, object] = field(default_factory=dict)

    @property
    def body(self) -> str:
        """The sentence without its place."""
        return FORMATTER.vformat(SENTENCES[self.kind], (), self.numbers)

    def __str__(self) -> str:
        return f"{self.place}: {self.body}" if self.place else self.body

    @property
    def subject(self) -> tuple[str, ...]:
        """Return kind, place and names, but `where` it was seen: two doubts with one subject differ in numbers
        alone."""
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
    """Formats like `str.format`; `!p` is a share in per cent, `!m` a length in m with its unit in four digits, `!M` in
    three, `!t` how many times."""

    def convert_field(self, value: Any, conversion: Any) -> Any:
        if conversion == "p":
            return per_cent(value)
        if conversion == "t":
            return f"{value:.3g} times" if math.isfinite(value) else "far above"
        if conversion in ("m", "M"):
            return quantity(value, "m", 4 if conversion == "m" else 3)
        return super().convert_field(value, conversion)


FORMATTER = _Formatter()
SENTENCES = {
    # whole sentences: of effects of others, and of the tables of moduli from which a material is fitted
    "said": "{text}",
    # a job: slopes, strains, relaxation
    "steep": (
        "its rms slope is {slope:.3g}, and the theory is one of small slopes, {most:g} at most: heights and lengths "
        "are in m; heights in um need a factor of 1e-6 (scale: 1.0e-6 of a file, unit: um of a topography), and "
        "missing points are nan"
    ),
    "soft": (
        "its shear modulus at once is {modulus:.3g} Pa, softer than {least:g} Pa, as gels are; moduli are in Pa: "
        "{modulus:.3g} MPa would be {in_mega:.3g}"
    ),
    "hard": "its shear modulus at once is {modulus:.3g} Pa, above {most:g} Pa, harder than diamond",
    "strain at once": (
        "a mean pressure of {pressure:.3g} Pa is above 2 G/(1 - nu) = {modulus:.3g} Pa, where strains are far beyond "
        "linear theory; pressures and moduli are both in Pa"
    ),
    "strain in time": (
        "a mean pressure of {pressure:.3g} Pa is above 2 G/(1 - nu) = {modulus:.3g} Pa after {seconds:.3g} s under "
        "it, where strains are far beyond linear theory; pressures and moduli are both in Pa"
    ),
    "light": (
        "under {pressure:.3g} Pa, the largest load, {touching:.2g} points of the grid would touch, and 1 is the "
        "least; use a larger load. Pressures are in Pa: {pressure:.3g} MPa is {in_mega:.3g}"
    ),
    "at an instant": (
        "its {stages} stages last no time, and the rubber is at its stiffest in all of them, with a shear modulus of "
        "{modulus:.3g} Pa; give them a duration [s] to let it relax to {relaxed:.3g} Pa"
    ),
    "elastic": (
        "sliding excites {low:.3g} to {high:.3g} rad/s, all more than {times:g} times {how} than the branches, which "
        "relax at {slow:.3g} to {fast:.3g} rad/s: the body is elastic with its {modulus} modulus; are velocities in "
        "m/s, lengths in m and relaxation times in s?"
    ),
    "imprint": (
        "after {way:.3g} m of its {length:.3g} m the surface is back within {near:.3g} m of where it began, once "
        "round the periodic box, and slides over its own imprint, which the body remembers for {memory:.3g} s. From "
        "there on friction and mu_dyn depend on the box; use a shorter distance or a larger grid.size"
    ),
    # a job: spheres
    "large contact": (
        "the contact would have a radius of {contact:.3g} m or more, larger than that of the sphere, {radius:g} m; "
        "the theory is one of small slopes: use a smaller load"
    ),
    "out of the box": (
        "the contact has a radius of {contact:.3g} m or more and leaves the box of {lx:g} x {ly:g} m; use a "
        "larger grid.size, less load or a shorter way"
    ),
    "slides out of the box": (
        "the contact, centred at ({x:.4g}, {y:.4g}) m in the end, has a radius of {contact:.3g} m or more and leaves "
        "the box of {lx:g} x {ly:g} m; use a larger grid.size, less load or a shorter way"
    ),
    "images": (
        "its images in the periodic box of {lx:g} x {ly:g} m change the load at a given radius of contact by "
        "{change!p} or more; {most!p} passes: use a grid.size {times:.3g} times as large, or boundary: free"
    ),
    # a job: the mesh and the steps
    "few long waves": (
        "only {waves:.3g} of the longest waves fit into the box along {axis}, and a representative surface has at "
        "least {least}; use a grid.size of {size:.4g} m or a long_wavelength of {wave:.4g} m"
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
    "slides in no time": "nothing slides in a stage without duration or distance; its velocity has no effect",
    "long steps": (
        "time steps up to {step:.3g} s are longer than the shortest relaxation time {shortest:.3g} s, which "
        "backward-euler does not resolve; shorten the steps or use integrator: exponential"
    ),
    "skipped waves": (
        "the surface slides {slid:.3g} m in one step, {share:.2g} of its shortest wave; use time steps up to "
        "{step:.3g} s (cells_per_step up to {cells:.3g})"
    ),
    # a job: a layer
    "thin": (
        "{thickness:g} m is thinner than {least:g} cells of {cell:.3g} m, and the edges of contacts are not resolved; "
        "use {more}, or a smaller grid.size"
    ),
    "high for a layer": (
        "the surface is {height:.3g} m high or more, above a third of the layer ({thickness:g} m), where strains are "
        "not small; use a thicker layer, or a lower surface"
    ),
    "deep for a layer": (
        "{approach:.3g} m is more than a third of the layer ({thickness:g} m), where strains are not small; use a "
        "smaller approach, or a thicker layer"
    ),
    "incompressible": (
        "waves of {wave:.3g} m are more than {times:g} times as long as the layer is thick ({thickness:g} m), and "
        "rubber yields to them by its compressibility; {poisson:g} leaves that out: use 0.4995"
    ),
    # a job: memory and disk
    "memory": (
        "{nx} x {ny} points need at least {needed:.3g} GB of memory on all ranks together, and {machines} {has:.3g} "
        "GB; use fewer points, or {count} such machines"
    ),
    "disk": (
        "{instants:.4g} instants need {needed:.3g} GB, and {directory} has {free:.3g} GB left; use a larger "
        "output.every than {every}, or fewer fields"
    ),
    # a job: adhesion
    "work": (
        "adhesion.work is {work:g} J/m^2 and the range {range:.3g} m: to part dry surfaces takes {most:g} J/m^2 at "
        "most, of rubber some 0.05; what a body dissipates comes beside it, from its material"
    ),
    "strained edges": (
        "strains at the edges of contact are some work/(E* range) = {strain:.2g}, and the theory is for small ones, "
        "at most {most:g}: adhesion.work is {work:g} J/m^2 and the range {range:.3g} m; use a longer range, or less "
        "work"
    ),
    "long range": (
        "adhesion.work is {work:g} J/m^2 and the range {range:.3g} m, more than {most:g} of the box: points then "
        "attract more than what lies opposite, which the law does not know; use a shorter range"
    ),
    "coarse tip": (
        "a cell, {cell:.3g} m, is {ratio:.2g} times sqrt(radius range), how far {sphere} is attracted around its tip: "
        "{most:g} times makes the sum over points wrong by 3 %, more is worse; use cells of {fine:.3g} m, or a range "
        "of {enough:.3g} m"
    ),
    "small sphere": (
        "it attracts out to sqrt(2 radius range), more than its radius, {radius:g} m, and the theory is one of small "
        "slopes; use an adhesion.range up to {most:.3g} m"
    ),
    "cut attraction": (
        "{share!p} of its attraction over an adhesion.range of {range:.3g} m comes from beyond {room:.3g} m, where "
        "the box ends; {most!p} passes: use a range up to {shorter:.3g} m, or {more:.3g} m of room around the sphere"
    ),
    "attraction at an edge": (
        "{share!p} of its attraction over an adhesion.range of {range:.3g} m comes from beyond {room:.3g} m, where "
        "the box ends; {most!p} passes: use {more:.3g} m of room around the sphere"
    ),
    "coarse process zone": (
        "a cell, {cell:.3g} m, is {ratio:.2g} times as long as the process zone, and the forces at edges of contact "
        "are not resolved: 1.2 times makes pull-off wrong by 4 %, 1.8 times by 23 %; use a range of {enough:.3g} m or "
        "more, or cells of {zone:.3g} m"
    ),
    "range beyond heights": (
        "the range, {range:.3g} m, is more than the {span:.3g} m from the lowest to the highest point of the surface, "
        "which then attracts nearly equally everywhere: adhesion is hardly more than a pressure of work/range; use a "
        "shorter range (range: auto follows the cells)"
    ),
    "range follows cells": (
        "auto follows cells, work and modulus, from {least:.4g} to {most:.4g} m in these cases, which are different "
        "physics; to compare them give one range to all: the cells of each resolve {most:.4g} m"
    ),
    # measured moduli
    "temperatures": (
        "{degrees} C is beyond the {low:g} to {high:g} C of its measurement: the shift is an extrapolation there"
    ),
    "frequencies": (
        "the job excites {low:.3g} to {high:.3g} Hz, reduced to the reference temperature, {decades:.1f} decades "
        "{side} the measured {first:.3g} to {last:.3g} Hz: moduli are an extrapolation there"
    ),
    # heights
    "seam": (
        "the heights at the two ends along {axis} of the periodic box differ by {jump:.3g} m (rms), {times!t} the "
        "largest step between neighbours inside. Such a step makes friction of its own; cut it where it fits, or let "
        "it fade to its mean towards the edge"
    ),
    "tilt": (
        "the heights at the two ends along {axis} of the periodic box differ by {jump:.3g} m (rms), {times!t} the "
        "largest step between neighbours inside. Such a step makes friction of its own; it is tilted by {tilt:.3g}: "
        "subtract its mean plane"
    ),
    "steep waves": (
        "its rms slope is {slope:.3g} (rms strain {strain:.2g}), and linear theory has small slopes: waves shorter "
        "than {steep:.3g} m go beyond a slope of {most:g}"
    ),
    "steep waves, cut-off": (
        "its rms slope is {slope:.3g} (rms strain {strain:.2g}), and linear theory has small slopes: waves shorter "
        "than {steep:.3g} m go beyond a slope of {most:g}; waves shorter than {usual:.3g} m are usually left out: "
        "bands.cutoff_slope: {cutoff:g}"
    ),
    "no waves of the map": (
        "the spectrum begins at {longest!M}, and of the map only longer waves are taken, hardly any of its {side!M}; "
        "give the spectrum long_wavelength: {seam:.2g} or so, {points} points of the map"
    ),
    # measured maps
    "large map": "{file}: the map is {lx:.4g} x {ly:.4g} m; are lengths in m?",
    "near points": "{file}: points of the map are {dx!m} apart, less than atoms; are lengths in this unit?",
    "flat map": (
        "{file}: the map is {lx!m} x {ly!m}, and its heights differ by {span!M} only; do heights and lengths have the "
        "right units?"
    ),
    "oblong points": (
        "{file}: points of the map are {dx!m} apart along x and {dy!m} along y; is the order of x and y right?"
    ),
    "outliers": (
        "{count} points of the map stick out of their neighbours by more than {deviations:g} times the median "
        "deviation{repeated}. Its rms slope is {slope:.3g} with them and {without:.3g} without, and they carry load; "
        "where they are no part of the surface, give outliers: clip, or nodata: NUMBER if one number marks missing "
        "points"
    ),
    # friction curves
    "unsolved point": "{where}",
    "decomposes": (
        "flash temperatures of {count} of {points} points are above {most:g} K, up to {rise:.3g} K at {speed:g} m/s: "
        "rubber decomposes there; take a smaller thermal.distance, velocity or pressure"
    ),
    "flash temperatures": (
        "with its flash temperature the rubber is beyond the {low:g} to {high:g} C of its measurement at {count} of "
        "{points} points, up to {hottest:.3g} C at {speed:g} m/s: the shift is an extrapolation there"
    ),
    "inaccurate points": "estimated error of {of} {where}",
    # contacts
    "edge": (
        "{where}: the contact reaches the edge of the box and is cut off there, so its results are wrong; use a "
        "larger grid.size, less load or a shorter way"
    ),
    "cells": (
        "{where}: spots of contact are only a few cells wide: contact_area is about {excess!p} too large (more than "
        "{most!p} gets this warning); use {more}, a smaller grid.size or a larger load"
    ),
}
