"""Fused loop over the points of a contact that sticks and slips."""

import math

from ..compiled import loop


@loop
def settle_slips(bound, stiffness, alpha, t_x, t_y, alpha_old, old_x, old_y, u_x, u_y, target_x, target_y):
    """Find the points that stick after a step, and set the targets of all others to their displacements u.

    With `s = target - u` a point sticks if `|t + stiffness s|` is below its bound. This is exact for exact tractions,
    where s is 0 or `|t|` is the bound, and it does not depend on the last digits of tractions. Every other point loses
    `(alpha t + alpha_old t_old)/2 s`, or 0 if this is negative. Return the sums of losses, of t along x, of t along y
    and of bounds, and the number of points that stick.
    """
    lost, total_x, total_y, most, stuck = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(bound.shape[0]):
        sums = [0.0, 0.0, 0.0, 0.0, 0.0]
        for i in range(bound.shape[1]):
            a, b, limit = t_x[j, i], t_y[j, i], bound[j, i]
            s_x, s_y = target_x[j, i] - u_x[j, i], target_y[j, i] - u_y[j, i]
            sums[1] += a
            sums[2] += b
            sums[3] += limit
            if limit > 0.0 and math.hypot(a + stiffness * s_x, b + stiffness * s_y) < limit:
                sums[4] += 1.0
                continue
            mean_x, mean_y = alpha * a + alpha_old * old_x[j, i], alpha * b + alpha_old * old_y[j, i]
            sums[0] += max(0.5 * (mean_x * s_x + mean_y * s_y), 0.0)
            target_x[j, i], target_y[j, i] = u_x[j, i], u_y[j, i]
        lost, total_x, total_y = lost + sums[0], total_x + sums[1], total_y + sums[2]
        most, stuck = most + sums[3], stuck + sums[4]
    return lost, total_x, total_y, most, stuck
