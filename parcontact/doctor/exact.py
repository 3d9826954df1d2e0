"""Contacts with exact answers: almost full and full ones, vanishing loads, sliding, unloading, many branches."""

import numpy as np

from ..physics import prony as viscoelastic
from ..theory import full_contact, hertz, lee_radok, persson, persson_rings, westergaard
from .bench import Bench
from .small_jobs import (
    CELL,
    GLASSY,
    HEIGHT,
    INTEGRATORS,
    PRONY,
    RADIUS,
    RELAXATION,
    WAVELENGTH,
    K,
    sphere,
    wave,
    zener,
)

ITERATIONS = 60  # a contact may take this many at most
RUBBER = zener(GLASSY, [], [])
WAVES = ((1, 0, 1.0), (2, 1, 0.5), (0, 2, 0.4), (1, -3, 0.3), (4, 3, 0.1), (-5, 4, 0.1))  # and their heights
SHARES = (300, 350, 220, 80, 24, 7, 2.4, 1, 0.5, 0.3, 0.2, 0.15)  # MPa
TYRE = (1e6, [1e6 * share for share in SHARES], [5 * 10.0**exponent for exponent in range(-9, 3)])
FULL = 5e7  # Pa, enough for full contact


def nearly_full(bench: Bench) -> None:
    """Westergaard's wave at 0.99, 1 and 1.01 of the load that closes the last gap."""
    for share in (0.99, 1.0, 1.01):
        mean = share * float(westergaard.full_contact_pressure(HEIGHT, WAVELENGTH, GLASSY))
        job = wave([{"pressure": mean}, {"pressure": mean}], points=(256, 1), material=RUBBER)
        march, rows = bench.march(job)
        x = np.arange(256) * WAVELENGTH / 256
        exact = westergaard.pressure(x, mean, HEIGHT, WAVELENGTH, GLASSY)
        bench.expect_all("Westergaard", bench.whole(march, "pressure")[0], exact, 1e-9 if share > 1 else 5e-3)
        area = float(westergaard.contact_fraction(mean, HEIGHT, WAVELENGTH, GLASSY))
        bench.expect("area", rows[-1].measures.contact_area, area, 2 / 256 if share <= 1 else 0.0, scale=1.0)
    bench.expect("iterations", bench.iterations, 0.0, ITERATIONS, scale=1.0)


def vanishing_load(bench: Bench) -> None:
    """Hertz's approach ~ W^(2/3) down to some points; then one cell carries all; no load is no pressure."""
    for force in (0.15, 0.015):
        size = 4 * float(hertz.contact_radius(force, RADIUS, GLASSY))
        _, rows = bench.march(sphere([{"force": force}], points=32, size=size, material=RUBBER))
        exact = float(hertz.approach(force, RADIUS, GLASSY))
        bench.expect(f"approach, {force:g} N", rows[-1].measures.approach, exact, 1e-3)
    cell = 1e-4
    for force in (1e-6, 1e-12, 1e-38):
        stages = [{"force": force}, {"force": 1e-39}, {"force": 1e-40}, {"force": 0.0}]
        _, rows = bench.march(sphere(stages, points=8, size=8 * cell, material=RUBBER))
        pressed, free = rows[1].measures, rows[-1].measures
        bench.expect("points", 64 * pressed.contact_area, 1.0, 0.0)
        bench.expect("peak", pressed.max_pressure, force / cell**2, 1e-12)
        bench.expect("approach", pressed.approach, CELL * force / cell / GLASSY, 1e-9, scale=cell**2 / RADIUS)
        bench.expect("friction", pressed.friction, 0.0, 0.0)
        bench.expect("pressure without load", free.max_pressure, 0.0, 0.0)
        bench.expect("friction without load", free.friction, 0.0, 0.0)


