"""A road whose truth is known: periodic waves, then cut out, tilted, with holes, as an instrument would deliver it."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rough(points: int, length: float, longest: float, shortest: float, slope: float, hurst: float = 0.8) -> Array:
    """A random self-affine map of (points, points) on a square of `length` [m], of rms slope `slope`."""
    dice = np.random.default_rng(4)
    q = 2 * np.pi * np.fft.fftfreq(points, length / points)
    radius = np.hypot(q, q[:, None])
    inside = (radius >= 0.999 * 2 * np.pi / longest) & (radius <= 1.001 * 2 * np.pi / shortest)
    amplitude = np.where(inside, np.maximum(radius, q[1]) ** (-1.0 - hurst), 0.0)
    heights = np.fft.ifft2(amplitude * np.fft.fft2(dice.standard_normal((points, points)))).real
    return np.asarray(heights * (slope / rms_slope(heights, length)))


def rms_slope(heights: Array, length: float) -> float:
    """Of a periodic square map, by its Fourier series."""
    points = heights.shape[0]
    q = 2 * np.pi * np.fft.fftfreq(points, length / points)
    power = np.abs(np.fft.fft2(heights) / heights.size) ** 2
    return float(np.sqrt(np.sum(power * (q**2 + q[:, None] ** 2))))


def central_slope(heights: Array, length: float, margin: int) -> float:
    """The rms slope inside a map, by central differences, which no edge disturbs."""
    step = 2 * length / heights.shape[0]
    x = (heights[1:-1, 2:] - heights[1:-1, :-2]) / step
    y = (heights[2:, 1:-1] - heights[:-2, 1:-1]) / step
    inside = slice(margin, -margin)
    return float(np.sqrt(np.mean((x**2 + y**2)[inside, inside])))
