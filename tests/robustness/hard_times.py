"""Hard cases of time: steps far from relaxation times, moduli far apart, odd and many branches, vanishing loads."""

import numpy as np

from parcontact.doctor.bench import Bench
from parcontact.doctor.small_jobs import (
    CELL,
    CREEP,
    GLASSY,
    HEIGHT,
    INTEGRATORS,
    LONG_TERM,
    PRONY,
    RADIUS,
    RELAXATION,
    WAVELENGTH,
    Json,
    K,
    crossed,
    sphere,
    wave,
    zener,
)
from parcontact.march.loop import March
from parcontact.physics import prony as viscoelastic
from parcontact.theory import hertz

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
        compliance = viscoelastic.creep([row.time for row in rows[1:]], *body)
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
            exact = STIFF * float(viscoelastic.relaxation(march.row.time, *PRONY))
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


def _settling(omega: float, dt: float, steps: int, integrator: viscoelastic.Integrator) -> complex:
    """Transfer modulus after some steps from a jump: each term b + (1 - b) (decay/z)^steps, b its steady value. The
    first quadratic step is linear: b + (m - b) (decay/z)^(steps - 1) with m = decay/z + phi (1 - 1/z)."""
    spring, moduli, times = TYRE
    total = complex(spring)
    for modulus, time in zip(moduli, times, strict=True):
        share = (
            complex(viscoelastic.discrete_modulus(omega, dt, 0.0, [modulus], [time], integrator=integrator)) / modulus
        )
        z = dt / time
        decay, turn = 1.0 / (1.0 + z) if integrator == "backward-euler" else np.exp(-z), np.exp(-1j * omega * dt)
        first = share + (1.0 - share) * decay * turn
        if integrator == "exponential":
            first = decay * turn - np.expm1(-z) / z * (1.0 - turn)
        total += modulus * (share + (first - share) * (decay * turn) ** (steps - 1))
    return total
