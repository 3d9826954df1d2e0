"""The cases in which contact codes fail, each at its physical outcome, in every precision, on any number of ranks.

What is expected and how far off it may be stands with the cases: here, and in parcontact/doctor.
"""

from collections.abc import Callable

import numpy as np
import pytest
import wavy_contact
from closed_forms import step_responses
from mpi4py import MPI

from parcontact.door.doctor import (
    CHECKS,
    GLASSY,
    HEIGHT,
    MEAN,
    PRONY,
    RADIUS,
    RELAXATION,
    WAVELENGTH,
    Bench,
    Check,
    Json,
    K,
    crossed,
    run_check,
    sphere,
    wave,
    zener,
)
from parcontact.march.loop import March
from parcontact.physics import prony
from parcontact.theory import hertz, wavy

from .strict_bench import StrictBench

# -- hard cases of time: steps far from relaxation times, moduli far apart, odd and many branches, vanishing ----------

LONG_TERM = PRONY[0]  # modulus at long times [Pa]
CREEP = RELAXATION * GLASSY / LONG_TERM  # creep time of the branch and the spring [s]
FAST = 1.0 / (K * RELAXATION)  # velocity at which the wave excites one radian per relaxation time [m/s]
CELL = np.arcsinh(1.0) / np.pi  # displacement in the middle of a square cell under uniform pressure, over p side/G
INTEGRATORS: tuple[prony.Integrator, ...] = ("exponential", "exponential-linear", "backward-euler")
STIFF = 2 * K * HEIGHT  # pressure amplitude of the wave in full contact over the modulus
FORCE = 0.15  # N
RUBBER = zener(GLASSY, [], [])
SHARES = (300, 350, 220, 80, 24, 7, 2.4, 1, 0.5, 0.3, 0.2, 0.15)  # MPa
TYRE = (1e6, [1e6 * share for share in SHARES], [5 * 10.0**exponent for exponent in range(-9, 3)])
FULL = 5e7  # Pa, enough for full contact


def long_steps(bench: Bench) -> None:
    """After one step of dt >> tau the body is elastic with its long-term modulus, to tau/dt."""
    elastic, _ = bench.march(crossed([{"pressure": 1e4}], material=zener(LONG_TERM, [], [])))
    soft = bench.whole(elastic, "pressure")
    for relaxation, ratio in ((RELAXATION, 1e6), (RELAXATION, 1e12), (RELAXATION, 1e42), (1e-38, np.inf)):
        for integrator in INTEGRATORS:
            body: Json = {"material": zener(*PRONY[:2], [relaxation]), "numerics": {"integrator": integrator}}
            body["output"] = {"energy": ratio > 1e12}
            dt = min(relaxation * ratio, 1e39)
            stage = {"duration": dt, "time_step": dt}
            within = 2.0 * GLASSY / LONG_TERM / ratio + 1e-8
            march, _ = bench.march(crossed([{"pressure": 1e4, **stage}], **body))
            bench.expect_all(f"pressure, {integrator}", bench.whole(march, "pressure"), soft, within)
            march, _ = bench.march(wave([stage], **body))
            bench.expect("amplitude", bench.amplitude(march), STIFF * LONG_TERM, 2.0 * within)


def short_steps(bench: Bench) -> None:
    """While dt and all of the time are << tau the body is elastic with its modulus at once, sliding or not."""
    elastic, _ = bench.march(crossed([{"pressure": 4e4}], material=zener(GLASSY, [], [])))
    hard = bench.whole(elastic, "pressure")
    for ratio in (1e-6, 1e-13, 1e-15):
        dt = ratio * RELAXATION
        for integrator in INTEGRATORS:
            numerics = {"integrator": integrator}
            stage = {"velocity": WAVELENGTH / 8 / dt, "duration": 8 * dt, "time_step": dt}
            march, rows = bench.march(wave([stage], numerics=numerics))
            within = 30 * ratio + 1e-9
            bench.expect("amplitude", bench.amplitude(march), STIFF * GLASSY, within)
            bench.expect("friction", rows[-1].measures.friction, 0.0, within, scale=STIFF * GLASSY * K * HEIGHT / 2e5)
            ramp = {"pressure": {"from": 0.0, "to": 4e4}, "duration": 2 * dt, "time_step": dt}
            march, _ = bench.march(crossed([ramp], numerics=numerics))
            bench.expect_all("pressure", bench.whole(march, "pressure"), hard, within + 1e-8)


