"""Fused loops over the rows of this rank for the body, the surface and the heat, and the lowest waves of a spectrum.

Heights are given by a map and a cyclic offset along x [cells]. Of the spectrum of a smooth surface, only the lowest
waves are stored. These are the first rows of the spectrum (q_y >= 0) and its last rows (q_y < 0), in the first columns.
"""

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from ..parallel.fft import FFT, Spectrum


@loop
def copy_shifted(row, start, out):
    """Put `row(i - start)`, cyclic, into `out`; `start` is at least 0 and below the length."""
    rest = row.size - start
    for i in range(rest):
        out[start + i] = row[i]
    for i in range(start):
        out[i] = row[rest + i]


@loop
def roll(source, offset, target):
    """Put `source(i - offset)` into `target`, cyclic along x."""
    for j in range(source.shape[0]):
        copy_shifted(source[j], offset % source.shape[1], target[j])


@loop
def begin(branches, decay, gain, back, du, buffer, weight, weight_u, weight_du, u, heights, offset):
    """Advance the branches, `h_k <- decay_k h_k + gain_k du + back_k buffer`, and put the next effective heights into
    `buffer`: `heights(i - offset) + sum weight_k h_k - weight_u u + weight_du du`.

    On entry `buffer` holds the increment of u in the step before the last, on return the effective heights. Loops over
    four branches at once use the memory bandwidth better than loops over one branch each.
    """
    count, ny, nx = branches.shape
    start = offset % nx
    effective = np.empty(nx)
    for j in range(ny):
        copy_shifted(heights[j], start, effective)
        change, before = du[j], buffer[j]
        for i in range(nx):
            effective[i] += weight_du * change[i] - weight_u * u[j, i]
        for k in range(0, count - 3, 4):
            rows = branches[k, j], branches[k + 1, j], branches[k + 2, j], branches[k + 3, j]
            _advance_four(*rows, decay[k:], gain[k:], back[k:], weight[k:], change, before, effective)
        for k in range(count - count % 4, count):
            a, b, c, e = 1.0 - decay[k], gain[k], weight[k], back[k]
            for i in range(nx):
                branches[k, j, i] += b * change[i] + e * before[i] - a * branches[k, j, i]
                effective[i] += c * branches[k, j, i]
        for i in range(nx):
            before[i] = effective[i]


@loop
def _advance_four(a, b, c, d, decay, gain, back, weight, change, before, effective):
    """Do the same for four branches in one row."""
    fall_a, fall_b, fall_c, fall_d = 1.0 - decay[0], 1.0 - decay[1], 1.0 - decay[2], 1.0 - decay[3]
    rise_a, rise_b, rise_c, rise_d = gain[0], gain[1], gain[2], gain[3]
    back_a, back_b, back_c, back_d = back[0], back[1], back[2], back[3]
    weight_a, weight_b, weight_c, weight_d = weight[0], weight[1], weight[2], weight[3]
    for i in range(change.size):
        a[i] += rise_a * change[i] + back_a * before[i] - fall_a * a[i]
        b[i] += rise_b * change[i] + back_b * before[i] - fall_b * b[i]
        c[i] += rise_c * change[i] + back_c * before[i] - fall_c * c[i]
        d[i] += rise_d * change[i] + back_d * before[i] - fall_d * d[i]
        effective[i] += weight_a * a[i] + weight_b * b[i] + weight_c * c[i] + weight_d * d[i]


@loop
def commit(displacement, buffer, u, heights, offset, out):
    """Put `u_new = displacement - buffer + heights(i - offset)` into `out`, which may be u, and `u_new - u` into
    `buffer`. On entry `buffer` holds the effective heights, on return the increment of u."""
    nx = u.shape[1]
    start = offset % nx
    for j in range(u.shape[0]):
        for i in range(nx):
            source = i - start if i >= start else i - start + nx
            new = displacement[j, i] - buffer[j, i] + heights[j, source]
            buffer[j, i] = new - u[j, i]
            out[j, i] = new


