"""Adhesion of viscoelastic bodies: the steady crack.

The edge of a contact that opens or closes with the velocity V is a crack with a cohesive zone in which the attraction
sigma0 is constant (Dugdale). Its length is c0 = pi E0 w/(4 sigma0^2) at rest. With the creep compliance C(t) for a unit
stress, `e(t) = E0 C(t)`, which rises from 1/k to 1, the strength of the crack far away is G = c/c0 w, where

    opening   G/w = 1/int_0^1 e((1-x) c/V) F'(x) dx,   F = sqrt x - (1-x)/2 ln((1 + sqrt x)/(1 - sqrt x)),   c = c0 G/w
    closing   G/w = (c/c0) (int_0^1 e((1-x) c/V) dx/(2 sqrt x))^2,   c0/c = int_0^1 e((1-x) c/V) (1/sqrt x - F'(x)) dx

and F'(x) = ln((1 + sqrt x)/(1 - sqrt x))/2. Opening: a point of the face enters the zone at its tip, and its opening
creeps under sigma0. Closing: it enters at the far end, so that sigma0 acts like the elastic traction sigma0 e(t).

Sources: R. A. Schapery, Int. J. Fracture 11 (1975) 141 and 39 (1989) 163; J. A. Greenwood, J. Phys. D 37 (2004) 2557.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from parcontact.physics.prony import Moduli, creep_spectrum
from parcontact.theory.wavy import Array

from .quadrature import graded_rule


def opening_crack(velocity: float, *material: *Moduli) -> float:
    """G/w of a crack that opens with `velocity` = V/c0 (1/s), from 1 at rest to k = G(0)/G(inf)."""
    creep = _relative_creep(*material)
    _, rest, weights, rate = _rule()

    def strength(length: float) -> float:
        return float(1 / (weights @ (creep(rest * length / velocity) * rate)))

    return _solve(lambda length: strength(length) - length, creep)


def closing_crack(velocity: float, *material: *Moduli) -> float:
    """G/w of a crack that closes with `velocity` = V/c0 (1/s), from 1 at rest to 1/k."""
    creep = _relative_creep(*material)
    x, rest, weights, rate = _rule()

    def relative_work(length: float) -> float:
        return float(length * (weights @ (creep(rest * length / velocity) * (1 / np.sqrt(x) - rate))))

    length = _solve(lambda length: 1 - relative_work(length), creep)
    intensity = weights @ (creep(rest * length / velocity) / (2 * np.sqrt(x)))
    return float(length * intensity**2)


def _relative_creep(*material: *Moduli) -> Callable[[ArrayLike], Array]:
    """e(t) = C(t)/C(inf); the body must be a solid."""
    if not material[0] > 0:
        raise ValueError("The modulus at infinite times must be positive: a crack in a liquid does not rest.")
    spectrum = creep_spectrum(*material)
    return lambda t: material[0] * spectrum.compliance(t)


def _rule() -> tuple[Array, Array, Array, Array]:
    """x, 1 - x, weights and F'(x) on (0, 1)."""
    x, rest, weights = graded_rule()
    return x, rest, weights, np.log((1 + np.sqrt(x)) ** 2 / rest) / 2


def _solve(excess: Callable[[float], float], creep: Callable[[ArrayLike], Array]) -> float:
    """The root of what falls with the length c/c0. A closing zone may be a little shorter than at rest."""
    longest = 1 / float(creep(0.0))
    return float(brentq(excess, 0.5, longest * (1 + 1e-6), xtol=1e-14))
