"""Hard cases of sliding: waves of two cells, a long box, one point, reversal, stop, no velocity and far too much."""

import jgh
import numpy as np
from closed_forms import step_responses

from parcontact.doctor.bench import Bench
from parcontact.doctor.small_jobs import (
    FAST,
    GLASSY,
    HEIGHT,
    INTEGRATORS,
    LONG_TERM,
    MEAN,
    PRONY,
    RADIUS,
    RELAXATION,
    WAVELENGTH,
    K,
    crossed,
    sphere,
    wave,
    zener,
)
from parcontact.physics import prony as viscoelastic
from parcontact.theory import full_contact, westergaard

STIFF = 2 * HEIGHT  # pressure amplitude of a wave in full contact over modulus and wavenumber
CELLS = 6


def shortest_wave(bench: Bench) -> None:
    """Two cells per wave: amplitude 2 q h0 G of the sign that changes in every step; it has no slope, so no force.

    Between two points it is as if its height were cos(pi s/h). Two cells along one direction only: it drags along the
    other as any wave.
    """
    cell = WAVELENGTH / CELLS
    unit = STIFF * np.sqrt(2.0) * np.pi / cell
    z = STEP / 1e-3
    decay, phi = np.exp(-z), -np.expm1(-z) / z
    bent = phi + (1.0 + decay) / z - 2.0 * (1.0 - decay) / z**2  # phi + 2 q, as du is the last one's opposite
    quadratic = 0.275e6 + 2.475e6 * 2.0 * bent / (1.0 + decay)
    for integrator, printed in zip(INTEGRATORS, (quadratic, 2.570412e6, 1.937992e6), strict=True):
        stage = {"pressure": 1e6, "velocity": cell / STEP, "distance": 30 * cell, "cells_per_step": 1}
        march, rows = bench.march(wave([stage], (3, 3), (CELLS, CELLS), numerics={"integrator": integrator}))
        bench.expect("modulus", np.ptp(bench.whole(march, "pressure")) / 2 / unit, printed, 3e-7)
        bench.expect("friction", max(row.measures.friction for row in rows), 0.0, 1e-14, scale=1.0)
    quarter = {"pressure": 1e6, "velocity": cell / STEP, "duration": STEP / 4, "time_step": STEP / 4}
    march, _ = bench.march(wave([quarter], (3, 3), (CELLS, CELLS), material=zener(GLASSY, [], [])))
    bench.expect("between", np.ptp(bench.whole(march, "pressure")) / 2 / unit, GLASSY * np.cos(np.pi / 4), 1e-9)
    _across(bench, (1, 3), 0)
    _across(bench, (3, 1), 1)


STEP = 1e-3 / 256 / 0.004  # s, about the relaxation time


def _across(bench: Bench, waves: tuple[int, int], axis: int) -> None:
    """Along the direction in which the wave is long the friction of any wave, across it none."""
    velocity = [0.0, 0.0]
    velocity[axis] = 0.4 * FAST
    dt = WAVELENGTH / CELLS / 0.4 / FAST
    stage = {"velocity": velocity, "duration": 10 * dt, "time_step": dt, "pressure": 2e6}
    _, rows = bench.march(wave([stage], waves, (CELLS, CELLS)))
    moved = (K * waves[0] * velocity[0], K * waves[1] * velocity[1])
    modulus = viscoelastic.discrete_modulus(sum(moved), dt, *PRONY)
    force = -(HEIGHT**2) * np.hypot(*waves) * K * K * float(np.imag(modulus)) * WAVELENGTH**2
    found = rows[-1].measures.force_x, rows[-1].measures.force_y
    bench.expect("force along", found[axis], force, 1e-9)
    bench.expect("force across", found[1 - axis], 0.0, 1e-12, scale=abs(force))


