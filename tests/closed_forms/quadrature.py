"""Quadrature for integrands that change fast near one or both ends of their range, on whatever scale."""

from functools import cache

import numpy as np

from parcontact.theory.wavy import Array


@cache
def graded_rule(order: int = 10, halvings: int = 52) -> Array:
    """Rows x, 1 - x and weights on (0, 1), shape (3, 2 order halvings).

    Gauss rules of `order` points on panels that halve towards both ends. Converges for endpoint
    singularities like x^(-1/2) to about 1e-8 and like x^(1/2) to rounding.
    """
    nodes, weights = np.polynomial.legendre.leggauss(order)
    stops = np.concatenate([[0.0], 0.5 ** np.arange(halvings, 0, -1)])
    widths = np.diff(stops)[:, None]
    near = (stops[:-1, None] + widths * (1 + nodes) / 2).ravel()
    shares = (widths * weights / 2).ravel()
    return np.array([np.append(near, 1 - near), np.append(1 - near, near), np.append(shares, shares)])
