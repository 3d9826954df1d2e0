"""Fused loop over the points of a contact that sticks and slips."""

import math

from ...compiled import loop


@loop
def settle_slips(bound, stiffness, alpha, t_x, t_y, alpha_old, old_x, old_y, u_x, u_y, target_x, target_y, slipping):
    """Find the points that stick after a step, and move the targets of all others.

    With `s = target - u` and k the stiffness a point sticks if `|t + k s|` is below its bound. Every other point slips
    by `s - r`, and its target is `u + r`, where `k r` is what t lacks of `t + k s` shortened to its bound. Exact
    tractions lack nothing. Otherwise r is not lost: it adds up over steps until a solve corrects t. A point that slips
    loses `(alpha t + alpha_old t_old)/2 (s - r)`, or 0 if this is negative. Put the powers at the end of the step, in
    proportion to `t (s - r)`, into the map `slipping`, unless it is empty. Return the sums of losses, of t along x, of
    t along y and of bounds, the number of points that stick, and the sum of `t (s - r)`.
    """
    writes = slipping.size > 0
    lost, total_x, total_y, most, stuck, power = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(bound.shape[0]):
        sums = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        for i in range(bound.shape[1]):
            a, b, limit = t_x[j, i], t_y[j, i], bound[j, i]
            s_x, s_y = target_x[j, i] - u_x[j, i], target_y[j, i] - u_y[j, i]
            sums[1] += a
            sums[2] += b
            sums[3] += limit
            if writes:
                slipping[j, i] = 0.0
            trial_x, trial_y = a + stiffness * s_x, b + stiffness * s_y
            size = math.hypot(trial_x, trial_y)
            if size < limit:
                sums[4] += 1.0
                continue
            r_x, r_y = 0.0, 0.0
            if limit > 0.0:
                r_x = (trial_x * (limit / size) - a) / stiffness
                r_y = (trial_y * (limit / size) - b) / stiffness
            s_x, s_y = s_x - r_x, s_y - r_y
            mean_x, mean_y = alpha * a + alpha_old * old_x[j, i], alpha * b + alpha_old * old_y[j, i]
            sums[0] += max(0.5 * (mean_x * s_x + mean_y * s_y), 0.0)
            if writes:
                slipping[j, i] = max(a * s_x + b * s_y, 0.0)
                sums[5] += slipping[j, i]
            target_x[j, i], target_y[j, i] = u_x[j, i] + r_x, u_y[j, i] + r_y
        lost, total_x, total_y = lost + sums[0], total_x + sums[1], total_y + sums[2]
        most, stuck, power = most + sums[3], stuck + sums[4], power + sums[5]
    return lost, total_x, total_y, most, stuck, power
