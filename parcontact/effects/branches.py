"""Branches of a material: its relaxation function, and branches without a map, with the error that this causes.

With the notation of `physics.body`, branch k of modulus G and relaxation time tau adds `h <- decay h + gain du` to
the stress of a step. Two approximations save its map:

    memoryless  tau far below the shortest step dt: `decay h` is dropped, and `gain du` stays
    frozen      tau far above the duration T of the history: h = G u, a part of the spring

Bounds. A displacement wave u that passes with the frequency w has the modulus M = stress/u. An error |dM| changes
friction by |dM|/G''(w), relatively, and the contact area, which follows 1/|M|, by |dM|/|M|; both are added. The
modulus of a wave that does not pass is at least G(T).

    memoryless  |dM| <= decay |h|/u,  |h|/u <= G min(w tau, 1) in sliding, and <= G after a jump. The branch alone
                has a G'' of half of G min(w tau, 1/(w tau)), and a step has at least the modulus `gain`, so that
                error = decay (2 max(1, pi tau/dt) + G/gain),  w <= pi/dt, in any material
    frozen      |dM| = (G/tau) |integral_0^t exp((s - t)/tau) u ds|/u <= G min(1 - exp(-T/tau), n pi/(w tau)), as each
                of n stages begins with any phase of a wave
                error = (|dM|(w = 0)/G(T) + the largest |dM|/G'' of 1/T <= w <= pi/dt, if the surface slides)

A wave slower than 1/T does not pass within the history. A frozen branch can get a map at any time: it is G u.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .. import job
from ..job.history import Timeline
from ..job.materials import heated
from ..parallel.slab import Array
from ..physics.prony import Integrator, Prony, coefficients, complex_modulus, normal_form, relaxation, zener_to_prony
from ..printed import per_cent
from ..rubber.shift import highest_temperature

Material = job.Elastic | job.Zener | job.Dma
LEAST_BOUND = 1e-6  # least error that is stated
PER_DECADE = 4  # accuracy: frequencies per decade for errors of friction
MEMORYLESS_SHARE = 0.5  # tuning: share of the error for memoryless branches, whatever the duration of a job


def relaxation_of(material: Material) -> Prony:
    """Return the relaxation function of a material [Pa, s]; its long-term modulus and no terms if it has no
    branches."""
    body = material.fitted
    if isinstance(body, job.Elastic) or not body.branches:
        return Prony(body.long_modulus, np.zeros(0), np.zeros(0))
    zener = [b for b in body.branches if isinstance(b, job.ZenerBranch)]
    plain = [b for b in body.branches if isinstance(b, job.PronyBranch)]
    series, kelvin, viscosity = ([getattr(b, name) for b in zener] for name in ("G0", "G1", "eta1"))
    prony = zener_to_prony(series, kelvin, viscosity, body.modulus_inf)
    moduli, times = [b.modulus for b in plain], [b.relaxation_time for b in plain]
    all_times = [body.time_factor * time for time in (*prony.relaxation_times, *times)]
    all_moduli = [body.modulus_factor * modulus for modulus in (*prony.moduli, *moduli)]
    return normal_form(body.modulus_factor * prony.modulus_inf, all_moduli, all_times)


def time_factor_of(material: Material) -> float:
    """Return a_T [-]: relaxation times at the material's temperature divided by those at the reference temperature."""
    return material.fitted.time_factor


def temperature_of(material: Material) -> float:
    """Return the temperature of a material [deg C], by default its shift's reference temperature; NaN without a
    shift."""
    body = material.fitted
    if not isinstance(body, job.Zener) or body.shift is None:
        return math.nan
    return body.shift.reference if body.temperature is None else body.temperature


def highest_temperature_of(material: Material) -> float:
    """Return the temperature [deg C] at which the tables of a material's shift end; inf without tables."""
    body = material.fitted
    return highest_temperature(body.shift.made) if isinstance(body, job.Zener) and body.shift else math.inf


def factor_at(material: Material, rise: float) -> float:
    """Return the ratio of a material's relaxation times after a temperature rise [K] to those before it [-]. Raises
    InputError outside the range of its shift."""
    return time_factor_of(heated(material, temperature_of(material) + rise)) / time_factor_of(material)


class TimeScales(NamedTuple):
    """Time scales of a history: duration and shortest step [s], number of stages with a duration, and whether the load
    `jumps` after the start, the surface `slides`, and the history starts in `steady` sliding."""

    duration: float
    shortest: float
    stages: int = 1
    jumps: bool = False
    slides: bool = True
    steady: bool = False


def time_scales(timeline: Timeline, steady: bool) -> TimeScales:
    """Return the time scales of a history; `steady` is True if it starts in steady sliding, not at rest."""
    lasting = [span for span in timeline.spans if span.count]
    jumps = any(span.jumps and (span.before or steady) for span in timeline.spans)
    shortest = min((span.extremes[0] for span in lasting), default=0.0)
    duration = sum(span.ends.elapsed(span.count) for span in lasting)
    return TimeScales(duration, shortest, len(lasting), jumps, timeline.moves, steady)


