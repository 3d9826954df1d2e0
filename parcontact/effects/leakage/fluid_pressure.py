"""Pressure of a fluid that flows along x through a map of gaps, found together with the contact in rounds.

In contact and in closed pools the flow does not determine the pressure. A small leak eps determines it there, which is
SMALL times the mean of g^3:

    div((g^3 + eps) grad p) = 0                            for a liquid,
    div((g^3 + 6 lambda g^2 + eps) grad p^2) = 0           for a gas.

The pressure falls from p1 at the high end to p2 at the low end. The unknown of the rounds is the share s, which falls
from 1 to 0:

    p = p2 + s (p1 - p2)            for a liquid,
    p^2 = p2^2 + s (p1^2 - p2^2)    for a gas.

Each round solves the contact under the pressure of the fluid, and then the flow through its gap, which gives another
map of s. Anderson's method (D. G. Anderson, J. ACM 12 (1965) 547) finds the map for the next round from this round and
the `DEPTH` rounds before it. Near percolation, pools open and close again. Therefore, after `ANDERSON` rounds, each
cell changes its s by a part of the difference of both maps only, and this part is halved whenever the difference
changes its sign. If the rounds have not settled after `EACH` of them, they go on with an eps that is `GROWTH` times as
large, and begin again with Anderson's method.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .flow import Balance, PressureDrop, flow_mesh_error, least_section, solve_flow

Map = NDArray[np.floating]
SMALL = 1e-9  # accuracy: small leak over the mean of g^3
DEPTH = 3  # tuning: differences of earlier rounds
ANDERSON = 9  # tuning: rounds of Anderson's method
SHORTER, LONGER, LEAST = 0.5, 1.1, 0.01  # tuning: factors of the part of its change that a cell makes, and the least
EACH, GROWTH = 20, 100.0  # tuning: rounds with one small leak, and its growth after these
MOST_REST = 5.0  # tuning: largest sum of further changes over the next one
RIDGE = 1e-12  # rounding: of the products of differences
SETTLED = 1e-4  # accuracy: estimated relative error of the flow by the rounds, and rms error of the share


def pressure_of(drop: PressureDrop, share: Map) -> Map:
    """Return the map of the fluid's pressure above ambient [Pa], from a map of the share s of the pressure drop."""
    if drop.fluid.molar_mass is None:
        return drop.low + share * (drop.high - drop.low) - drop.outside
    return np.sqrt(drop.low**2 + share * (drop.high**2 - drop.low**2)) - drop.outside


def linear_share(shape: tuple[int, int]) -> Map:
    """Return the share s of the pressure drop in a gap of constant height, a map of `shape` (ny, nx)."""
    row = 1.0 - (np.arange(shape[1]) + 0.5) / shape[1]
    return np.broadcast_to(row, shape).copy()


def conducting(gap: Map, drop: PressureDrop, share: Map) -> Map:
    """Return the map of gaps [m] through which as much fluid would flow without slip as flows through `gap` [m] with
    slip. `share` is the map of s, which gives the local pressure."""
    if not drop.mean_free_path:
        return gap
    local = np.maximum(pressure_of(drop, share) + drop.outside, 0.0)
    path = drop.mean_free_path * drop.pressures[0] / np.maximum(local, 1e-3 * drop.high)
    return np.asarray(np.cbrt(gap**2 * (gap + 6.0 * path)))


@dataclass(frozen=True)
class Filled:
    """The map of the share s of the pressure drop in all cells, shape (ny, nx), and the conductivity of the gap [m^3]
    including the small leak."""

    share: Map
    conductivity: float


def fill_share(gap: Map, size: tuple[float, float], small: float = SMALL) -> Filled:
    """Return the share s of the pressure drop in all cells and the conductivity, for a map of conducting gaps [m],
    shape (ny, nx), on a box of `size` (lx, ly) [m]. `small` is the small leak, divided by the mean of g^3."""
    cubes = gap.T**3
    mean = float(cubes.mean())
    resistances = 1.0 / (cubes / mean + small) if mean > 0.0 else np.ones(cubes.shape)
    balance, given = Balance(resistances, size[1] / size[0] * gap.shape[1] / gap.shape[0], True), np.zeros(cubes.shape)
    given[0] = balance.first
    share = balance.solve(given)
    return Filled(share.T.copy(), mean * balance.power(share) * size[0] / size[1])