def long_box(bench: Bench) -> None:
    """A box of 1e4 : 1 is one-dimensional: along x friction of these steps; along y relaxation as at rest."""
    cell, size = WAVELENGTH / 16, [WAVELENGTH, 1e-4 * WAVELENGTH]
    stage = {"velocity": FAST, "distance": 60 * cell, "cells_per_step": 1}
    dt = cell / FAST
    mu = step_responses.discrete_friction_coefficient(
        MEAN, HEIGHT, np.array([K]), np.array([0.0]), FAST, 0.0, dt, *PRONY
    )
    for rows_of_points in (1, 5):
        job = wave([stage], points=(16, rows_of_points), grid={"points": [16, rows_of_points], "size": size})
        _, rows = bench.march(job)
        bench.expect("friction", rows[-1].measures.friction, float(mu), 1e-9)
        mean = 0.5 * float(westergaard.full_contact_pressure(HEIGHT, WAVELENGTH, GLASSY))
        grid = {"points": [128, rows_of_points], "size": size}
        _, rows = bench.march(wave([{"pressure": mean}], grid=grid))
        bench.expect("area", rows[-1].measures.contact_area, 0.5, 2 / 128, scale=1.0)
        peak = westergaard.peak_pressure(mean, HEIGHT, WAVELENGTH, GLASSY)
        bench.expect("peak", rows[-1].measures.max_pressure, float(peak), 2e-3)
    stage = {"velocity": FAST, "duration": 2e-3, "time_step": 5e-4}
    tall = {"points": [3, 16], "size": [1e-4 * WAVELENGTH, WAVELENGTH]}
    march, rows = bench.march(wave([stage], (0, 1), grid=tall))
    bench.expect("amplitude", bench.amplitude(march), STIFF * K * float(viscoelastic.relaxation(2e-3, *PRONY)), 1e-9)
    bench.expect("friction along y", max(row.measures.friction for row in rows), 0.0, 1e-15, scale=1.0)


def reversal(bench: Bench) -> None:
    """At the instant of reversal the force does not change: it pushes first, then overshoots, and settles mirrored."""
    steps = 120
    start = {"state": "steady", "velocity": FAST, "pressure": MEAN}
    stage = {"velocity": -FAST, "duration": 10 * RELAXATION, "time_step": 10 * RELAXATION / steps}
    _, rows = bench.march(wave([stage], initial=start))
    t = np.array([row.time for row in rows])
    modulus = step_responses.velocity_step_modulus(t, K * FAST, np.array([-K * FAST]), *PRONY)
    exact = full_contact.traction(HEIGHT, np.array([K]), np.array([0.0]), modulus)[:, 0] / MEAN
    found = np.array([row.measures.force_x for row in rows]) / MEAN / WAVELENGTH**2
    bench.expect_all("force", found, exact, 5e-3)
    bench.expect("at the instant", found[0], -9.7709e-4, 1e-5)
    bench.expect("peak", found.max(), 11.081e-4, 5e-3)
    bench.expect("peak time", t[found.argmax()], 2.356e-3, 0.02)
    forward, backward = (_steady_force(bench, velocity) for velocity in (0.3 * FAST, -0.3 * FAST))
    bench.expect("mirrored", backward, -forward, 1e-6)


def _steady_force(bench: Bench, velocity: float) -> float:
    """Of a surface that is its own mirror image, in partial contact."""
    start = {"state": "steady", "velocity": velocity, "pressure": 1e4}
    return bench.begin(crossed([{"pressure": 1e4}], initial=start)).row.measures.force_x


def stop(bench: Bench) -> None:
    """When sliding stops, friction of full contact relaxes as exp(-t/tau); of partial contact too, and it grows."""
    start = {"state": "steady", "velocity": FAST, "pressure": MEAN}
    rest = {"duration": 5 * RELAXATION, "time_step": RELAXATION / 4}
    _, rows = bench.march(wave([rest], initial=start))
    found = np.array([row.measures.force_x for row in rows])
    bench.expect_all("force", found / found[0], np.exp(-np.array([row.time for row in rows]) / RELAXATION), 1e-9)
    start = {"state": "steady", "velocity": FAST, "pressure": 1e4}
    long_rest = {"pressure": 1e4, "duration": 0.2, "time_step": {"first": 1e-4, "growth": 1.5}}
    march, rows = bench.march(crossed([long_rest], initial=start, numerics={"tolerance": 1e-8}))
    areas = np.array([row.measures.contact_area for row in rows])
    bench.expect("loss of area", max(0.0, float(-np.diff(areas).min())), 0.0, 0.0)
    bench.expect("friction at rest", rows[-1].measures.friction / rows[0].measures.friction, 0.0, 1e-6, scale=1.0)
    elastic, _ = bench.march(crossed([{"pressure": 1e4}], material=zener(LONG_TERM, [], [])))
    bench.expect_all("pressure at rest", bench.whole(march, "pressure"), bench.whole(elastic, "pressure"), 1e-6)