@loop
def sum_measures(p, u, h, mask, above, cyclic):
    """Return six numbers over the points of this rank, in this order:

    * the sum of p;
    * the number of points in contact, where `mask` is not 0;
    * the sum of `u - h`;
    * the number of cell sides between a point in contact and a point that is not, for neighbours along x;
    * the same number for neighbours along y;
    * the largest p.

    `above` is the row of the mask before the first row of this rank. With `cyclic`, the last point of a row is the
    neighbour of the first. The largest pressure is kept for each column, so that the loop is vectorized.
    """
    load, count, gaps, sides_x, sides_y = 0.0, 0.0, 0.0, 0.0, 0.0
    largest, most = np.empty(p.shape[1]), 0.0
    for i in range(largest.size):
        largest[i] = 0.0
    for j in range(p.shape[0]):
        before = mask[j - 1] if j > 0 else above
        row_load, row_count, row_gaps, along_x, along_y = 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(p.shape[1]):
            row_load += p[j, i]
            row_count += 1.0 if mask[j, i] != 0.0 else 0.0
            row_gaps += u[j, i] - h[j, i]
            along_y += 1.0 if (mask[j, i] != 0.0) != (before[i] != 0.0) else 0.0
            largest[i] = max(largest[i], p[j, i])
        for i in range(1, p.shape[1]):
            along_x += 1.0 if (mask[j, i] != 0.0) != (mask[j, i - 1] != 0.0) else 0.0
        if cyclic:
            along_x += 1.0 if (mask[j, 0] != 0.0) != (mask[j, -1] != 0.0) else 0.0
        load += row_load
        count += row_count
        gaps += row_gaps
        sides_x += along_x
        sides_y += along_y
    for i in range(largest.size):
        most = max(most, largest[i])
    return load, count, gaps, sides_x, sides_y, most


@loop
def measure_yielded(p, u, h, above, below, cyclic, highest):
    """Return four sums over the points of this rank for a contact in which points yield at the pressure `highest`:

    * the excess cells on edges of contact at yielded points (`physics.energy`), `sum 1 - p/highest` over points below
      `highest` that have both a yielded neighbour and a neighbour without pressure;
    * the number of sides between any other point below `highest` and a point without pressure;
    * the number of yielded points;
    * the sum of `u - h` at yielded points.

    `above` and `below` are the rows of p before and after the rows of this rank.
    """
    ny, nx = p.shape
    sharp, sides, count, gaps = 0.0, 0.0, 0.0, 0.0
    for j in range(ny):
        before, after = p[j - 1] if j > 0 else above, p[j + 1] if j < ny - 1 else below
        for i in range(nx):
            if p[j, i] >= highest:
                count += 1.0
                gaps += u[j, i] - h[j, i]
            elif p[j, i] > 0.0:
                left = p[j, i - 1] if i > 0 or cyclic else p[j, i]
                right = p[j, i + 1] if i < nx - 1 else (p[j, 0] if cyclic else p[j, i])
                open_sides = 0.0
                for neighbour in (left, right, before[i], after[i]):
                    open_sides += 0.0 if neighbour > 0.0 else 1.0
                if open_sides > 0.0 and max(left, right, before[i], after[i]) >= highest:
                    sharp += 1.0 - p[j, i] / highest
                else:
                    sides += open_sides
    return sharp, sides, count, gaps