class Rounds:
    """The rounds of one step for a pressure drop on a box of `size` (lx, ly) [m]. The object keeps the maps of earlier
    rounds, and lives on root only."""

    def __init__(self, drop: PressureDrop, size: tuple[float, float]) -> None:
        self._drop, self._size, self.count = drop, size, 0
        self._shares, self._residuals = list[Map](), list[Map]()
        self.conductivity, self.error = 0.0, math.inf
        self._parts, self._small = np.ones(()), SMALL
        self._last: tuple[Map, Map] | None = None

    def advance(self, gap: Map, share: Map, most: float) -> tuple[tuple[bool, bool, float], Map]:
        """Make a round: find the flow through the map `gap` [m], which belongs to the contact under the fluid's
        pressure for the map `share` of s.

        Return two items. The first one tells whether the rounds have settled, whether the fluid lifts the seal off, and
        the estimated relative error of the flow. The second one is the map of s for the next round, whose mean pressure
        is at most `most` [Pa].
        """
        if self.count and self.count % EACH == 0:
            self._restart()
        self.count += 1
        drop, last = self._drop, self.conductivity
        filled = fill_share(conducting(gap, drop, share), self._size, self._small)
        change = abs(filled.conductivity / last - 1.0) if last else math.inf
        self.conductivity = filled.conductivity
        mean, wanted = (float(pressure_of(drop, one).mean()) for one in (share, filled.share))
        lifted = mean >= (1.0 - SETTLED) * most and wanted >= most
        rest = self._rest(share, filled.share)
        moved = rest * math.sqrt(float(np.mean((filled.share - share) ** 2)))
        settled = drop.high == drop.low or (rest * change < SETTLED and moved < SETTLED)
        self.error = rest * change
        if lifted or settled:
            return (settled and not lifted, lifted, self.error), share
        by_cells = (self.count - 1) % EACH >= ANDERSON
        mixed = self._damped(share, filled.share, rest) if by_cells else self._mixed(share, filled.share)
        following = np.clip(mixed, 0.0, 1.0)
        then = float(pressure_of(drop, following).mean())
        if then > most:
            following = (
                share + max(0.0, (most - mean) / (then - mean)) * (following - share) if mean < most else filled.share
            )
        return (False, False, self.error), following

    def _restart(self) -> None:
        """Forget the rounds so far, and go on with a larger leak."""
        self._small *= GROWTH
        self._shares.clear()
        self._residuals.clear()
        self._parts, self._last = np.ones(()), None

    def _rest(self, share: Map, found: Map) -> float:
        """Return the sum of all changes still to come, divided by the next one, as the changes of the last two rounds
        predict it (A. C. Aitken)."""
        residual, last = found - share, self._last
        self._last = share, residual
        if last is None:
            return 1.0
        change = residual - last[1]
        square = float(np.vdot(change, change))
        return min(max(1.0, -float(np.vdot(share - last[0], change)) / square), MOST_REST) if square else 1.0

    def _damped(self, share: Map, found: Map, rest: float) -> Map:
        """Return the map of s for the next round, in which each cell changes by a part of the difference
        `found - share`."""
        residual, last = found - share, self._residuals[-1]
        self._parts = np.where(last * residual < 0.0, SHORTER, LONGER) * self._parts
        self._parts = np.clip(self._parts, LEAST, 1.0)
        self._residuals[-1] = residual
        return share + rest * self._parts * residual

    def _mixed(self, share: Map, found: Map) -> Map:
        """Return the map of s for the next round by Anderson's method, from the map `share` of this round and the map
        `found` that its gap gives."""
        self._shares.append(share)
        self._residuals.append(found - share)
        del self._shares[: -DEPTH - 1], self._residuals[: -DEPTH - 1]
        residual = self._residuals[-1]
        changes = np.array([(residual - old).ravel() for old in self._residuals[:-1]])
        if not changes.any():
            return found
        moves = np.array([(share - old).ravel() for old in self._shares[:-1]])
        products = changes @ changes.T
        products[np.diag_indices_from(products)] += RIDGE * np.trace(products) / len(products)
        weights = np.linalg.solve(products, changes @ residual.ravel())
        return share + (residual.ravel() - weights @ (moves + changes)).reshape(share.shape)


def seal_flow(
    gap: Map, drop: PressureDrop, share: Map, size: tuple[float, float], rounds: Rounds | None
) -> dict[str, float]:
    """Return the values of a seal's columns by name, and as `bound` the largest mass flow [kg/s] that inertia lets
    pass, after the last round.

    `gap` [m] and `share` are the maps of the gap and of s, and `size` is (lx, ly) [m]. `rounds` is None if the pressure
    of the fluid is the ambient one everywhere. The gap counts as closed if less flows through it than through the small
    leak.
    """
    filled = 0.0 if rounds is None else rounds.conductivity
    through = conducting(gap, drop, share).astype(np.float64, copy=False)
    flow = solve_flow(through, size, "x", True)
    leaks = max(filled - flow.conductivity, 0.0)
    closed = flow.conductivity <= SMALL * float(np.mean(through**3))
    return {
        "flow_x": 0.0 if closed else flow.conductivity,
        "constriction": 0.0 if closed else flow.constriction,
        "flow_rate": drop.flow_rate(0.0 if closed else flow.conductivity, *size),
        "mass_flow": drop.mass_flow(0.0 if closed else flow.conductivity, *size),
        "error_x": math.nan if closed else flow_mesh_error(through, flow, size, "x", True),
        "error_leak": math.nan if closed else leaks / flow.conductivity,
        "error_rounds": 0.0 if rounds is None or drop.high == drop.low else rounds.error,
        "rounds": 1.0 if rounds is None else float(rounds.count),
        "high_pressure": drop.high,
        "low_pressure": drop.low,
        "fluid_pressure": float(pressure_of(drop, share).mean()),
        "bound": drop.inertial_bound(least_section(gap.astype(np.float64, copy=False), flow, size, "x")),
    }
