"""Strains of bands in steady sliding: the waves of all bands strain each band, and strains and moduli are found in
rounds."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from ...bands.band import Means
from ...bands.cascade import Results, by_power
from ...bands.choice import Cut
from ...bands.road_sliding import RoadSliding
from ...contact.problem import Contact
from ...job import Job
from ...march.scene import Setup
from ...march.steady import Point
from ...parallel.slab import Array
from .steady import SHARE, Vector, depths_between, strains_of


class StrainProbe:
    """Measures in the contacts of a band the mean square strain S(z) at all depths, and the weights of S(z) in the
    square of the strain of this band (`effects.softening.steady`)."""

    means: ClassVar[Means] = {"squares": by_power, "strain_weights": by_power}

    def __init__(self, job: Job, cut: Cut) -> None:
        self._depths = depths_between(float(cut.edges[0]), float(cut.edges[-1]))

    def slide(self, setup: Setup, velocity: Vector) -> None:
        """Do nothing, as this probe prepares nothing for a velocity."""

    def measure(self, setup: Setup, contact: Contact, velocity: Vector) -> dict[str, Array]:
        """Return the mean squares S(z) as `squares`, and their weights as `strain_weights`, for a contact; both have
        the shape (depths,)."""
        depths, all_waves = self._depths / setup.units.length, np.zeros(setup.fft.shape, np.int64)
        found = strains_of(setup, contact.u, velocity, depths, all_waves, 1)
        return {"squares": found.squares, "strain_weights": found.weights[0]}


def probes(job: Job, cut: Cut) -> Iterator[StrainProbe]:
    """Yield the probe that measures the strains of bands, if the job has a `softening` section."""
    if job.section("softening") is not None:
        yield StrainProbe(job, cut)


class StrainsOfBands:
    """The loop that finds the strains of bands.

    The strain for the next round is a power mean of the old and the new strain of a band. The first round of a state
    starts from the strains of the last state.
    """

    moves = True
    words: ClassVar[tuple[str, str]] = ("strains", "")

    def __init__(self, job: Job, cut: Cut) -> None:
        self._table = job.section("softening").made
        self._strains = np.full(cut.count, self._table.start)
        self._enough = SHARE * job.numerics.asked.both[0]

    def begin(self, road: RoadSliding) -> None:
        """Do nothing. The strains of the last state are kept, from which the new state starts."""

    def act(self, road: RoadSliding) -> None:
        road.set_factors(self._table.at, self._strains.tolist())

    def settles(self, road: RoadSliding, results: Results, changes: tuple[float, float], others: bool) -> bool:
        return changes[0] <= self._enough

    def move(self, road: RoadSliding, results: Results) -> None:
        self._strains = self._table.mixed(_strains_in(results), self._strains)

    def found(self, road: RoadSliding, point: Point, results: Results, changes: tuple[float, float]) -> Point:
        """Return the point with its strain amplitude added. This is the root of the mean square strain of all bands,
        weighted by their friction; NaN without friction."""
        weights = np.maximum([result.friction for result in results], 0.0)
        whole = math.sqrt(np.average(_strains_in(results) ** 2, weights=weights)) if weights.any() else math.nan
        return replace(point, errors=point.errors.with_rounds(*changes)).with_effect("softening", whole)

    def values(self, results: Results) -> Mapping[str, Sequence[float]]:
        return {"strain_amplitude": _strains_in(results).tolist()}


def _strains_in(results: Results) -> Array:
    """Return the strain of each band [-], which the waves of all bands cause, shape (bands,)."""
    squares = np.sum([result.found["squares"] for result in results], axis=0)
    return np.sqrt([result.found["strain_weights"] @ squares for result in results])


def loops(job: Job, cut: Cut) -> Iterator[StrainsOfBands]:
    """Yield the loop that finds the strains of bands, if the job has a `softening` section."""
    if job.section("softening") is not None:
        yield StrainsOfBands(job, cut)