def moduli_far_apart(bench: Bench) -> None:
    """A load step on one point: u follows the creep compliance J(t) through decades, long-term only after tau_C.

    Errors of exponential steps: 7.8e-5 at 1e3 : 1 and dt = tau, 8.2e-8 at 1e6 : 1; 1e-3 for one step of 1000 tau_C.
    """
    for ratio, error in ((1e3, 8e-5), (1e6, 8.3e-8)):
        body = (GLASSY / ratio, [GLASSY * (1.0 - 1.0 / ratio)], [RELAXATION])
        load = 1e-5 * GLASSY / ratio  # [Pa] over the box: far too little for a second point
        short = {"duration": 20 * RELAXATION, "time_step": RELAXATION}
        long = {"duration": 1e3 * ratio * RELAXATION, "time_step": 1e3 * ratio * RELAXATION}
        job = sphere([{"pressure": load, **short}], points=8, size=8e-4, material=zener(*body))
        _, rows = bench.march(job)
        compliance = prony.creep([row.time for row in rows[1:]], *body)
        point = CELL * 1e-4 * 64 * load
        for row, j in zip(rows[1:], compliance, strict=True):
            bench.expect(f"approach, {ratio:g} : 1", row.measures.approach, point * j, error)
        _, rows = bench.march({**job, "history": [{"pressure": load, **long}]})
        bench.expect("in the end", rows[-1].measures.approach, point * ratio / GLASSY, 1.1e-3)
        bench.expect("points", 64 * rows[-1].measures.contact_area, 1.0, 1e-12)


def odd_branches(bench: Bench) -> None:
    """G1 = 0 is a Maxwell branch, eta1 = 0 two springs in series, eta1 = inf a spring: G(t) in full contact, exact."""
    maxwell = {"G0": 2.475e6, "G1": 0.0, "eta1": 2475.0}
    series = {"G0": 0.2e6, "G1": 0.2e6, "eta1": 0.0}
    spring = {"G0": 0.175e6, "G1": 1e6, "eta1": np.inf}
    both = {"G0": 2.75e6, "G1": 2.75e6 / 9, "eta1": 2.75e4 / 9}
    stage = {"duration": 3e-3, "time_step": 5e-4}
    forms: list[tuple[float, list[Json]]] = [(0.275e6, [maxwell]), (0.0, [maxwell, series, spring]), (0.0, [both])]
    for modulus_inf, branches in forms:
        material = {"model": "zener", "modulus_inf": modulus_inf, "branches": branches}

        def relaxes(march: March) -> None:
            exact = STIFF * float(prony.relaxation(march.row.time, *PRONY))
            bench.expect("amplitude", bench.amplitude(march), exact, 1e-9)

        bench.march(wave([stage], material=material), relaxes)
    springs = {"model": "zener", "modulus_inf": 0.0, "branches": [series, {**spring, "G0": 0.9e6}]}
    march, _ = bench.march(wave([stage], material=springs))
    bench.expect("springs only", bench.amplitude(march), STIFF * 1e6, 1e-9)