def closed_by_load(bench: Bench) -> None:
    """Many waves in full contact, sliding: the force is the sum over them, in closed form, steady and of steps, and
    after Persson for any gamma."""
    velocity, points = 0.3 * WAVELENGTH / RELAXATION, 16
    surface = [
        {"shape": "wave", "amplitude": share * HEIGHT, "waves": [x, y], "phase": 1.0 * x} for x, y, share in WAVES
    ]
    start = {"state": "steady", "velocity": velocity, "pressure": 1e6}
    stage = {"pressure": 1e6, "velocity": velocity, "distance": 5 * WAVELENGTH, "cells_per_step": 1}
    _, rows = bench.march(wave([stage], points=(points, points), surface=surface, initial=start))
    x, y, share = np.array(WAVES).T
    rings = persson_rings.rings_of_surface(full_contact.Waves((share * HEIGHT).astype(complex), K * x, K * y))
    omega = rings.waves.kx * velocity
    exact = viscoelastic.complex_modulus(omega, *PRONY)
    discrete = viscoelastic.discrete_modulus(omega, WAVELENGTH / points / velocity, *PRONY)
    for what, row, modulus in (("force", rows[0], exact), ("force of steps", rows[-1], discrete)):
        forces = full_contact.traction(*rings.waves, modulus) * WAVELENGTH**2
        bench.expect_all(what, [row.measures.force_x, row.measures.force_y], forces, 1e-8)
        for gamma in (0.0, 1.0):
            friction = -row.measures.force_x / (1e6 * WAVELENGTH**2)
            expected = persson.friction_coefficient(1e6, rings, velocity, 0.0, modulus, gamma)
            bench.expect("friction", friction, float(expected), 1e-8)
    bench.expect("area", min(row.measures.contact_area for row in rows), 1.0, 0.0)


def retraction(bench: Bench) -> None:
    """Ting: a sphere pressed in and pulled back lets go while it is still deep; its force is never negative."""
    depth, rise, steps = 5e-5, 1e-3, 25
    ramps = ((0.0, depth), (depth, 0.0))
    history = [{"approach": {"from": a, "to": b}, "duration": rise, "time_step": rise / steps} for a, b in ramps]
    _, rows = bench.march(sphere(history, size=2e-3, numerics={"tolerance": 1e-6}))
    t = np.array([row.time for row in rows])
    force = np.array([row.measures.pressure for row in rows]) * 2e-3**2
    exact = lee_radok.triangle_force(t, depth, rise, RADIUS, *PRONY)
    bench.expect_all("force", force, exact, 1e-2)
    lift_off = lee_radok.triangle_lift_off_time(rise, *PRONY)
    bench.expect("lift-off", t[np.flatnonzero(force)[-1]], lift_off, rise / steps / lift_off)
    bench.expect("force after", force[t > lift_off].max(), 0.0, 0.0)
    bench.expect("area after", max(row.measures.contact_area for row in rows if row.time > lift_off), 0.0, 0.0)


def many_decades(bench: Bench) -> None:
    """Relaxation times from 5 ns to 500 s in one step: the modulus that 8 steps per period give, still settling."""
    for omega in (1e4, 1e6):
        dt = 2 * np.pi / 8 / omega
        for integrator in INTEGRATORS:
            stage = {"pressure": FULL, "velocity": omega / K, "duration": 16 * dt, "time_step": dt}
            job = wave([stage], material=zener(*TYRE), numerics={"integrator": integrator})
            march, rows = bench.march(job)
            modulus = _settling(omega, dt, len(rows) - 2, integrator)
            friction = K * HEIGHT * HEIGHT * K * modulus.imag / FULL
            bench.expect("amplitude", bench.amplitude(march), 2 * K * HEIGHT * abs(modulus), 1e-9)
            bench.expect("friction", rows[-1].measures.friction, friction, 1e-9)


def _settling(omega: float, dt: float, steps: int, integrator: viscoelastic.Integrator) -> complex:
    """Transfer modulus after some steps from a jump: each term b + (1 - b) (decay/z)^steps, b its steady value."""
    spring, moduli, times = TYRE
    total = complex(spring)
    for modulus, time in zip(moduli, times, strict=True):
        share = complex(viscoelastic.discrete_modulus(omega, dt, 0.0, [modulus], [time], integrator)) / modulus
        z = dt / time
        decay = np.exp(-z) if integrator == "exponential" else 1.0 / (1.0 + z)
        total += modulus * (share + (1.0 - share) * (decay * np.exp(-1j * omega * dt)) ** steps)
    return total
