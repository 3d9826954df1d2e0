"""The steps of one band through a history, under one pressure of its ladder, with the closing of all finer bands."""

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from ..contact.problem import Box, Constraint
from ..job.history import Step
from ..march.laws import ClosingLaw
from ..march.loop import March, run_steps
from ..march.scene import build_on
from ..march.steady import start_march
from ..parallel.slab import Array
from .band import Band, PressureLadder, Rung, rung_errors
from .band_steps import BEFORE, Place

LawAt = Callable[[Place], Constraint]
NOTHING: Array = np.zeros(0)
NONE: Array = np.zeros(1)  # of what only steady states have


class BandMarch:
    """Marches of one band: calculations step by step through its history. A march gives a `Rung`, whose numbers have a
    first axis over the places of `clock`: the track under this pressure. Its friction is along +x, by slopes."""

    def __init__(self, band: Band) -> None:
        self.band = band
        self.scene = build_on(band.setup)
        self.scene.probe = band.probe

    def march(
        self, pressure: float, law: LawAt | None, place: Callable[[Step], Place], below: PressureLadder | None
    ) -> Rung:
        """Return the results at all places of the history under a mean pressure [Pa], with the distribution of pressure
        over `below`, the ladder of the next finer band. Without a `law` finer bands are absent. Raises RunError if a
        step fails."""
        scene, rows = self.scene, list[Rung]()
        scene.law = ClosingLaw(scene, lambda step: law(place(step))) if law is not None else None
        march = self._begin(pressure, law)
        if self.band.setup.job.initial.state == "steady":
            rows.append(self._measure(march, pressure, below))
        steps = (step._replace(load=pressure) for step in march.timeline())  # all: the clock has a place for each
        run_steps(march, [lambda march: rows.append(self._measure(march, pressure, below))], steps)
        return track_of(rows)

    def _begin(self, pressure: float, law: LawAt | None) -> March:
        scene, band, initial = self.scene, self.band, self.band.setup.job.initial
        if initial.state == "virgin":
            return start_march(scene)
        band.slide(initial.velocity)
        contact = band.contact(pressure, law(Place(0, BEFORE)) if law is not None else Box())
        seen = contact.p, 1.0, contact.u, band.heights, contact.d, contact.p > 0.0
        measures = scene.probe.measure(*seen, (0.0, 0.0), initial.velocity)
        facts = {"certificate": contact.certificate, "operator_calls": contact.iterations}
        return start_march(scene, contact, measures=measures, **facts)

    def _measure(self, march: March, pressure: float, below: PressureLadder | None) -> Rung:
        row, last, units, grid = march.row, march.state.contact.last, self.scene.units, self.scene.choices.grid
        m, pressures = row.measures, last.pressure * (last.alpha * units.pressure)
        weights, lost = below.weights_of_rungs(pressures) if below is not None else (NOTHING, 0.0)
        friction = -m.force_x / (pressure * grid.lx * grid.ly)
        values: Any = (
            *(pressure, friction, friction, m.contact_area, m.contact_area_corrected, m.approach, m.max_pressure),
            *(weights, lost, NONE, {}, rung_errors(row.errors)),
            *(row.certificate.worst, row.certificate.penetration, float(row.operator_calls)),
        )
        return Rung(*values)


def track_of(rows: Sequence[Rung]) -> Rung:
    """Return the results at successive places of a history as one `Rung`, whose arrays have the place as first axis."""
    values: dict[str, Any] = {name: np.array([getattr(row, name) for row in rows]) for name in NAMES}
    return Rung(**values, found={})


def instant_of(track: Rung, before: int, after: int, share: float, sign: float = 1.0) -> Rung:
    """Return the results of `track` interpolated between two places; friction is taken along `sign` times x."""

    def between(values: Any) -> Any:
        return (1.0 - share) * values[before] + share * values[after]

    found = Rung(**{name: between(getattr(track, name)) for name in NAMES}, found={})
    return replace(found, friction=sign * found.friction, friction_slopes=sign * found.friction_slopes)


NAMES = tuple(each.name for each in fields(Rung) if each.name != "found")