def load_again(bench: Bench) -> None:
    """Without load the body recovers with the creep time, not the relaxation time; it remembers, and then forgets."""
    steps = {"first": 1e-4, "growth": 1.12}
    press = {"force": FORCE, "duration": CREEP, "time_step": steps}
    rest = {"force": 0.0, "duration": CREEP, "time_step": 2.5e-4}
    long_rest = {"force": 0.0, "duration": 10 * CREEP, "time_step": {"first": 4e-4, "growth": 1.02}}
    middle: list[tuple[float, float]] = []

    def keep(march: March) -> None:
        if march.row.measures.pressure == 0.0:
            middle.append((march.row.time, bench.whole(march, "displacement")[16, 16]))

    _, rows = bench.march(sphere([press, rest, {"force": FORCE}], size=2e-3, numerics={"tolerance": 1e-6}), keep)
    virgin, again = rows[1].measures, rows[-1].measures
    t, u = np.array(middle).T
    bench.expect("at once", virgin.approach, 21.869e-6, 5e-3)
    bench.expect("snap back", u[0], 67.231e-6, 5e-3)
    bench.expect_all("recovery", u / u[0], np.exp(-(t - t[0]) / CREEP), 2e-3)
    unloaded = [row.measures for row in rows if row.measures.pressure == 0.0]
    bench.expect("pressure without load", max(measures.max_pressure for measures in unloaded), 0.0, 0.0)
    bench.expect("approach again", again.approach, 43.877e-6, 1e-2)
    bench.expect("area again over virgin", again.contact_area / virgin.contact_area, (0.537 / 0.470) ** 2, 0.1)
    _, rows = bench.march(sphere([press, long_rest, {"force": FORCE}], size=2e-3, numerics={"tolerance": 1e-6}))
    bench.expect("approach after a long rest", rows[-1].measures.approach, virgin.approach, 5 * np.exp(-10.0))


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


def _settling(omega: float, dt: float, steps: int, integrator: prony.Integrator) -> complex:
    """Transfer modulus after some steps from a jump: each term b + (1 - b) (decay/z)^steps, b its steady value. The
    first quadratic step is linear: b + (m - b) (decay/z)^(steps - 1) with m = decay/z + phi (1 - 1/z)."""
    spring, moduli, times = TYRE
    total = complex(spring)
    for modulus, time in zip(moduli, times, strict=True):
        share = complex(prony.discrete_modulus(omega, dt, 0.0, [modulus], [time], integrator=integrator)) / modulus
        z = dt / time
        decay, turn = 1.0 / (1.0 + z) if integrator == "backward-euler" else np.exp(-z), np.exp(-1j * omega * dt)
        first = share + (1.0 - share) * decay * turn
        if integrator == "exponential":
            first = decay * turn - np.expm1(-z) / z * (1.0 - turn)
        total += modulus * (share + (first - share) * (decay * turn) ** (steps - 1))
    return total


# -- hard cases of sliding: waves of two cells, a long box, one point, reversal, stop, no velocity and far ------------

UNIT = 2 * HEIGHT  # pressure amplitude of a wave in full contact over modulus and wavenumber
CELLS = 6


def shortest_wave(bench: Bench) -> None:
    """Two cells per wave: amplitude 2 q h0 G of the sign that changes in every step; it has no slope, so no force.

    Between two points it is as if its height were cos(pi s/h). Two cells along one direction only: it drags along the
    other as any wave.
    """
    cell = WAVELENGTH / CELLS
    unit = UNIT * np.sqrt(2.0) * np.pi / cell
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
    modulus = prony.discrete_modulus(sum(moved), dt, *PRONY)
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
        mean = 0.5 * float(wavy.full_contact_pressure(HEIGHT, WAVELENGTH, GLASSY))
        grid = {"points": [128, rows_of_points], "size": size}
        _, rows = bench.march(wave([{"pressure": mean}], grid=grid))
        bench.expect("area", rows[-1].measures.contact_area, 0.5, 2 / 128, scale=1.0)
        peak = wavy.peak_pressure(mean, HEIGHT, WAVELENGTH, GLASSY)
        bench.expect("peak", rows[-1].measures.max_pressure, float(peak), 2e-3)
    stage = {"velocity": FAST, "duration": 2e-3, "time_step": 5e-4}
    tall = {"points": [3, 16], "size": [1e-4 * WAVELENGTH, WAVELENGTH]}
    march, rows = bench.march(wave([stage], (0, 1), grid=tall))
    bench.expect("amplitude", bench.amplitude(march), UNIT * K * float(prony.relaxation(2e-3, *PRONY)), 1e-9)
    bench.expect("friction along y", max(row.measures.friction for row in rows), 0.0, 1e-15, scale=1.0)


