"""Branches of a material: its relaxation function, and branches that need no map.

With the notation of `physics.body`, the stress h of a branch of modulus G and relaxation time tau changes in a step dt
by `h <- decay h + gain du`, where du is the change of the displacement. `physics.prony.coefficients` gives `decay` [-]
and `gain` [Pa]. Two approximations save the map of h:

    memoryless  tau is far below the shortest step dt: `decay h` is left out, and `gain du` stays
    frozen      tau is far above the duration T of the history: h = G u, so that the branch is a part of the spring

This causes an error, for which the module gives an upper bound. A displacement wave u that passes with the frequency w
has the modulus M = stress/u. An error |dM| of this modulus changes friction by the share |dM|/G''(w), and the contact
area, which is proportional to 1/|M|, by the share |dM|/|M|. The bound is the sum of both. The modulus of a wave that
does not pass is at least the relaxation modulus G(T).

For a memoryless branch |dM| <= decay |h|/u. In sliding |h|/u is at most G min(w tau, 1), and after a jump at most G.
The G'' of the material is at least that of the branch alone, which is at least G min(w tau, 1/(w tau))/2, and the
modulus in a step is at least `gain`. Since w <= pi/dt, the bound for any material is

    error = decay (2 max(1, pi tau/dt) + G/gain)

For a frozen branch each of n stages may begin with any phase of a wave, so that

    |dM| = (G/tau) |integral_0^t exp((s - t)/tau) u ds|/u <= G min(1 - exp(-T/tau), n pi/(w tau))
    error = |dM|(w = 0)/G(T) + the largest |dM|/G'' of 1/T <= w <= pi/dt

The second term of the error counts only if the surface slides; a wave slower than 1/T does not pass within the history.
A frozen branch can get a map at any time, since the map is G u.
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
    """Return the relaxation function of a material, with moduli in Pa and times in s. Without branches it has no terms,
    only the long-term modulus."""
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
    """Return the temperature of a material [deg C]. If the material gives none, return the reference temperature of its
    shift; NaN without a shift."""
    body = material.fitted
    if not isinstance(body, job.Zener) or body.shift is None:
        return math.nan
    return body.shift.reference if body.temperature is None else body.temperature


def highest_temperature_of(material: Material) -> float:
    """Return the temperature [deg C] at which the tables of a material's shift end; inf without tables."""
    body = material.fitted
    return highest_temperature(body.shift.made) if isinstance(body, job.Zener) and body.shift else math.inf


def factor_at(material: Material, rise: float) -> float:
    """Return the relaxation times of a material after a temperature rise [K], divided by its relaxation times before
    the rise [-]. Raises InputError outside the range of its shift."""
    return time_factor_of(heated(material, temperature_of(material) + rise)) / time_factor_of(material)


class TimeScales(NamedTuple):
    """Time scales of a history.

    `duration` and `shortest` are the duration of the history and its shortest step [s], and `stages` is the number of
    stages with a duration. `jumps` is True if the load jumps after the start, `slides` if the surface slides, and
    `steady` if the history starts in steady sliding.
    """

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
    """Division of a material's branches. `kept` has the numbers of branches whose stress is stored as a map.
    `memoryless` and `frozen` have the numbers of branches without a map.

    All branches without a map together cause a relative error of at most `bound`, which is at most `allowed`. This is
    an error of friction if the surface slides, else an error of the modulus. `memoryless_errors` are the errors that
    each branch would cause if it were memoryless. `reason` states why all branches need maps; it is '' if some need
    none.
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
    """Return which branches of a material have maps.

    If a `reason` is given, all branches have maps. Otherwise the fastest branches are memoryless and the slowest are
    frozen, as many of them as possible while the sum of their errors is at most `allowed`. `prony` has moduli in Pa and
    relaxation times in s. The relaxation times rise, and no two are equal (`physics.prony.normal_form`).
    """
    without_memory, as_spring = memoryless_errors(prony, scales, integrator), frozen_errors(prony, scales)
    fast = (np.cumsum(without_memory) <= MEMORYLESS_SHARE * allowed) & (not reason)
    left = allowed - float(without_memory[fast].sum())
    slow = (np.cumsum(as_spring[::-1])[::-1] <= left) & ~fast & (not reason)
    kept, memoryless, frozen = (tuple(np.flatnonzero(some).tolist()) for some in (~(fast | slow), fast, slow))
    bound = float(without_memory[fast].sum() + as_spring[slow].sum())
    return FoldedBranches(kept, memoryless, frozen, bound, allowed, tuple(without_memory.tolist()), reason)


def memoryless_errors(prony: Prony, scales: TimeScales, integrator: Integrator) -> Array:
    """Return the relative error that each branch causes if it is memoryless. All errors are infinite if the load jumps
    after the start, since the stress after a jump depends on the memory of the branches."""
    if scales.jumps or not scales.shortest:
        return np.full_like(prony.moduli, np.inf)
    decay, gain, _ = coefficients(prony, integrator, scales.shortest)
    waves = np.maximum(1.0, np.pi * prony.relaxation_times / scales.shortest)
    return np.asarray(decay * (2.0 * waves + prony.moduli / gain))


def frozen_errors(prony: Prony, scales: TimeScales) -> Array:
    """Return the relative error that each branch causes if it is treated as a spring. All errors are infinite for a
    history that starts in steady sliding, where the stress of a branch is not G u."""
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
    """Return the bound on the error that branches without a map cause, as text; smaller bounds than LEAST_BOUND are
    stated as LEAST_BOUND."""
    what = "friction" if slides else "the modulus"
    return f"error of {what} at most {per_cent(max(found.bound, LEAST_BOUND))}"


def describe_folded_branches(found: FoldedBranches, prony: Prony, slides: bool) -> list[str]:
    """Return sentences on the branches of a material that have no map. The list is empty if all branches have maps and
    `found` states no reason for this. `prony` has relaxation times in s, and `slides` is True if the surface moves."""
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