@dataclass(frozen=True)
class FoldedBranches:
    """The branches with a map (`kept`) and without (`memoryless`, `frozen`), by their numbers in the material.

    `bound` is the largest relative error of friction (of the modulus, if the body rests) that all branches without a
    map cause, at most `allowed`. `memoryless_errors` are the errors of each branch if it were memoryless. `reason`
    states why all branches need maps, or is ''.
    """

    kept: tuple[int, ...]
    memoryless: tuple[int, ...] = ()
    frozen: tuple[int, ...] = ()
    bound: float = 0.0
    allowed: float = 0.0
    memoryless_errors: tuple[float, ...] = ()
    reason: str = ""

    @property
    def folded(self) -> int:
        """Number of branches without a map."""
        return len(self.memoryless) + len(self.frozen)


def fold_branches(
    prony: Prony, scales: TimeScales, integrator: Integrator, allowed: float, reason: str = ""
) -> FoldedBranches:
    """Return which branches of a material [Pa, s; in normal form] have maps: all if there is a `reason`; otherwise all
    but the fastest and the slowest, as many as keep the sum of their errors at `allowed` or below."""
    without_memory, as_spring = memoryless_errors(prony, scales, integrator), frozen_errors(prony, scales)
    fast = (np.cumsum(without_memory) <= MEMORYLESS_SHARE * allowed) & (not reason)
    left = allowed - float(without_memory[fast].sum())
    slow = (np.cumsum(as_spring[::-1])[::-1] <= left) & ~fast & (not reason)
    kept, memoryless, frozen = (tuple(np.flatnonzero(some).tolist()) for some in (~(fast | slow), fast, slow))
    bound = float(without_memory[fast].sum() + as_spring[slow].sum())
    return FoldedBranches(kept, memoryless, frozen, bound, allowed, tuple(without_memory.tolist()), reason)


def memoryless_errors(prony: Prony, scales: TimeScales, integrator: Integrator) -> Array:
    """Return the relative error of each branch if it is memoryless; infinite if a jump depends on its memory."""
    if scales.jumps or not scales.shortest:
        return np.full_like(prony.moduli, np.inf)
    decay, gain, _ = coefficients(prony, integrator, scales.shortest)
    waves = np.maximum(1.0, np.pi * prony.relaxation_times / scales.shortest)
    return np.asarray(decay * (2.0 * waves + prony.moduli / gain))


def frozen_errors(prony: Prony, scales: TimeScales) -> Array:
    """Return the relative error of each branch if it is a spring; infinite after steady sliding, where h is not G u."""
    if scales.steady:
        return np.full_like(prony.moduli, np.inf)
    relaxed = prony.moduli * -np.expm1(-scales.duration / prony.relaxation_times)
    with np.errstate(divide="ignore"):  # of a fluid long at rest no modulus is left
        errors = relaxed / relaxation(scales.duration, *prony)
    if scales.slides:
        periods = np.pi * scales.duration / scales.shortest  # of the fastest wave, in radians
        omega = np.geomspace(1.0, periods, 1 + math.ceil(PER_DECADE * math.log10(periods)))[:, None] / scales.duration
        passed = np.minimum(relaxed, prony.moduli * (scales.stages * np.pi / (omega * prony.relaxation_times)))
        errors = errors + np.max(passed / complex_modulus(omega[:, 0], *prony).imag[:, None], axis=0)
    return np.asarray(errors)


def bounded_error(found: FoldedBranches, slides: bool) -> str:
    """Return a text with the bound on the error that folded branches cause, at least LEAST_BOUND."""
    what = "friction" if slides else "the modulus"
    return f"error of {what} at most {per_cent(max(found.bound, LEAST_BOUND))}"


def describe_folded_branches(found: FoldedBranches, prony: Prony, slides: bool) -> list[str]:
    """Return sentences on the branches of a material [Pa, s] without a map; an empty list if all have maps and there is
    no reason to mention. `slides` is True if the surface moves."""
    count = prony.moduli.size
    if not found.folded:
        return [f"branches: all {count} are followed in time: {found.reason}"] if found.reason and count > 1 else []
    folded = "; ".join(
        f"those of {', '.join(f'{prony.relaxation_times[k]:g}' for k in numbers)} s are {kind}"
        for kind, numbers in (("too fast to remember", found.memoryless), ("too slow to relax", found.frozen))
        if numbers
    )
    return [
        f"branches: {len(found.kept)} of {count} are followed in time; {folded}. "
        f"{bounded_error(found, slides).capitalize()} (numerics.branch_error allows {per_cent(found.allowed)})"
    ]
