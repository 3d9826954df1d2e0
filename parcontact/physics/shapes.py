"""Smooth shapes in closed form, evaluated at any position of the surface."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..parallel.slab import Array


class Shape(Protocol):
    """Heights and slopes at distances (x, y) from the centre of the shape; all lengths have one unit."""

    @property
    def centre(self) -> tuple[float, float]: ...

    def height(self, x: Array, y: Array) -> Array: ...

    def slope(self, x: Array, y: Array) -> tuple[Array, Array]: ...


def _paraboloid(r2: Array, radius: float) -> tuple[Array, Array]:
    return -r2 / (2.0 * radius), np.full_like(r2, -1.0 / radius)


def _circle(r2: Array, radius: float) -> tuple[Array, Array]:
    """Return height and slope factor of a circle; beyond the radius the height is the height of the equator."""
    inside = np.minimum(r2, radius**2)
    rest = np.sqrt(radius**2 - inside)
    inverse = np.divide(-1.0, rest, out=np.zeros_like(rest), where=rest > 0.0)
    return -inside / (radius + rest), inverse


def _inverse(distance: Array) -> Array:
    """Return the inverse of a distance, 0 at the centre."""
    return np.divide(1.0, distance, out=np.zeros_like(distance), where=distance > 0.0)


@dataclass(frozen=True)
class Conical:
    """A cone with its tip (0) at the centre."""

    steepness: float
    centre: tuple[float, float]

    def height(self, x: Array, y: Array) -> Array:
        return -self.steepness * np.hypot(x, y)

    def slope(self, x: Array, y: Array) -> tuple[Array, Array]:
        factor = -self.steepness * _inverse(np.hypot(x, y))
        return factor * x, factor * y


@dataclass(frozen=True)
class Pyramidal:
    """A square pyramid with its tip (0) at the centre and sides along x and y; on its edges the slope is the mean of
    both faces."""

    steepness: float
    centre: tuple[float, float]

    def height(self, x: Array, y: Array) -> Array:
        return -self.steepness * np.maximum(np.abs(x), np.abs(y))

    def slope(self, x: Array, y: Array) -> tuple[Array, Array]:
        along_x = 0.5 * (1.0 + np.sign(np.abs(x) - np.abs(y)))
        return -self.steepness * along_x * np.sign(x), -self.steepness * (1.0 - along_x) * np.sign(y)


@dataclass(frozen=True)
class FlatEnded:
    """A round punch: a flat face (0) of a radius, and around it a parabola with the radius of curvature `edge`."""

    radius: float
    edge: float
    centre: tuple[float, float]

    def height(self, x: Array, y: Array) -> Array:
        beyond = np.maximum(np.hypot(x, y) - self.radius, 0.0)
        return -(beyond**2) / (2.0 * self.edge)

    def slope(self, x: Array, y: Array) -> tuple[Array, Array]:
        distance = np.hypot(x, y)
        factor = -np.maximum(distance - self.radius, 0.0) / self.edge * _inverse(distance)
        return factor * x, factor * y


@dataclass(frozen=True)
class Round:
    """A sphere, or a cylinder along x or y, with its highest point (0) at the centre; the profile is parabolic or
    exact."""

    radius: float
    centre: tuple[float, float]
    along: tuple[float, float] = (1.0, 1.0)  # which coordinates the profile depends on
    exact: bool = False

    def _profile(self, x: Array, y: Array) -> tuple[Array, Array]:
        r2 = self.along[0] * x**2 + self.along[1] * y**2
        return (_circle if self.exact else _paraboloid)(r2, self.radius)

    def height(self, x: Array, y: Array) -> Array:
        return self._profile(x, y)[0]

    def slope(self, x: Array, y: Array) -> tuple[Array, Array]:
        factor = self._profile(x, y)[1]
        return self.along[0] * x * factor, self.along[1] * y * factor
