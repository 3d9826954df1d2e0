"""Waves and shapes with their formulas, for tests of heights and of forces."""

from collections.abc import Callable

import numpy as np

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.surface import Round, Shape, Surface, single_wave

from .maps import coordinates

SIZE = (2e-3, 5e-4)
A = 5e-7
Wave = tuple[float, tuple[int, int], float]  # amplitude, waves along x and y, phase
WAVES: list[Wave] = [(A, (3, 0), 0.0), (0.5 * A, (-2, 4), 0.7), (0.3 * A, (1, -5), -2.0), (0.1 * A, (0, 2), 1.0)]


def surface_of(slab: Slab, waves: list[Wave]) -> Surface:
    fft = FFT(slab)
    transform = np.sum([single_wave(fft, *wave) for wave in waves], axis=0)
    return Surface(slab, fft, SIZE, transform)


def heights_of(slab: Slab, waves: list[Wave], shift: tuple[float, float] = (0.0, 0.0)) -> Array:
    x, y = coordinates(slab, SIZE)
    phases = (2 * np.pi * (n[0] * (x - shift[0]) / SIZE[0] + n[1] * (y - shift[1]) / SIZE[1]) + s for _, n, s in waves)
    return np.sum([wave[0] * np.cos(phase) for wave, phase in zip(waves, phases, strict=True)], axis=0)


def slopes_of(slab: Slab, waves: list[Wave], shift: tuple[float, float] = (0.0, 0.0)) -> list[Array]:
    """Exact slopes along x and y: those of a wave are the wave a quarter of a period ahead, times the wavenumber."""
    return [
        heights_of(slab, [(a * 2 * np.pi * n[axis] / SIZE[axis], n, phase + np.pi / 2) for a, n, phase in waves], shift)
        for axis in (0, 1)
    ]


R = 1.1e-3
CENTRE = (9e-4, 2.1e-4)
SHAPES: dict[str, tuple[Shape, Callable[[Array, Array], Array]]] = {
    "paraboloid": (Round(R, CENTRE), lambda x, y: -(x**2 + y**2) / (2 * R)),
    "sphere": (Round(R, CENTRE, exact=True), lambda x, y: np.sqrt(R**2 - x**2 - y**2) - R),
    "parabola along y": (Round(R, CENTRE, (1.0, 0.0)), lambda x, y: -(x**2) / (2 * R) + 0 * y),
    "cylinder along y": (Round(R, CENTRE, (1.0, 0.0), exact=True), lambda x, y: np.sqrt(R**2 - x**2) - R + 0 * y),
    "parabola along x": (Round(R, CENTRE, (0.0, 1.0)), lambda x, y: -(y**2) / (2 * R) + 0 * x),
    "cylinder along x": (Round(R, CENTRE, (0.0, 1.0), exact=True), lambda x, y: np.sqrt(R**2 - y**2) - R + 0 * x),
}
