"""Energies of contacts with adhesion: the work of the load, the energy of the surfaces, what snaps lose.

In a step in which the body gains energy, stored and dissipated, and the surfaces do, the load does its work along the
path, by the trapezoidal rule, `F dd - F_t ds`. What is missing is lost in a snap if the load could not have done it on
any way between its two ends; else it is what the rule makes wrong, and the work is that of the energies.

Surfaces that detach under a load are in no equilibrium until they are apart, and the same holds for those that a load
brings together again. What a load does on such a way depends on the inertia that the model leaves out. Its work from
the last equilibrium on then is the least that the change takes, and 0 if energy is set free, which is lost. While
surfaces are apart nothing acts on them, and neither work nor losses change.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from ..accuracy.constants import ENERGY
from ..physics.measures import Measures
from .effect import Instant

if TYPE_CHECKING:
    from ..solve.contact import Contact

LEAST_SNAP = 1e-4  # accuracy: of the energies of a step: less cannot be told from none
FORCE_DOUBT = 0.3  # accuracy: of the tangential force, by which that of energy may differ
SURFACES, PUSHED, JUMPS = "surface_energy", "work_of_load", "leaves_equilibrium"  # numbers of the law


class AdhesiveEnergies(NamedTuple):
    """Energies [J] since the start: the `work` of the rigid surface, the energy of the `surfaces`, 0 far apart, the
    energy `lost` in snaps, and the estimated `error` of the others: by how much the work along the path of the load
    and the energies differ, summed over all steps without a snap, and ENERGY times the error of the area in what each
    step dissipates."""

    work: float = 0.0
    surfaces: float = 0.0
    lost: float = 0.0
    error: float = 0.0


NO_ENERGIES = AdhesiveEnergies()


class PathWork:
    """Work of the load along its path by the trapezoidal rule, for the modulus 1, in the unit of the scene's energies;
    0 where no energies are asked for."""

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
    """Return the work of sliding a way without the friction of the interface, and how wrong it may be [J]."""
    (x, y), slid = moved, math.hypot(*moved)
    if not slid:
        return 0.0, 0.0
    works = [-(one.force_x * x + one.force_y * y) - one.force_interface * slid for one in (before, now)]
    return 0.5 * sum(works), 0.5 * abs(works[1] - works[0]) + FORCE_DOUBT * abs(works[1])
