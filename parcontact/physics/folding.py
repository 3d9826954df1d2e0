"""Branches that a job cannot tell from springs: which may go without a map, and what that costs at most.

With the notation of `physics.body`, branch k of modulus G and relaxation time tau adds `h <- decay h + gain du` to the
stress. Two kinds of branches need no map:

    memoryless  far faster than every step: what it remembers of the last step, `decay h`, is dropped, `gain du` stays
    frozen      far slower than the whole history: h = G u, a part of the elastic modulus

A memoryless branch keeps its share of the instantaneous modulus and of the losses within a step; what is dropped is not
summed up, as the next h does not contain it. A frozen branch can be woken at any time: its map is G u.

Bounds. Let a wave of the surface pass with the frequency w = |q v|, its displacement u of constant size (full contact).
The transfer modulus M = stress/u of the wave is wrong by

    memoryless  |dM| <= decay(dt) |h/u|,   |h/u| <= G min(w tau, 1) in sliding, either integrator
                                           |h/u| <= G after a jump,  G min(tau/dt, 1) at rest
                |dM| <= |h/u| in a jump (dt = 0) itself, where decay = 1
    frozen      |dM| = (G/tau) |integral_0^t exp((s - t)/tau) u(s) ds|/|u|
                     <= G min(1 - exp(-t/tau), sum over phases of min(duration, c/w)/tau)

with c = 2 for the integral of a wave and for the trapezoidal sums of the exponential integrator (x/tan x <= 1), and
c = pi for those of backward Euler (x/sin x <= pi/2, x = w dt/2). In full contact friction is
`sum |q| |qx| |A|^2 Im M/p0`, therefore wrong by no more than

    F = (sum |q| |qx| |A|^2 |dM|)/(sum |q| |qx| |A|^2 G''(w))

of its steady value. Waves of one length and of all directions are summed, their power being the same, and F is that of
the worst length: the whole is no worse than its worst part.

In partial contact the modulus also decides how far contacts sink in, and so on their area and friction. As area ~ 1/|M|
this share is estimated as the largest |dM|/|M| of all waves, those of the edges of contacts, of two cells, among them,
and added to F; it is all there is at rest. One of the waves never passes and has the modulus G(t): along the tracks of
contacts a body yields as one at rest does, however fast they run. A frozen branch is then wrong by
`G (1 - exp(-t/tau))/G(t)`, which bounds the error of the creep compliance too (dJ/J <= dG/G, as J and dG grow and
J G <= 1). Measured from 0.6 to 35 % of contact, after 0.5 to 30 mm of sliding, errors were a twentieth of this bound up
to all of its second part, which is reached where few contacts carry the load.

Errors of branches are added; the bound is that of the worst phase for each. Source: the moduli are those of
J. D. Ferry, Viscoelastic Properties of Polymers (1980), chapter 3; friction in full contact is that of
`theory.full_contact`.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..parallel.slab import Array
from .prony import Integrator, Prony, coefficients, complex_modulus, relaxation

LENGTHS, DIRECTIONS = 13, 64  # accuracy: of a band that are looked at
PER_DECADE = 4  # accuracy: lengths of growing steps that are looked at
MEMORYLESS_SHARE = 0.5  # tuning: of the error for memoryless branches, which must not depend on how long a job is


@dataclass(frozen=True)
class Phase:
    """A stretch of the history with one velocity [m/s]: how long it lasts [s], its first and its last step [s].

    Steps grow from the first to the last. `jump`: it begins with a jump of the load. A phase may be a jump only.
    """

    duration: float
    first: float
    last: float
    velocity: tuple[float, float]
    jump: bool

    @property
    def steps(self) -> Array:
        """Some from the first to the last [s]: while they grow, the modulus of a step may fall before memory does."""
        return np.geomspace(self.first, self.last, 1 + math.ceil(PER_DECADE * abs(math.log10(self.last / self.first))))


@dataclass(frozen=True)
class Band:
    """Waves of the surface: wave numbers [rad/m] from `low` to `high`, along one direction or (None) along all.

    `finest` is that of a wave of two cells.
    """

    low: float
    high: float
    finest: float
    direction: tuple[float, float] | None = None

    @property
    def vectors(self) -> tuple[Array, Array]:
        """Wave vectors (kx, ky) [rad/m], shape (lengths, directions); opposite ones are the same waves.

        The last one of each length is 0: it stands for a wave that never passes. The last length is the finest one.
        """
        lengths = np.geomspace(self.low, self.high, LENGTHS if self.high > self.low else 1)
        lengths = np.append(lengths, self.finest)[:, None]
        angles = np.pi * (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
        along = np.stack([np.cos(angles), np.sin(angles)])
        if self.direction is not None:
            along = np.array(self.direction)[:, None] / (math.hypot(*self.direction) or 1.0)
        return lengths * np.append(along[0], 0.0), lengths * np.append(along[1], 0.0)


@dataclass(frozen=True)
class FoldedBranches:
    """The role of each branch, by its number in the material; plain data.

    `bound` is the largest relative error of friction (where the body rests: of the modulus) that all folded branches
    make together, at most `allowed`. `memoryless_errors` and `frozen_errors` are what each branch would add to it.
    `reason` says why nothing may be folded, if so.
    """

    kept: tuple[int, ...]
    memoryless: tuple[int, ...] = ()
    frozen: tuple[int, ...] = ()
    bound: float = 0.0
    allowed: float = 0.0
    memoryless_errors: tuple[float, ...] = ()
    frozen_errors: tuple[float, ...] = ()
    reason: str = ""

    @property
    def folded(self) -> int:
        """How many branches have no map."""
        return len(self.memoryless) + len(self.frozen)


def keep_all(prony: Prony, reason: str) -> FoldedBranches:
    """Every branch keeps its map, for that reason."""
    return FoldedBranches(tuple(range(prony.moduli.size)), reason=reason)


def fold_branches(
    prony: Prony,
    phases: Sequence[Phase],
    bands: Sequence[Band],
    integrator: Integrator,
    allowed: float,
    start: tuple[float, float] | None = None,
) -> FoldedBranches:
    """Which branches of a material (Pa, s, in normal form) a history needs on a surface, friction being wrong by a
    share of `allowed` at most.

    `start` is the velocity [m/s] of a steady initial state, None for a virgin body: after steady sliding no branch is
    G u. Memoryless branches are chosen first, within half of what is allowed, and in either kind the cheapest first.
    """
    as_memoryless, as_frozen = _errors(prony, phases, bands, integrator, start)
    count = prony.moduli.size
    if not any(phase.duration for phase in phases) and start is None:
        as_memoryless = np.full(count, np.inf)  # a body that has no time is elastic
    memoryless, spent = _choose_cheapest(as_memoryless, range(count), MEMORYLESS_SHARE * allowed)
    others = [k for k in range(count) if k not in memoryless]
    frozen, more = _choose_cheapest(as_frozen, others, allowed - spent)
    kept = tuple(k for k in others if k not in frozen)
    errors = tuple(as_memoryless.tolist()), tuple(as_frozen.tolist())
    return FoldedBranches(kept, memoryless, frozen, spent + more, allowed, *errors)


# -- parts ------------------------------------------------------------------------------------------------------------


def _choose_cheapest(errors: Array, candidates: Iterable[int], limit: float) -> tuple[tuple[int, ...], float]:
    """The candidates with the smallest errors, ascending in number, and their sum, which keeps to the limit."""
    chosen: list[int] = []
    spent = 0.0
    for k in sorted(candidates, key=lambda k: float(errors[k])):
        if limit <= 0.0 or spent + errors[k] > limit:
            break
        spent += float(errors[k])
        chosen.append(k)
    return tuple(sorted(chosen)), spent


def _errors(
    prony: Prony,
    phases: Sequence[Phase],
    bands: Sequence[Band],
    integrator: Integrator,
    start: tuple[float, float] | None,
) -> tuple[Array, Array]:
    """The error of each branch as a memoryless and as a frozen one: the largest of all phases and waves."""
    found = [
        errors
        for band in bands or [Band(1.0, 1.0, 1.0, (0.0, 0.0))]  # a flat surface: every phase is one of rest
        for errors in _Waves(prony, integrator, *band.vectors).errors(phases, start)
    ]
    as_memoryless, as_frozen = np.max(found or np.zeros((1, 2, prony.moduli.size)), axis=0, initial=0.0)
    return as_memoryless, as_frozen


@dataclass(frozen=True)
class _Past:
    """History of the waves of a band so far, shape (lengths, directions).

    `omega` [rad/s] is the frequency at which they pass now; `seen` [s] is what the integral of a wave's u is at most;
    `held` [Pa], with an axis of branches, is what |h/u| is at most.
    """

    omega: Array
    held: Array
    seen: Array
    time: float = 0.0


@dataclass(frozen=True)
class _Waves:
    """The waves of a band, with wave vectors (kx, ky) [rad/m], on a body; arrays end with an axis of branches."""

    prony: Prony
    integrator: Integrator
    kx: Array
    ky: Array

    def errors(self, phases: Sequence[Phase], start: tuple[float, float] | None) -> Iterator[tuple[Array, Array]]:
        """The error of each branch in each phase, as a memoryless and as a frozen one; as `fold_branches` says."""
        past = self.before(start)
        for phase in phases:
            as_memoryless: Array = np.zeros(self.prony.moduli.size)
            as_frozen = np.zeros_like(as_memoryless) if start is None else np.full_like(as_memoryless, np.inf)
            if phase.jump:
                as_memoryless = self.share(past.omega, past.held, self.modulus(0.0))
                past = replace(past, held=np.broadcast_to(self.prony.moduli, past.held.shape))
            if phase.duration > 0.0:
                as_memoryless = np.maximum(as_memoryless, self.memoryless_error(past, phase))
                past = self.after(past, phase)
                as_frozen = as_frozen + self.frozen_error(past)
            yield as_memoryless, as_frozen

    def before(self, start: tuple[float, float] | None) -> _Past:
        """In a virgin body, or (start) in steady sliding at a velocity [m/s]."""
        omega = self.frequency(start or (0.0, 0.0))
        held = self.steady(omega) if start else np.zeros((*omega.shape, self.prony.moduli.size))
        return _Past(omega, held, np.zeros(omega.shape))

    @np.errstate(over="ignore")  # infinitely many periods are all right
    def after(self, past: _Past, phase: Phase) -> _Past:
        """After a phase that lasts."""
        omega = self.frequency(phase.velocity)
        decay, gain = self.step(phase.last)
        held = decay * self.most(past, phase) + np.where(omega[..., None] > 0.0, self.steady(omega), gain)
        swing = np.pi if self.integrator == "backward-euler" else 2.0
        longest = np.divide(swing, omega, out=np.full_like(omega, np.inf), where=omega > 0.0)
        seen = past.seen + np.minimum(phase.duration, longest)
        return _Past(omega, held, seen, past.time + phase.duration)

    def memoryless_error(self, past: _Past, phase: Phase) -> Array:
        """The largest error of a step of the phase without the memory of a branch."""
        omega, held = self.frequency(phase.velocity), self.most(past, phase)
        return np.max([self.share(omega, self.step(dt)[0] * held, self.modulus(dt)) for dt in phase.steps], axis=0)

    @np.errstate(over="ignore")  # infinitely many relaxation times are all right
    def frozen_error(self, past: _Past) -> Array:
        """The error of a branch that has relaxed."""
        tau = self.prony.relaxation_times
        relaxed = -np.expm1(-past.time / tau)
        wrong = self.prony.moduli * np.minimum(past.seen[..., None] / tau, relaxed)
        return self.share(past.omega, wrong, float(relaxation(past.time, *self.prony)))

    def frequency(self, velocity: tuple[float, float]) -> Array:
        """[rad/s] at which waves pass a point of the body at a velocity [m/s]."""
        return np.abs(self.kx * velocity[0] + self.ky * velocity[1])

    def steady(self, omega: Array) -> Array:
        """|h/u| [Pa] of each branch in steady sliding, at most."""
        return np.asarray(self.prony.moduli * np.minimum(omega[..., None] * self.prony.relaxation_times, 1.0))

    def most(self, past: _Past, phase: Phase) -> Array:
        """|h/u| [Pa] of each branch at the start of any step of a phase, at most."""
        omega = self.frequency(phase.velocity)
        resting = self.prony.moduli * np.minimum(self.prony.relaxation_times / phase.first, 1.0)
        return np.maximum(past.held, np.where(omega[..., None] > 0.0, self.steady(omega), resting))

    def step(self, dt: float) -> tuple[Array, Array]:
        """`decay` and `gain` of each branch."""
        return coefficients(self.prony, self.integrator, dt)

    def modulus(self, dt: float) -> float:
        """The modulus [Pa] of a step."""
        return float(self.prony.modulus_inf + self.step(dt)[1].sum())

    def share(self, omega: Array, wrong: Array, modulus: float) -> Array:
        """An error |dM| [Pa] of each wave and branch as a part of friction; waves at rest have `modulus` [Pa]."""
        moving = complex_modulus(omega, *self.prony)
        size = np.where(omega > 0.0, np.abs(moving), modulus)
        error = _over(wrong, size[..., None]).max(axis=(0, 1))
        if omega.any():
            weight = omega[:-1] / omega[:-1].max(axis=1, keepdims=True)  # |qx|: w over q v
            loss = (weight * moving[:-1].imag).sum(axis=1)
            error = error + _over(np.einsum("ij,ijk->ik", weight, wrong[:-1]), loss[:, None]).max(axis=0)
        return np.asarray(error)


def _over(wrong: Array, size: Array) -> Array:
    """An error as a part of a size: none if there is no error, infinite if there is no size (a fluid long at rest)."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(wrong / size, nan=0.0, posinf=np.inf))