def reversal(bench: Bench) -> None:
    """At the instant of reversal the force does not change: it pushes first, then overshoots, and settles mirrored."""
    steps = 120
    start = {"state": "steady", "velocity": FAST, "pressure": MEAN}
    stage = {"velocity": -FAST, "duration": 10 * RELAXATION, "time_step": 10 * RELAXATION / steps}
    _, rows = bench.march(wave([stage], initial=start))
    t = np.array([row.time for row in rows])
    modulus = step_responses.velocity_step_modulus(t, K * FAST, np.array([-K * FAST]), *PRONY)
    exact = wavy.traction(HEIGHT, np.array([K]), np.array([0.0]), modulus)[:, 0] / MEAN
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
    mean = 0.5 * float(wavy.full_contact_pressure(HEIGHT, WAVELENGTH, LONG_TERM))
    for factor, modulus in ((1e-9, LONG_TERM), (1e9, GLASSY)):
        velocity = factor * FAST
        stage = {"pressure": mean, "velocity": velocity, "distance": WAVELENGTH / 16, "cells_per_step": 1}
        start = {"state": "steady", "velocity": velocity, "pressure": mean}
        _, rows = bench.march(wave([stage], points=(128, 1), initial=start))
        area = float(wavy.contact_fraction(mean, HEIGHT, WAVELENGTH, modulus))
        peak = float(wavy.peak_pressure(mean, HEIGHT, WAVELENGTH, modulus))
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
    full = float(wavy_contact.full_contact_pressure(HEIGHT, WAVELENGTH, GLASSY))
    surface = [{"shape": "wave", "amplitude": HEIGHT / 2, "waves": [1, sign]} for sign in (1, -1)]
    march, rows = bench.march(
        wave([{"pressure": share * full}], points=(64, 64), material=zener(GLASSY, [], []), surface=surface)
    )
    x = np.arange(64) * WAVELENGTH / 64
    measures = rows[-1].measures
    if share >= 1.0:
        exact = wavy_contact.full_contact_pressure_field(
            x[None, :], x[:, None], share * full, HEIGHT, WAVELENGTH, GLASSY
        )
        bench.expect_all("Johnson", bench.whole(march, "pressure"), exact, 1e-9)
    closed = float(wavy_contact.high_load_contact_fraction(share * full, HEIGHT, WAVELENGTH, GLASSY))
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


# -- all of them ------------------------------------------------------------------------------------------------------

CASES: tuple[Callable[[Bench], None], ...] = (
    *(check.run for check in CHECKS),
    *(long_steps, short_steps, moduli_far_apart, odd_branches),
    *(vanishing_load, many_decades),
    *(load_again, single_point, shortest_wave, long_box),
    *(reversal, stop, extreme_velocities),
    *(two_waves, flat_surface),
)
NAMES = [case.__name__ for case in CASES]
BY_NAME = {case.__name__: Check(case.__name__, "", case) for case in CASES}


@pytest.mark.mpi(3)
@pytest.mark.parametrize("name", NAMES)
def test_double_precision(comm: MPI.Intracomm, name: str) -> None:
    assert run_check(BY_NAME[name], StrictBench(comm)).wrong == []


@pytest.mark.mpi(2)
@pytest.mark.parametrize("name", NAMES)
def test_mixed_precision(comm: MPI.Intracomm, name: str) -> None:
    assert run_check(BY_NAME[name], StrictBench(comm, "mixed")).wrong == []