@loop
def embedded(branches, decay, increment, gain, before, past, p, u, heights, offset, first, stride):
    """Return the sums from which `march.controller` estimates the time error: the sums of p, p e^2, p u^2,
    `p (h(i + 1) - h(i - 1))^2`, p h, p h^2 and p increment^2 over every `stride`-th row, from row `first`. Here e is
    `sum decay_k h_k + gain increment + past before` with the branch maps h_k, and h is `heights(i - offset)`.

    Points without pressure are skipped; each run of points with pressure is summed on its own.
    """
    count, ny, nx = branches.shape
    load, bent, size, slope, height, square, turned = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    back = (-1 - offset) % nx
    e = np.empty(nx)
    for j in range(first, ny, stride):
        end = 0
        while end < nx:
            start = end
            while start < nx and p[j, start] == 0.0:
                start += 1
            end = start
            while end < nx and p[j, end] != 0.0:
                end += 1
            here, moved, flat, run = p[j, start:end], increment[j, start:end], u[j, start:end], e[start:end]
            for i in range(here.size):
                run[i] = gain * moved[i] + past * before[j, start + i]
            for k in range(count):
                branch = branches[k, j, start:end]
                for i in range(here.size):
                    run[i] += decay[k] * branch[i]
            for i in range(here.size):
                load += here[i]
                bent += here[i] * run[i] * run[i]
                size += here[i] * flat[i] * flat[i]
                turned += here[i] * moved[i] * moved[i]
            for i in range(start, end):
                left = i + back if i + back < nx else i + back - nx
                right = left + 2 if left + 2 < nx else (left + 2) % nx
                rise = heights[j, right] - heights[j, left]
                slope += p[j, i] * rise * rise
                middle = heights[j, left + 1 if left + 1 < nx else 0]
                height += p[j, i] * middle
                square += p[j, i] * middle * middle
    return load, bent, size, slope, height, square, turned


@loop
def dot(a, b):
    """Return the sum of a b."""
    total = 0.0
    for j in range(a.shape[0]):
        row = 0.0
        for i in range(a.shape[1]):
            row += a[j, i] * b[j, i]
        total += row
    return total


@loop
def work(p, alpha, p_old, alpha_old, du):
    """Return the sum of `(alpha p + alpha_old p_old)/2 du`: the work of a pressure that changes linearly with u."""
    total = 0.0
    for j in range(p.shape[0]):
        row = 0.0
        for i in range(p.shape[1]):
            row += 0.5 * (alpha * p[j, i] + alpha_old * p_old[j, i]) * du[j, i]
        total += row
    return total


@loop
def travel(p, p_old, factor, factor_old, shift, lower, upper, out):
    """Extrapolate linearly from two pressures in the frame of the moving surface: put
    `S (factor p - factor_old S p_old)`, between `lower` and `upper`, into `out`. `p_old` is the pressure one step
    before p; `out` may be `p_old`.

    S shifts a map by `shift` cells along x (cyclic). The shift is by whole cells, as interpolation between cells would
    spread the contact, which costs more iterations than an error of half a cell.
    """
    ny, nx = p.shape
    start = shift % nx
    moved = np.empty(nx)
    for j in range(ny):
        copy_shifted(p_old[j], start, moved)
        for i in range(nx):
            moved[i] = min(max(factor * p[j, i] - factor_old * moved[i], lower), upper)
        copy_shifted(moved, start, out[j])


@loop
def tangential(p, h, rows, phase_x, phase_y, along_x, along_y, weight):
    """Return the tangential forces of a pressure along x and y from spectra: `sum weight Re(conj(p) i along h)`.

    h has the given `rows` and the first columns only, and is moved by `phase_x phase_y`. `along_x` and `along_y` are
    the slope symbols (the wavenumber for the exact slope), `weight` is the multiplicity of a column of the half
    spectrum.
    """
    force_x, force_y = 0.0, 0.0
    for k in range(h.shape[0]):
        j = rows[k]
        row_x, row_y = 0.0, 0.0
        for i in range(h.shape[1]):
            moved = phase_x[i] * phase_y[j] * h[k, i]
            product = weight[i] * (p[j, i].imag * moved.real - p[j, i].real * moved.imag)
            row_x += along_x[i] * product
            row_y += along_y[j] * product
        force_x += row_x
        force_y += row_y
    return force_x, force_y


@loop
def displace(h, rows, along_x, along_y, out):
    """Put the spectrum of the moved heights into `out`: `along_x along_y h` in the `rows` and first columns of the
    stored waves h, 0 elsewhere. `along_x` and `along_y` are the phase factors of the shift along x and y."""
    for j in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[j, i] = 0.0
    for k in range(h.shape[0]):
        j = rows[k]
        for i in range(h.shape[1]):
            out[j, i] = along_x[i] * along_y[j] * h[k, i]


