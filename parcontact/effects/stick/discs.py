"""Fused loops over tractions that are bounded at each point; each returns partial sums for one reduction."""

import math

from ...compiled import loop

AT_BOUND = 1.0 - 1e-12  # rounding: share of its bound from which a traction is at it
ACROSS = 0.5  # tuning: least component of a traction across an axis, over the one along it, for moves along the axis


@loop
def shorten_to_bounds(bound, x, y, hit):
    """Shorten the tractions (x, y) to their bounds, and mark those that `hit` them; a bound of 0 gives no traction."""
    for j in range(bound.shape[0]):
        for i in range(bound.shape[1]):
            size, most = math.hypot(x[j, i], y[j, i]), bound[j, i]
            hit[j, i] = most > 0.0 and size >= AT_BOUND * most
            if most <= 0.0:
                x[j, i], y[j, i] = 0.0, 0.0
            elif size > most:
                x[j, i] *= most / size
                y[j, i] *= most / size


@loop
def extrapolate_tractions(last_x, last_y, last_bound, factor, growth, bound, mean_x, mean_y, x, y):
    """Make a start in the place of the tractions (x, y) of two steps ago, from the last ones.

    Tractions that slipped stay at their bounds, others are `factor` times what they were, both with `growth` times
    their last change; new ones have the mean share (mean_x, mean_y) of their bounds.
    """
    for j in range(bound.shape[0]):
        for i in range(bound.shape[1]):
            if last_bound[j, i] <= 0.0:
                x[j, i], y[j, i] = mean_x * bound[j, i], mean_y * bound[j, i]
                continue
            a, b = last_x[j, i], last_y[j, i]
            slipped = math.hypot(a, b) >= AT_BOUND * last_bound[j, i]
            a, b = a + growth * (a - x[j, i]), b + growth * (b - y[j, i])
            size = math.hypot(a, b)
            scale = bound[j, i] / size if slipped and size > 0.0 else factor
            x[j, i], y[j, i] = scale * a, scale * b


@loop
def examine(bound, hit, x, y, u_x, u_y, e_x, e_y, kappa, free, turn):
    """Divide points in contact into those that stick (`free`) and those that slip: their traction was shortened to its
    bound (`hit`), or `t + kappa w` exceeds it, and the slip `w = e - u` is not against t. `turn` receives |w|/f of
    points that slip, along t.

    Return sums of |t|, of |P(t + kappa w)| and of `|P(t + kappa w) - t|`, with P(t) the traction shortened to its
    bound; of the components of the latter; of both components of w over points that stick, and their number.
    """
    size, moved, residual, along_x, along_y = 0.0, 0.0, 0.0, 0.0, 0.0
    w_sticks_x, w_sticks_y, count = 0.0, 0.0, 0.0
    for j in range(bound.shape[0]):
        sums = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        for i in range(bound.shape[1]):
            most = bound[j, i]
            if most <= 0.0:
                free[j, i] = False
                continue
            a, b = x[j, i], y[j, i]
            w_x, w_y = e_x[j, i] - u_x[j, i], e_y[j, i] - u_y[j, i]
            here, work = math.hypot(a, b), w_x * a + w_y * b
            other_x, other_y = a + kappa * w_x, b + kappa * w_y
            other = math.hypot(other_x, other_y)
            sticks = work <= 0.0 or not (hit[j, i] or other > most)
            free[j, i] = sticks
            turn[j, i] = 0.0 if sticks else work / (here * most)
            if other > most:
                other_x, other_y, other = other_x * (most / other), other_y * (most / other), most
            sums[0] += here
            sums[1] += other
            sums[2] += math.hypot(other_x - a, other_y - b)
            sums[3] += abs(other_x - a)
            sums[4] += abs(other_y - b)
            if sticks:
                sums[5] += w_x
                sums[6] += w_y
                sums[7] += 1.0
        size, moved, residual = size + sums[0], moved + sums[1], residual + sums[2]
        along_x, along_y = along_x + sums[3], along_y + sums[4]
        w_sticks_x, w_sticks_y, count = w_sticks_x + sums[5], w_sticks_y + sums[6], count + sums[7]
    return size, moved, residual, along_x, along_y, w_sticks_x, w_sticks_y, count


@loop
def residual(bound, free, turn, x, y, u_x, u_y, e_x, e_y, short, along_x, moves, r):
    """Put one component of the residual into r: the slip w of points that stick; of others, the part of w across the
    traction, times the root of `short/(short + turn)`.

    A point `moves` along this component if it sticks, or if its traction is sufficiently across it; r is 0 elsewhere.
    """
    for j in range(bound.shape[0]):
        for i in range(bound.shape[1]):
            a, b = x[j, i], y[j, i]
            turns = abs(b) > ACROSS * abs(a) if along_x else abs(a) > ACROSS * abs(b)
            moves[j, i] = free[j, i] or (bound[j, i] > 0.0 and turns)
            r[j, i] = 0.0
            if moves[j, i]:
                w_x, w_y = e_x[j, i] - u_x[j, i], e_y[j, i] - u_y[j, i]
                if not free[j, i]:
                    across = (a * w_y - b * w_x) / (a * a + b * b) * math.sqrt(short / (short + turn[j, i]))
                    w_x, w_y = -b * across, a * across
                r[j, i] = w_x if along_x else w_y


