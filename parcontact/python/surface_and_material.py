"""Surfaces and materials without a simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..effects.relaxation import relaxation_of
from ..parallel.slab import Slab
from ..physics import prony
from ..scene import set_up
from .given_jobs import of_parts

Array = NDArray[np.float64]
Surface = Mapping[str, Any] | NDArray[Any] | Sequence[Mapping[str, Any] | NDArray[Any]]


def surface(surface: Surface, grid: Mapping[str, Any]) -> Array:
    """Return the heights [m] of a job's `surface` on its `grid`, shape (ny, nx), positive into the body.

    The surface may be an array. Works on this rank only. Raises JobError for mistakes, InputError for files that do not
    match.
    """
    job = of_parts(surface=surface, grid=grid)
    base = set_up(job, Slab.alone(*job.grid.points))
    heights = base.surface.heights((0.0, 0.0), base.slab.empty())
    return np.asarray(heights * base.units.height + base.surface.datum)


def material(material: Mapping[str, Any]) -> Material:
    """Return the material of a job's section. Raises JobError for mistakes."""
    job = of_parts(material=material)
    spring, moduli, times = relaxation_of(job.material)
    return Material(spring, tuple(moduli.tolist()), tuple(times.tolist()), job.material.poisson)


@dataclass(frozen=True)
class Material:
    """A linear viscoelastic material, `G(t) = modulus_inf + sum moduli exp(-t/relaxation_times)` [Pa, s].

    All moduli are shear moduli; `poisson` is constant in time.
    """

    modulus_inf: float
    moduli: tuple[float, ...]
    relaxation_times: tuple[float, ...]
    poisson: float

    def complex_modulus(self, omega: ArrayLike) -> NDArray[np.complex128]:
        """Return storage and loss modulus [Pa] as real and imaginary part at angular frequencies [rad/s] of any
        shape."""
        return prony.complex_modulus(omega, *self._series)

    def relaxation(self, t: ArrayLike) -> Array:
        """Return the relaxation modulus G(t) [Pa] at times t >= 0 [s] of any shape."""
        return prony.relaxation(t, *self._series)

    def creep(self, t: ArrayLike) -> Array:
        """Return the creep compliance J(t) [1/Pa] at times t >= 0 [s] of any shape."""
        return prony.creep(t, *self._series)

    @property
    def _series(self) -> tuple[float, tuple[float, ...], tuple[float, ...]]:
        return self.modulus_inf, self.moduli, self.relaxation_times
