"""Power that the edges of contact lose in waves which a mesh does not have.

Pressure rises from an edge of contact as the root of the distance, so that its waves of wavenumber q across the edge
have a mean square that falls as q^-3. A steadily sliding surface loses power in them in proportion to

    q^-3 sin delta(q v),

with the loss angle delta of the body at the frequency with which they pass. For Hertz's contacts of a body whose loss
angle grows with the frequency, all waves together lose as much as this law does from a wavenumber q0 on:

    q0 = 2/(pi a) for a strip of half width a,      q0 = 3/(pi a) for a circle of radius a,

from the integrals of J1(x)^2/x and j1(x)^2. A mesh of cells of length dx has waves up to Q = pi/dx. The others lose

    (q0/Q)^2 M(Q v)/M(q0 v),      M(w) = int_0^1 2 t sin delta(w/t) dt

of all, which is s m with s = q0/Q and m = s M(Q v)/M(q0 v). Far below the frequencies of the body m is 1, and what is
lost of the first order in the cell. Far above m is s^2.
"""

import math

import numpy as np

from ..physics.prony import Prony, complex_modulus

STRIP, CIRCLE = 2.0 / math.pi, 3.0 / math.pi  # physics: q0 times the half width, and times the radius
NODES = 16  # accuracy: of the integral, within 2 % of it for one branch
AT, WEIGHTS = np.polynomial.legendre.leggauss(NODES)


def lost_in_short_waves(prony: Prony, radius: float, speed: float, straight: bool) -> tuple[float, float]:
    """Return s and m of the module, where spots of contact of a `radius` in cells, or `straight` ones of that half
    width, slide by so many cells in a second; both are 1 at most, and 0 where there are no edges or no losses."""
    if radius == math.inf or not prony.moduli.size:
        return 0.0, 0.0
    first = (STRIP if straight else CIRCLE) / radius if radius > 0.0 else math.inf
    if first >= math.pi:
        return 1.0, 1.0
    share = first / math.pi
    return share, share * _mean_loss(prony, math.pi * speed) / _mean_loss(prony, first * speed)


def _mean_loss(prony: Prony, frequency: float) -> float:
    """Return M at a frequency [rad/s]."""
    t = 0.5 * (1.0 + AT)
    modulus = complex_modulus(frequency / t, *prony)
    return float(np.sum(WEIGHTS * t * (modulus.imag / np.abs(modulus))))