@loop
def complete(
    bound, free, turn, x, y, u_x, u_y, e_x, e_y, old_x, old_y, old_u_x, old_u_y, short, long, mean_x, mean_y, z_x, z_y
):
    """Complete the direction z, of which the preconditioned residual is given. Points that stick add a mean. Points
    that slip keep the part across the traction, times the root of `short/(short + turn)`, and add the rest of the
    residual over `long + turn`.

    With the residual r, the last change d of the tractions, and c = A d + turn d, all of them across the traction where
    points slip, return the sums of r z, r d, z c and d c.
    """
    r_z, r_d, z_c, d_c = 0.0, 0.0, 0.0, 0.0
    for j in range(bound.shape[0]):
        sums = [0.0, 0.0, 0.0, 0.0]
        for i in range(bound.shape[1]):
            if bound[j, i] <= 0.0:
                z_x[j, i], z_y[j, i] = 0.0, 0.0
                continue
            a, b = x[j, i], y[j, i]
            w_x, w_y = e_x[j, i] - u_x[j, i], e_y[j, i] - u_y[j, i]
            d_x, d_y = a - old_x[j, i], b - old_y[j, i]
            c_x, c_y = u_x[j, i] - old_u_x[j, i], u_y[j, i] - old_u_y[j, i]
            if not free[j, i]:
                here = math.hypot(a, b)
                a, b = -b / here, a / here
                w, d, c = a * w_x + b * w_y, a * d_x + b * d_y, a * c_x + b * c_y + turn[j, i] * (a * d_x + b * d_y)
                z = a * z_x[j, i] if abs(a) > ACROSS * abs(b) else 0.0
                z += b * z_y[j, i] if abs(b) > ACROSS * abs(a) else 0.0
                share = short / (short + turn[j, i])
                z = z * math.sqrt(share) + w * (1.0 - share) / (long + turn[j, i])
                z_x[j, i], z_y[j, i] = a * z, b * z
                w_x, w_y, d_x, d_y, c_x, c_y = a * w, b * w, a * d, b * d, a * c, b * c
            else:
                z_x[j, i] += mean_x
                z_y[j, i] += mean_y
            sums[0] += w_x * z_x[j, i] + w_y * z_y[j, i]
            sums[1] += w_x * d_x + w_y * d_y
            sums[2] += z_x[j, i] * c_x + z_y[j, i] * c_y
            sums[3] += d_x * c_x + d_y * c_y
        r_z, r_d, z_c, d_c = r_z + sums[0], r_d + sums[1], z_c + sums[2], d_c + sums[3]
    return r_z, r_d, z_c, d_c


@loop
def move_tractions(bound, free, x, y, z_x, z_y, step, again, new_x, new_y, hit):
    """Replace the tractions before (x, y), in (new_x, new_y), by the next ones: `step z` and `again` times the last
    change further. Those that slip keep their bounds; others are shortened to them. Return the sum of the changes."""
    change = 0.0
    for j in range(bound.shape[0]):
        row_change = 0.0
        for i in range(bound.shape[1]):
            most = bound[j, i]
            if most <= 0.0:
                new_x[j, i], new_y[j, i], hit[j, i] = 0.0, 0.0, False
                continue
            a, b = x[j, i], y[j, i]
            d_x, d_y = a - new_x[j, i], b - new_y[j, i]
            if not free[j, i]:
                d = (a * d_y - b * d_x) / (a * a + b * b)
                d_x, d_y = -b * d, a * d
            a, b = a + step * z_x[j, i] + again * d_x, b + step * z_y[j, i] + again * d_y
            size = math.hypot(a, b)
            if size > most or not free[j, i]:
                a, b, size = a * (most / size), b * (most / size), most
            new_x[j, i], new_y[j, i], hit[j, i] = a, b, size >= AT_BOUND * most
            row_change += math.hypot(a - x[j, i], b - y[j, i])
        change += row_change
    return change


@loop
def change_since(bound, x, y, last_x, last_y, factor):
    """Sums of the changes of tractions in contact since the last step, whose tractions are multiplied by a factor, and
    of these."""
    change, size = 0.0, 0.0
    for j in range(bound.shape[0]):
        row_change, row_size = 0.0, 0.0
        for i in range(bound.shape[1]):
            a, b = factor * last_x[j, i], factor * last_y[j, i]
            row_size += math.hypot(a, b)
            if bound[j, i] > 0.0:
                row_change += math.hypot(x[j, i] - a, y[j, i] - b)
        change, size = change + row_change, size + row_size
    return change, size


@loop
def slope_and_curvature(t, new_t, u, new_u, e):
    """Sums of d w, of d A d, and of |t w|, for the change d of the tractions in both components, with the slip
    `w = e - u`."""
    slope, curvature, size = 0.0, 0.0, 0.0
    for j in range(t.shape[0]):
        row_slope, row_curvature, row_size = 0.0, 0.0, 0.0
        for i in range(t.shape[1]):
            d, w = new_t[j, i] - t[j, i], e[j, i] - u[j, i]
            row_slope += d * w
            row_curvature += d * (new_u[j, i] - u[j, i])
            row_size += abs(t[j, i] * w)
        slope, curvature, size = slope + row_slope, curvature + row_curvature, size + row_size
    return slope, curvature, size


@loop
def shorten_change(t, share, new_t):
    """Replace the change of a map by a share of it."""
    for j in range(t.shape[0]):
        for i in range(t.shape[1]):
            new_t[j, i] = t[j, i] + share * (new_t[j, i] - t[j, i])
