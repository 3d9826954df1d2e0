"""Persson's theory for any history: rest, starts, stops, reversals, changes of load, with piecewise constant
velocities.

In the transfer modulus M of a wave (see `full_contact`) every term of the relaxation function has a memory m_j of
how the wave has passed a point of the body. At constant omega = q . v, from a memory m_j(0) at t = 0 on,

    M(t) = G_inf + sum_j G_j m_j(t)
    m_j(t) = b_j + (m_j(0) - b_j) exp(-t/tau_j - i omega t),    b_j = i omega tau_j/(1 + i omega tau_j)

exactly, for any t. A body at first contact has m_j = 1 (its instantaneous modulus), one in steady sliding has m_j =
b_j. Contact area and friction follow from M and the load at each instant, as in `persson`.

Assumption: from first contact on the wave in full contact follows the surface, and a load p0(t) that changes or
vanishes only changes the share in contact. Source: as `persson`; B. N. J. Persson and A. I. Volokitin, Phys. Rev. B
65 (2002) 134106, for changes of velocity."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ..physics.prony import Prony, normal_form
from . import full_contact, persson
from .full_contact import Array, ComplexArray
from .persson_rings import Rings

CHUNK = 1_000_000  # tuning: transfer moduli per chunk, of 16 bytes; about ten arrays of this size are needed


class SlidingLeg(NamedTuple):
    """A stretch at constant velocity [m/s]: its duration [s], instants since its start [s], and p0 at these [Pa]."""

    velocity: tuple[float, float]
    duration: float
    instants: Array
    pressures: Array


class TheoryOutcome(NamedTuple):
    """<p grad h> [Pa], shape (instants, 2), and A/A0 at each instant."""

    traction: Array
    contact_area: Array

    def friction(self, pressures: Array) -> Array:
        """Return the tangential over the normal force, not negative; 0 without load."""
        size = np.hypot(*self.traction.T)
        return np.divide(size, pressures, out=np.zeros_like(size), where=pressures > 0)


class Memory:
    """Memory m_j of each wave in the body: shape (waves, terms)."""

    def __init__(self, rings: Rings, material: Prony) -> None:
        """Start with the memory of a body at first contact."""
        self.rings = rings
        self.spring, self.terms, self.times = normal_form(*material)
        self.shares = np.ones((rings.waves.kx.size, self.times.size), complex)

    def slide_for_ever(self, velocity: tuple[float, float]) -> None:
        """Set the memory of steady sliding."""
        self.shares = self._steady(self._frequency(velocity))

    def moduli(self, velocity: tuple[float, float], instants: Array) -> ComplexArray:
        """Return M [Pa] at instants [s] of sliding at a velocity: shape (instants, waves)."""
        omega = self._frequency(velocity)
        steady = self._steady(omega)
        fading = np.exp(-instants[:, None] / self.times) @ (self.terms * (self.shares - steady)).T
        if np.any(omega):
            fading *= np.exp(-1j * instants[:, None] * omega)
        return np.asarray(self.spring + steady @ self.terms + fading)

    def slide(self, velocity: tuple[float, float], duration: float) -> None:
        """Advance by sliding for a duration [s]."""
        omega = self._frequency(velocity)[:, None]
        steady = self._steady(omega[:, 0])
        self.shares = steady + (self.shares - steady) * np.exp(-duration / self.times - 1j * duration * omega)

    def _frequency(self, velocity: tuple[float, float]) -> Array:
        return full_contact.frequency(self.rings.waves.kx, self.rings.waves.ky, *velocity)

    def _steady(self, omega: Array) -> ComplexArray:
        phase = 1j * omega[:, None] * self.times
        return np.asarray(phase / (1 + phase))


def follow(memory: Memory, legs: Iterable[SlidingLeg], gamma: float = persson.GAMMA) -> Iterator[TheoryOutcome]:
    """Yield the outcome of each leg, one after the other; `memory` is advanced."""
    for leg in legs:
        count = max(1, CHUNK // max(1, len(memory.shares)))
        starts = range(0, max(1, leg.instants.size), count)
        parts = [_observe(memory, leg, slice(start, start + count), gamma) for start in starts]
        yield TheoryOutcome(*(np.concatenate(part) for part in zip(*parts, strict=True)))
        memory.slide(leg.velocity, leg.duration)


def _observe(memory: Memory, leg: SlidingLeg, chosen: slice, gamma: float) -> TheoryOutcome:
    modulus, pressures = memory.moduli(leg.velocity, leg.instants[chosen]), leg.pressures[chosen]
    traction = persson.traction(pressures, memory.rings, modulus, gamma)
    return TheoryOutcome(traction, persson.contact_area(pressures, memory.rings, modulus))
