"""Energies of contacts with adhesion: work of the load, energy of the surfaces, and losses in snaps.

In a step in which body and surfaces gain energy, the load does work along its path, by the trapezoidal rule, `F dd -
F_t ds`. A difference is lost in a snap if the load could not have supplied it on any path between the two states.
Otherwise it is an error of the rule, and the work is taken from the energies.

Surfaces that detach under a load, or that a load closes again, pass through states without equilibrium. The work of
the load on this path depends on inertia, which the model does not have. From the last equilibrium on it is taken as
the least work that the change needs, and 0 if energy is released, which is lost. While surfaces are detached,
neither work nor losses change.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from ...accuracy.constants import ENERGY
from ...physics.measures import Measures
from ..effect import Instant

if TYPE_CHECKING:
    from ...solve.contact import Contact

LEAST_SNAP = 1e-4  # accuracy: least loss in a snap over the energies of the step
FORCE_DOUBT = 0.3  # accuracy: relative error of the tangential force
SURFACES, PUSHED, JUMPS = "surface_energy", "work_of_load", "leaves_equilibrium"  # names of numbers of the law


class AdhesiveEnergies(NamedTuple):
    """Energies [J] since the start: `work` of the rigid surface, energy of the `surfaces`, 0 at large gaps, energy
    `lost` in snaps, and `error`, the difference between the work along the path of the load and the energies, summed
    over all steps without a snap."""

    work: float = 0.0
    surfaces: float = 0.0
    lost: float = 0.0
    error: float = 0.0


NO_ENERGIES = AdhesiveEnergies()


class PathWork:
    """Work of the load along its path by the trapezoidal rule, for the modulus 1, in the unit of the scene's energies;
    0 without energies."""

    def __init__(self, scene: Any, approach: float, pressure: float) -> None:
        self.scene, self.approach, self.pressure, self.total = scene, approach, pressure, 0.0

    def add(self, contact: Contact) -> None:
        """Add the work up to a contact; collective."""
        if (energy := self.scene.energy) is None:
            return
        pressure = self.scene.slab.sum(float(contact.p.sum()))[0] / self.scene.slab.points
        mean, way = 0.5 * (self.pressure + pressure), contact.d - self.approach
        self.total += energy.unit * self.scene.slab.points * mean * way
        self.approach, self.pressure = contact.d, pressure


def advance_energies(past: AdhesiveEnergies, instant: Instant, area: float) -> AdhesiveEnergies:
    """Return the energies after a step, in a box of an area [m^2]."""
    numbers, before, measures = instant.solved.numbers, instant.before, instant.measures
    surfaces = numbers[SURFACES]
    gained = instant.gained + surfaces - past.surfaces
    dragged, doubt = _drag(before, measures, instant.moved)
    work = numbers[PUSHED] + dragged
    if numbers[JUMPS]:
        work = max(work, gained)
    else:
        way = measures.approach - before.approach
        doubt += 0.5 * area * abs((measures.pressure - before.pressure) * way)
    lost = work - gained
    snaps = lost > doubt + LEAST_SNAP * (abs(gained) + abs(surfaces))
    error = past.error + ENERGY.value * instant.error_area * abs(instant.dissipated)
    if snaps:
        return AdhesiveEnergies(past.work + work, surfaces, past.lost + lost, error)
    return AdhesiveEnergies(past.work + gained, surfaces, past.lost, error + abs(lost))


def _drag(before: Measures, now: Measures, moved: tuple[float, float]) -> tuple[float, float]:
    """Return the work of sliding by `moved` without friction of the interface, and its error [J]."""
    (x, y), slid = moved, math.hypot(*moved)
    if not slid:
        return 0.0, 0.0
    works = [-(one.force_x * x + one.force_y * y) - one.force_interface * slid for one in (before, now)]
    return 0.5 * sum(works), 0.5 * abs(works[1] - works[0]) + FORCE_DOUBT * abs(works[1])
