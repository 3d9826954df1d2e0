"""Influence coefficients of an isolated sliding contact, including the wake of the surface in the body.

At the velocity v a body point that is now at x was at `x + v t` a time t ago. With the creep function

    J(t) = J_g + sum J_i (1 - exp(-t/l_i)),

the influence coefficients are Love's A(x) plus, for each term, an integral along the wake (for G = 1):

    K(x) = J_g A(x) + sum J_i int_0^inf exp(-t/l_i)/l_i A(x + v t) dt.
"""

import math

import numpy as np

from ..compiled import loop
from ..parallel.slab import Array
from .love import love, over_cell
from .prony import CreepSpectrum

Vector = tuple[float, float]
GAUSS = np.polynomial.legendre.leggauss(6)
LOCAL = 1e-4  # accuracy: creep length over a cell below which creep is instantaneous
NEAR = 2.0  # accuracy: distance [cells] below which panels resolve the edge of the loaded cell
FAR = 16.0  # accuracy: distance [cells] beyond which two terms of the expansion of A are used; error 1e-7
DECAYED = 40.0  # accuracy: distance over creep length at which integrals end, exp(-40)


def wake(x: Array, y: Array, dx: float, dy: float, velocity: Vector, creep: CreepSpectrum) -> Array:
    """Return K(x, y) above for a `dx x dy` cell under unit pressure, nu = 1/2; shapes broadcast."""
    speed = float(np.hypot(*velocity))
    lengths = speed * creep.retardation_times
    short = lengths <= LOCAL * min(dx, dy)
    local = creep.glass + float(creep.compliances[short].sum())
    near = local * love(x, y, dx, dy)
    if np.all(short):
        return near
    direction = (velocity[0] / speed, velocity[1] / speed)
    weights, lasting = creep.compliances[~short], lengths[~short]
    if velocity[1] == 0.0 and x.shape[0] == y.shape[1] == 1:
        order = np.argsort(direction[0] * x[0], kind="stable")
        ahead = direction[0] * x[0, order]
        if np.allclose(np.diff(ahead), dx, rtol=1e-6):
            along = np.empty((y.size, x.size))
            along[:, order] = _sweep(ahead, y[:, 0], dx, dy, weights, lasting)
            return near + along
    x, y = np.broadcast_arrays(x, y)
    return near + _over_memory(np.ascontiguousarray(x), np.ascontiguousarray(y), dx, dy, direction, weights, lasting)


def _over_memory(x: Array, y: Array, dx: float, dy: float, direction: Vector, weights: Array, lengths: Array) -> Array:
    out = np.empty(x.shape)
    _integrate(x, y, dx, dy, direction, weights, lengths, *GAUSS, out)
    return out


def _sweep(x: Array, y: Array, dx: float, dy: float, weights: Array, lengths: Array) -> Array:
    """Return the integrals along +x for rising x at distances dx and for all y, from the last cell back to the first:

        K(x) = int_0^dx exp(-s/l)/l A(x + s) ds + exp(-dx/l) K(x + dx).

    This evaluates A at a few points per cell; separate integrals would need hundreds.
    """
    shortest = float(lengths.min())
    near, near_shares = _within_cell(dx, shortest, edge=True)
    far, far_shares = _within_cell(dx, shortest, edge=False)
    rate = (weights / lengths)[:, None]
    near_memory, far_memory = (
        shares * np.exp(-s / lengths[:, None]) * rate for s, shares in ((near, near_shares), (far, far_shares))
    )
    ends = np.empty((lengths.size, y.size))
    last, rows = np.full((y.size, 1), x[-1]), np.ascontiguousarray(y.reshape(-1, 1))
    for k in range(lengths.size):
        ends[k] = _over_memory(last, rows, dx, dy, (1.0, 0.0), weights[k : k + 1], lengths[k : k + 1])[:, 0]
    out = np.empty((y.size, x.size))
    _recur(x, y, dx, dy, near, far, near_memory, far_memory, np.exp(-dx / lengths), ends, out)
    return out


def _within_cell(dx: float, shortest: float, edge: bool) -> tuple[Array, Array]:
    """Return Gauss points and weights on (0, dx). Panels grow from the shortest memory and, with `edge`, shrink towards
    dx/2, where the slope of A has a logarithm at the edge of the loaded cell."""
    ends = shortest * 2.0 ** np.arange(max(math.ceil(math.log2(dx / shortest)), 0))
    if edge:
        steps = 0.5 * dx * 4.0 ** -np.arange(4.0)
        ends = np.concatenate([ends, [0.5 * dx], 0.5 * dx - steps, 0.5 * dx + steps])
    edges = np.unique([0.0, *ends[ends < dx], dx])
    half = 0.5 * np.diff(edges)[:, None]
    return (edges[:-1, None] + half * (1.0 + GAUSS[0])).ravel(), (half * GAUSS[1]).ravel()


@loop
def _recur(x, y, dx, dy, near, far, near_memory, far_memory, decay, ends, out):  # type: ignore[no-untyped-def]
    """Make the recursion of `_sweep` from the values at the last x; `near` are the nodes close to the loaded cell."""
    for j in range(y.size):
        kept = ends[:, j].copy()
        out[j, -1] = kept.sum()
        for i in range(x.size - 2, -1, -1):
            close = abs(x[i]) < NEAR * dx and abs(y[j]) < NEAR * dy
            nodes, memory = (near, near_memory) if close else (far, far_memory)
            kept *= decay
            for n in range(nodes.size):
                there = _love(x[i] + nodes[n], y[j], dx, dy)
                for k in range(kept.size):
                    kept[k] += memory[k, n] * there
            out[j, i] = kept.sum()


@loop
def _integrate(x, y, dx, dy, direction, weights, lengths, nodes, shares, out):  # type: ignore[no-untyped-def]
    """Put the integral over s > 0 of `sum weights/lengths exp(-s/lengths) A(x + s direction)`, nu = 1/2, into `out`.

    Gauss panels are no longer than the scale of the integrand: the shortest memory length, later s itself; and half
    the distance from the cell, or its edge.
    """
    cell = min(dx, dy)
    shortest, end = lengths.min(), DECAYED * lengths.max()
    for j in range(x.shape[0]):
        for i in range(x.shape[1]):
            total, s = 0.0, 0.0
            while s < end:
                distance = np.hypot(x[j, i] + s * direction[0], y[j, i] + s * direction[1])
                step = min(max(shortest, s), 0.1 * cell + 0.5 * max(distance - cell, 0.0), end - s)
                for node, share in zip(nodes, shares):  # noqa: B905  # numba has no strict zip
                    t = s + 0.5 * step * (1.0 + node)
                    memory = 0.0
                    for k in range(lengths.size):
                        memory += weights[k] / lengths[k] * np.exp(-t / lengths[k])
                    there = _love(x[j, i] + t * direction[0], y[j, i] + t * direction[1], dx, dy)
                    total += 0.5 * step * share * memory * there
                s += step
            out[j, i] = total


@loop
def _love(x, y, dx, dy):  # type: ignore[no-untyped-def]
    """Return Love's displacement for nu = 1/2; far away the first two terms of its expansion in the size of
    the cell."""
    r2 = x * x + y * y
    if r2 > FAR**2 * max(dx, dy) ** 2:
        r = np.sqrt(r2)
        correction = (dx * dx * (3 * x * x - r2) + dy * dy * (3 * y * y - r2)) / (24 * r2 * r2)
        return dx * dy / r * (1.0 + correction) / (4 * np.pi)
    return over_cell(x, y, dx, dy) / (4 * np.pi)