def extreme_velocities(bench: Bench) -> None:
    """Far too slow: no friction, the area of the long-term modulus. Far too fast: of the modulus at once."""
    mean = 0.5 * float(westergaard.full_contact_pressure(HEIGHT, WAVELENGTH, LONG_TERM))
    for factor, modulus in ((1e-9, LONG_TERM), (1e9, GLASSY)):
        velocity = factor * FAST
        stage = {"pressure": mean, "velocity": velocity, "distance": WAVELENGTH / 16, "cells_per_step": 1}
        start = {"state": "steady", "velocity": velocity, "pressure": mean}
        _, rows = bench.march(wave([stage], points=(128, 1), initial=start))
        area = float(westergaard.contact_fraction(mean, HEIGHT, WAVELENGTH, modulus))
        peak = float(westergaard.peak_pressure(mean, HEIGHT, WAVELENGTH, modulus))
        for row in (rows[0], rows[-1]):
            bench.expect("area", row.measures.contact_area, area, 2 / 128, scale=1.0)
            bench.expect("friction", row.measures.friction, 0.0, 1e-7, scale=K * HEIGHT)
            bench.expect("peak", row.measures.max_pressure, peak, 1e-2)


def single_point(bench: Bench) -> None:
    """One cell: its area is h^2, its force p h^2 dH/dx exactly; it slides, and its neighbour takes over."""
    cell, force, off = 1e-4, 1e-7, 0.3
    centre = [(4 + off) * cell, 4 * cell]
    surface = {"shape": "sphere", "radius": RADIUS, "center": centre}
    sliding = {"force": force, "velocity": 0.1, "duration": 1e-3, "time_step": 5e-5}
    unit = force * cell / RADIUS
    _, rows = bench.march(sphere([{"force": force}, sliding], points=8, size=8 * cell, surface=surface))
    for row in rows[1:]:
        where = off + row.distance / cell
        where -= round(where)
        if abs(abs(where) - 0.5) > 0.1:  # not about half-way, where two points touch
            bench.expect("points", 64 * row.measures.contact_area, 1.0, 0.0)
            bench.expect("force", row.measures.force_x, unit * where, 1e-9, scale=unit)


def two_waves(bench: Bench) -> None:
    """Johnson's two waves at 0.99, 1 and 1.01 of the load that closes the last gap."""
    for share in (0.99, 1.0, 1.01):
        _two_waves(bench, share)


def _two_waves(bench: Bench, share: float) -> None:
    full = float(jgh.full_contact_pressure(HEIGHT, WAVELENGTH, GLASSY))
    surface = [{"shape": "wave", "amplitude": HEIGHT / 2, "waves": [1, sign]} for sign in (1, -1)]
    march, rows = bench.march(
        wave([{"pressure": share * full}], points=(64, 64), material=zener(GLASSY, [], []), surface=surface)
    )
    x = np.arange(64) * WAVELENGTH / 64
    measures = rows[-1].measures
    if share >= 1.0:
        exact = jgh.full_contact_pressure_field(x[None, :], x[:, None], share * full, HEIGHT, WAVELENGTH, GLASSY)
        bench.expect_all("Johnson", bench.whole(march, "pressure"), exact, 1e-9)
    closed = float(jgh.high_load_contact_fraction(share * full, HEIGHT, WAVELENGTH, GLASSY))
    bench.expect("area, Johnson", measures.contact_area, closed, 0.0 if share > 1 else 12 / 64**2, scale=1.0)
    bench.expect("peak, Johnson", measures.max_pressure, (1.0 + share) * full, 1e-3)


def flat_surface(bench: Bench) -> None:
    """Uniform pressure, no gap, no friction, whatever the step, the velocity and the body; then no load at all."""
    for dt in (1e-12, 1e-3, 1e12):
        for velocity in (0.0, [0.3, 0.1], 1e3):
            loading = {"pressure": MEAN, "velocity": velocity, "duration": 3 * dt, "time_step": dt}
            unloading = {"pressure": 0.0, "duration": dt, "time_step": dt}
            _, rows = bench.march(wave([loading, unloading], surface={"shape": "flat"}, output={"energy": True}))
            loaded, free = rows[-3].measures, rows[-1].measures
            bench.expect("friction", max(row.measures.friction for row in rows), 0.0, 0.0)
            bench.expect("area", loaded.contact_area, 1.0, 0.0)
            bench.expect("peak", loaded.max_pressure, MEAN, 1e-12)
            bench.expect("gap", loaded.mean_gap, 0.0, 1e-15, scale=WAVELENGTH)
            bench.expect("pressure without load", free.max_pressure, 0.0, 0.0)
            bench.expect("work", rows[-1].work, 0.0, 1e-12, scale=MEAN * WAVELENGTH**3)
