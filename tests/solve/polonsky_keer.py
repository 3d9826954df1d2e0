"""The textbook solver, as an oracle: written anew, without a preconditioner, and with nothing of ours.

I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206: conjugate gradients on the points in contact; a point that penetrates
while it carries no pressure is put into contact by a step of its own, and the next direction starts from scratch.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

Map = NDArray[np.float64]


def displacement(pressure: Map, size: tuple[float, float], poisson: float = 0.5) -> Map:
    """`u^ = (1 - nu)/|q| p^` of the periodic half space of shear modulus 1, on a box of `size = (lx, ly)`."""
    ny, nx = pressure.shape
    waves = np.hypot(fft.rfftfreq(nx, size[0] / nx)[None, :], fft.fftfreq(ny, size[1] / ny)[:, None])
    q = 2 * np.pi * waves
    q[0, 0] = np.inf
    return np.asarray(fft.irfft2((1 - poisson) / q * fft.rfft2(pressure), s=pressure.shape))


def solve(heights: Map, mean: float, size: tuple[float, float], tolerance: float) -> tuple[Map, int]:
    """Pressures of a given mean, and the iterations it took until they change by less than `tolerance` of their sum."""
    p = np.full_like(heights, mean)
    t, old_product, keep = np.zeros_like(p), 1.0, False
    for iteration in range(1, 10_000):
        g = displacement(p, size) - heights
        touching = p > 0
        g -= g[touching].mean()
        product = float(np.sum(g[touching] ** 2))
        t = np.where(touching, g + (product / old_product * t if keep else 0.0), 0.0)
        old_product = product
        r = displacement(t, size)
        r -= r[touching].mean()
        step = np.sum(g[touching] * t[touching]) / np.sum(r[touching] * t[touching])
        old = p.copy()
        p[touching] -= step * t[touching]
        p[p < 0] = 0
        entering = (p == 0) & (g < 0)
        keep = not entering.any()
        p[entering] -= step * g[entering]
        p *= mean * p.size / p.sum()
        if np.abs(p - old).sum() < tolerance * p.sum():
            return p, iteration
    raise RuntimeError("the oracle did not converge")