@loop
def conduct(waves, known, spread, dt, sources, heats, scales, effusivity, out):
    """Advance all waves of heat by a step dt, and store the sources at the end of the step. Put the spectrum of the
    surface temperature into `out`, which may be one of the `sources`. Return the sum over all waves but the mean of the
    temperature at depth times the pressure at the end of the step (`effects.heat.solver`).

    * waves: spectra of the waves along the depth that have a memory, shape (kept, rows, columns);
    * known: the rates, weights and shares of heat at depth of all waves along the depth; the decays over the step of
      the waves with a memory; and the rate^(1/2) at which the waves end (`prony.Exponentials`);
    * spread: the squared wavenumbers along x and along y, each times the diffusivity, and the multiplicity of columns;
    * sources: the spectra of rubbing before and after the step, and of pressure before and after the step. The spectra
      of rubbing have no rows if the surfaces do not rub;
    * heats: the heat of rubbing and of pressure, each before and after the step, shape (2, 2);
    * scales: the factors on the spectra of rubbing and of pressure after the step.
    """
    rates, weights, deep, fall, end = known
    spread_x, spread_y, multiplicity = spread
    rubbed, fresh, pressed, now = sources
    rubs = fresh.shape[0] > 0
    felt = 0.0
    for j in range(out.shape[0]):
        row = 0.0
        for i in range(out.shape[1]):
            k2 = spread_x[i] + spread_y[j]
            slows = np.exp(-k2 * dt)
            fresh_here = scales[0] * fresh[j, i] if rubs else 0.0j
            old_here = rubbed[j, i] if rubs else 0.0j
            now_here = scales[1] * now[j, i]
            on_before, on_after = heats[0, 0] * old_here, heats[0, 1] * fresh_here
            in_before, in_after = heats[1, 0] * pressed[j, i], heats[1, 1] * now_here
            total, within = 0.0j, 0.0j
            for n in range(rates.size):
                x = (rates[n] + k2) * dt
                e = fall[n] * slows if n < waves.shape[0] else 0.0
                if x < 1e-3:
                    mean = 1.0 - x * (0.5 - x * (1.0 / 6.0 - x / 24.0))
                    after = 0.5 - x * (1.0 / 6.0 - x / 24.0)
                else:
                    mean = (1.0 - e) / x
                    after = (1.0 - mean) / x
                c = dt * ((mean - after) * (on_before + deep[n] * in_before) + after * (on_after + deep[n] * in_after))
                if n < waves.shape[0]:
                    c += e * waves[n, j, i]
                    waves[n, j, i] = c
                total += weights[n] * c
                within += weights[n] * deep[n] * c
            if k2 > 0.0:
                root = np.sqrt(k2)
                total += 2.0 / np.pi * np.arctan(root / end) / root * on_after / effusivity
                row += multiplicity[i] * (within.real * now_here.real + within.imag * now_here.imag)
            if rubs:
                rubbed[j, i] = fresh_here
            pressed[j, i] = now_here
            out[j, i] = total
        felt += row
    return felt


def shape_of(waves: tuple[int, int], lengths: tuple[int, int], columns: slice) -> tuple[int, int]:
    """Return the shape of this rank's part of the lowest waves: at most `waves` along x and y, on the `columns` of this
    rank. `lengths` are those of the transform."""
    count = min(waves[0], lengths[0] // 2) + 1
    return min(2 * waves[1] + 1, lengths[1]), max(0, min(count, columns.stop) - columns.start)


def rows_of(count: int, my: int) -> NDArray[np.int64]:
    """Return the indices of the rows with the lowest `count` wavenumbers in a spectrum of `my` rows."""
    return np.concatenate([np.arange((count + 1) // 2), np.arange(my - count // 2, my)])


def lowest(spectrum: Spectrum, fft: FFT, waves: tuple[int, int]) -> Spectrum:
    """Return this rank's part of the lowest waves of a spectrum, copied in the precision of the transform."""
    rows, columns = shape_of(waves, (fft.mx, fft.my), fft.columns)
    return np.ascontiguousarray(spectrum[rows_of(rows, fft.my), :columns], fft.complex)
