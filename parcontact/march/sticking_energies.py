"""Energies of contacts that stick: the work of the load, the energy of the surfaces, what snaps lose.

In a step in which the body gains energy, stored and dissipated, and the surfaces do, the load does its work along the
path, by the trapezoidal rule, `F dd - F_t ds`. What is missing is lost in a snap if the load could not have done it on
any way between its two ends; else it is what the rule makes wrong, and the work is that of the energies.

Surfaces that come off under a load are in no equilibrium until they are apart, and the same holds for those that a load
brings together again. What a load does on such a way depends on the inertia that the model leaves out. Its work from
the last equilibrium on then is the least that the change takes, and 0 if energy is set free, which is lost. While
surfaces are apart nothing acts on them, and neither work nor losses change.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from ..parallel.slab import Array
from ..physics.body import Trial
from ..physics.measures import Measures
from ..scene import Scene
from ..solve.adhesive import kernels
from ..solve.contact import Contact

LEAST_SNAP = 1e-4  # accuracy: of the energies of a step: less cannot be told from none
VIEWS_APART = 0.3  # accuracy: of the tangential force, by which that of energy may differ


class StickingEnergies(NamedTuple):
    """Energies [J] since the start: the `work` of the rigid surface, the energy of the `surfaces`, 0 far apart, and
    what was `lost` in snaps."""

    work: float = 0.0
    surfaces: float = 0.0
    lost: float = 0.0


NO_ENERGIES = StickingEnergies()


class Pushed(NamedTuple):
    """Work of the load along its path, up to the last equilibrium [J]; `jumps` where the path has left that: surfaces
    came off, or were brought together."""

    work: float
    jumps: bool


@dataclass
class PathWork:
    """Work of the load along its path by the trapezoidal rule, for the modulus 1 [J]; 0 where no energies are asked
    for."""

    scene: Scene
    approach: float
    pressure: float
    total: float = 0.0

    def go_on(self, contact: Contact) -> None:
        """Add the work up to a contact; collective."""
        if (energy := self.scene.energy) is None:
            return
        pressure = self.scene.slab.sum(float(contact.p.sum()))[0] / self.scene.slab.points
        mean, way = 0.5 * (self.pressure + pressure), contact.d - self.approach
        self.total += energy.unit * self.scene.slab.points * mean * way
        self.approach, self.pressure = contact.d, pressure


def after_step(
    scene: Scene,
    past: StickingEnergies,
    gap: Array,
    trial: Trial,
    pushed: Pushed,
    detached: bool,
    body: float,
    before: Measures,
    measures: Measures,
    moved: tuple[float, float],
) -> StickingEnergies:
    """Return the energies after a step to a gap, or to surfaces that are `detached`, in which the load has `pushed` and
    the body has gained an energy [J], while the surface has moved [m]; collective."""
    law = scene.law(trial.alpha)
    assert scene.energy is not None
    assert law is not None
    sum_gamma = 0.0 if detached else scene.slab.sum(kernels.surface_energy(law, gap))[0]
    surfaces = sum_gamma * trial.alpha * scene.energy.unit
    gained = body + surfaces - past.surfaces
    dragged, doubt = _drag(before, measures, moved)
    area, way = scene.choices.grid.lx * scene.choices.grid.ly, measures.approach - before.approach
    work = pushed.work + dragged
    if pushed.jumps:
        work = max(work, gained)
    else:
        doubt += 0.5 * area * abs((measures.pressure - before.pressure) * way)
    lost = work - gained
    snaps = lost > doubt + LEAST_SNAP * (abs(gained) + abs(surfaces))
    return StickingEnergies(past.work + (work if snaps else gained), surfaces, past.lost + (lost if snaps else 0.0))


def _drag(before: Measures, now: Measures, moved: tuple[float, float]) -> tuple[float, float]:
    """Return the work of sliding a way without the friction of the interface, and how wrong it may be [J]."""
    (x, y), slid = moved, math.hypot(*moved)
    if not slid:
        return 0.0, 0.0
    works = [-(one.force_x * x + one.force_y * y) - one.force_interface * slid for one in (before, now)]
    return 0.5 * sum(works), 0.5 * abs(works[1] - works[0]) + VIEWS_APART * abs(works[1])
