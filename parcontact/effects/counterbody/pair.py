"""Two bodies in contact as one viscoelastic body.

Under one pressure the displacements of both bodies add up, so that with the moduli G(s) = s Gbar(s), where Gbar is the
Laplace transform of the relaxation function, the pair has the modulus M of

    1/M(s) = 1/G1(s) + 1/G2(s)

M is a Prony series again, with M_inf = G1_inf G2_inf/(G1_inf + G2_inf). Its relaxation times are the retardation times
lambda of S = G1 + G2, with the moduli |G1 G2|/(lambda dS/dlambda) at s = -1/lambda. A relaxation time of both
bodies, with the moduli a and b, stays, with a b/(a + b).
"""

import numpy as np

from ...physics.prony import Array, Moduli, Prony, Zero, normal_form, retardation


def pair(first: Moduli, second: Moduli) -> Prony:
    """Return the relaxation function of two bodies that touch, from both relaxation functions [Pa, s].

    The moduli agree with 1/(1/G1 + 1/G2) to rounding. Raises ValueError for numbers that do not define a relaxation
    function.
    """
    one, other = normal_form(*first), normal_form(*second)
    terms, times = np.append(one.moduli, other.moduli), np.append(one.relaxation_times, other.relaxation_times)
    whole = normal_form(one.modulus_inf + other.modulus_inf, terms, times)
    a, b = (_on_times(body, whole) for body in (one, other))
    zeros = retardation(whole)
    products = [
        abs(_at(zero, one, a, whole) * _at(zero, other, b, whole)) for zero in zeros
    ]  # G1 = -G2 but for rounding
    moduli = [product / (zero.time * zero.slope) for product, zero in zip(products, zeros, strict=True)]
    shared = a * b / (a + b)
    spring = one.modulus_inf * other.modulus_inf / whole.modulus_inf if whole.modulus_inf else 0.0
    slow = [zero.time for zero in zeros]
    return normal_form(spring, np.append(shared, moduli), np.append(whole.relaxation_times, slow))


def _on_times(body: Prony, whole: Prony) -> Array:
    """Return the moduli of a body at all relaxation times of the `whole` series [Pa]."""
    found = np.zeros_like(whole.moduli)
    found[np.searchsorted(whole.relaxation_times, body.relaxation_times)] = body.moduli
    return found


def _at(zero: Zero, body: Prony, moduli: Array, whole: Prony) -> float:
    """Return the modulus of a body at s = -1/lambda [Pa]."""
    return body.modulus_inf + float(np.sum(moduli * whole.relaxation_times / zero.distances))
