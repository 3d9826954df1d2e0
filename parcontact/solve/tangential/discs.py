"""Fused loops over tractions that are bounded at each point; each returns partial sums for one reduction."""

import math

from ...compiled import loop

AT_BOUND = 1.0 - 1e-12  # rounding: share of its bound from which a traction is at it


@loop
def shorten_to_bounds(bound, x, y):
    """Shorten the tractions (x, y) to their bounds; a bound of 0 gives no traction."""
    for j in range(bound.shape[0]):
        for i in range(bound.shape[1]):
            size, most = math.hypot(x[j, i], y[j, i]), bound[j, i]
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
def examine(bound, x, y, u_x, u_y, e_x, e_y, kappa, free):
    """Mark the `free` points, which touch and do not slip: the traction is below its bound, or the slip `w = e - u` is
    against it.

    Return sums of |t|, of |P(t + kappa w)|, of `|P(t + kappa w) - t|`, with P(t) the traction shortened to its
    bound, of `<t, u>/2 - <t, e>` and of `<t, u>/2`; and the number of free points.
    """
    size, moved, residual, energy, work, count = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(bound.shape[0]):
        sums = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        for i in range(bound.shape[1]):
            most = bound[j, i]
            if most <= 0.0:
                free[j, i] = False
                continue
            a, b = x[j, i], y[j, i]
            w_x, w_y = e_x[j, i] - u_x[j, i], e_y[j, i] - u_y[j, i]
            here = math.hypot(a, b)
            free[j, i] = here < AT_BOUND * most or w_x * a + w_y * b <= 0.0
            other_x, other_y = a + kappa * w_x, b + kappa * w_y
            other = math.hypot(other_x, other_y)
            if other > most:
                other_x, other_y, other = other_x * (most / other), other_y * (most / other), most
            half = 0.5 * (a * u_x[j, i] + b * u_y[j, i])
            sums[0] += here
            sums[1] += other
            sums[2] += math.hypot(other_x - a, other_y - b)
            sums[3] += half - a * e_x[j, i] - b * e_y[j, i]
            sums[4] += half
            sums[5] += 1.0 if free[j, i] else 0.0
        size, moved, residual = size + sums[0], moved + sums[1], residual + sums[2]
        energy, work, count = energy + sums[3], work + sums[4], count + sums[5]
    return size, moved, residual, energy, work, count


@loop
def slip_of(free, u, e, r):
    """Put `e - u` at free points, 0 elsewhere, into r, for one component."""
    for j in range(r.shape[0]):
        for i in range(r.shape[1]):
            r[j, i] = e[j, i] - u[j, i] if free[j, i] else 0.0


@loop
def turn_products(bound, free, d, u, u_old):
    """Sums of d d and of `d (u - u_old)` where points slip, of one component."""
    square, work = 0.0, 0.0
    for j in range(d.shape[0]):
        row_square, row_work = 0.0, 0.0
        for i in range(d.shape[1]):
            if bound[j, i] > 0.0 and not free[j, i]:
                row_square += d[j, i] * d[j, i]
                row_work += d[j, i] * (u[j, i] - u_old[j, i])
        square, work = square + row_square, work + row_work
    return square, work


@loop
def direction_products(free, u, u_old, e, z, d):
    """Over free points, with the slip `w = e - u`, which fell by `c = u - u_old` in the last step along d: sums of w z,
    c z, w d and c d, of one component."""
    w_z, c_z, w_d, c_d = 0.0, 0.0, 0.0, 0.0
    for j in range(z.shape[0]):
        row_w_z, row_c_z, row_w_d, row_c_d = 0.0, 0.0, 0.0, 0.0
        for i in range(z.shape[1]):
            if free[j, i]:
                w, change = e[j, i] - u[j, i], u[j, i] - u_old[j, i]
                row_w_z += w * z[j, i]
                row_c_z += change * z[j, i]
                row_w_d += w * d[j, i]
                row_c_d += change * d[j, i]
        w_z, c_z, w_d, c_d = w_z + row_w_z, c_z + row_c_z, w_d + row_w_d, c_d + row_c_d
    return w_z, c_z, w_d, c_d


@loop
def redirect(free, z, beta, d):
    """Put `z + beta d` at free points, 0 elsewhere, into d, for one component."""
    for j in range(d.shape[0]):
        for i in range(d.shape[1]):
            d[j, i] = z[j, i] + beta * d[j, i] if free[j, i] else 0.0


@loop
def move_tractions(bound, free, step, d_x, d_y, turn, u_x, u_y, e_x, e_y, x, y):
    """Move tractions within their bounds: free ones by `step d`, those that slip by `turn w`, where d becomes by what
    they moved, over the step. Returns sums of their sizes, and of what was cut off those that were free."""
    size, cut = 0.0, 0.0
    for j in range(bound.shape[0]):
        row_size, row_cut = 0.0, 0.0
        for i in range(bound.shape[1]):
            most = bound[j, i]
            if most <= 0.0:
                continue
            if free[j, i]:
                a, b = x[j, i] + step * d_x[j, i], y[j, i] + step * d_y[j, i]
            else:
                a = x[j, i] + turn * (e_x[j, i] - u_x[j, i])
                b = y[j, i] + turn * (e_y[j, i] - u_y[j, i])
            here = math.hypot(a, b)
            if here > most:
                a, b = a * (most / here), b * (most / here)
                row_cut += here - most if free[j, i] else 0.0
                here = most
            if not free[j, i]:
                d_x[j, i], d_y[j, i] = (a - x[j, i]) / step, (b - y[j, i]) / step
            x[j, i], y[j, i] = a, b
            row_size += here
        size, cut = size + row_size, cut + row_cut
    return size, cut
