"""A small surface that slides back and forth for as long as one likes: what may drift, and by how much.

Every way there and back is the same: once the transients are over, the body is after each as it was after the last.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from parcontact.files.recorder import StepRow
from parcontact.job import Job
from parcontact.march import scene
from parcontact.march.loop import March, run_steps
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.body import ZenerBody

Json = dict[str, Any]
EPS = float(np.finfo(float).eps)
POINTS, WAY, DT = 8, 8, 2.5e-4  # points along each side; steps of a way, of a cell each, and their length [s]
BRANCHES = [(2e6, 1e-4), (1e6, 1e-3), (0.5e6, 4e-3)]  # modulus [Pa] and relaxation time [s]
PERIOD = 2 * WAY  # steps; it takes 4 ms
SETTLED = 60  # periods after which exp(-t/tau), or the creep of a contact, is below rounding
PRESSURES = {"full": 1e6, "partial": 1e5}  # [Pa]


def back_and_forth(periods: int, contact: str, modulus_inf: float = 1e6) -> Job:
    """Two waves, in full or in partial contact, pressed and slid a given number of times there and back."""
    size = 1e-3
    speed, pressure = size / POINTS / DT, PRESSURES[contact]
    ways = [
        {"pressure": pressure, "duration": WAY * DT, "time_step": DT, "velocity": [way * speed, 0.0]} for way in (1, -1)
    ]
    data: Json = {
        "grid": {"points": POINTS, "size": size},
        "surface": [
            {"shape": "wave", "amplitude": 5e-6, "waves": [1, 0]},
            {"shape": "wave", "amplitude": 3e-6, "waves": [2, 1], "phase": 0.3},
        ],
        "material": {
            "model": "zener",
            "modulus_inf": modulus_inf,
            "branches": [{"modulus": modulus, "relaxation_time": tau} for modulus, tau in BRANCHES],
        },
        "history": [{"pressure": pressure}, *(ways * periods)],
        "numerics": {"tolerance": 1e-12, "branch_error": 0.0},
        "output": {"energy": True},
    }
    return Job.model_validate(data)


@dataclass
class Periods:
    """A task of a march that keeps of each period's end the displacement [m], the branches [Pa m] and the row."""

    states: list[Array] = field(default_factory=list)
    rows: list[StepRow] = field(default_factory=list)

    def __call__(self, march: March) -> None:
        if march.row.step > 1 and (march.row.step - 1) % PERIOD == 0:
            material, memory = march.scene.material, march.state.body
            assert isinstance(material, ZenerBody)
            material.advance_branches(memory)
            units = march.scene.units
            maps = [march.field("displacement"), *(units.modulus * units.height * value for value in memory.branches)]
            self.states.append(np.array(maps))
            self.rows.append(march.row)


@dataclass(frozen=True)
class Drift:
    """Changes from period to period once the transients are over, as parts of the largest value of each map.

    `step`: the largest change within one period; `total`: since the first of them; `mean`: the largest mean
    displacement; `loss`: the largest change of what a period dissipates; `balance`: work that is neither stored nor
    dissipated, over the work; `error`: difference from the closed form of full contact (NaN in partial contact).
    """

    periods: int
    step: float
    total: float
    mean: float
    loss: float
    balance: float
    error: float

    def __str__(self) -> str:
        return (
            f"{self.periods * PERIOD} steps, {self.periods} periods: the body changes within one by {self.step:.1e}, "
            f"in all by {self.total:.1e}; mean displacement {self.mean:.1e}; the loss changes by {self.loss:.1e}; work "
            f"neither stored nor dissipated {self.balance:.1e}; off the closed form {self.error:.1e}"
        )


def drift(periods: int, contact: str, modulus_inf: float = 1e6) -> Drift:
    """March a given number of periods, more than SETTLED."""
    job, found = back_and_forth(periods, contact, modulus_inf), Periods()
    run_steps(March(scene.build(job, Slab.alone(POINTS, POINTS))), [found])
    states = np.array(found.states[SETTLED:])
    sizes = np.abs(states).max(axis=(0, 2, 3), keepdims=True)[0]
    dissipated = np.array([row.dissipated for row in found.rows])
    losses = np.diff(dissipated[SETTLED:])
    works = np.array([row.work for row in found.rows])
    rest = works - dissipated - [row.stored for row in found.rows]
    return Drift(
        len(found.rows),
        float(np.max(np.abs(np.diff(states, axis=0)) / sizes)),
        float(np.max(np.abs(states - states[0]) / sizes)),
        float(np.max(np.abs(states[:, 0].mean(axis=(1, 2)))) / sizes[0].item()),
        float(np.max(np.abs(losses / losses[0] - 1.0))),
        float(np.max(np.abs(rest / works))),
        float(np.max(np.abs(states[-1] - in_full_contact()) / sizes)) if contact == "full" else float("nan"),
    )


def in_full_contact() -> Array:
    """Displacement [m] and branch maps [Pa m] at the end of a period, after infinitely many.

    There u is the surface, less its mean. A period of N increments du adds to a branch
    `H = sum_j decay^j G (phi du_(N-j) + q (du_(N-j) - du_(N-j-1)))` (`physics.body`), the latter not in the first step
    of a way, and leaves `decay^N` of what was before it: `h = H/(1 - decay^N)`.
    """
    x, y = 2 * np.pi * np.arange(POINTS)[None, :] / POINTS, 2 * np.pi * np.arange(POINTS)[:, None] / POINTS
    surface = 5e-6 * np.cos(x) + 3e-6 * np.cos(2 * x + y + 0.3)
    places = [*range(WAY + 1), *range(WAY - 1, -1, -1)]
    change = np.diff([np.roll(surface, place, axis=1) for place in places], axis=0)
    bent = change - np.roll(change, 1, axis=0)
    bent[::WAY] = 0.0
    maps = [surface]
    for modulus, tau in BRANCHES:
        z, decay = DT / tau, np.exp(-DT / tau)
        phi, q = (1.0 - decay) / z, (1.0 + decay) / (2.0 * z) - (1.0 - decay) / z**2
        added = np.tensordot(decay ** np.arange(PERIOD), (phi * change + q * bent)[::-1], axes=1)
        maps.append(modulus * added / (1.0 - decay**PERIOD))
    return np.array(maps)


def campaign(steps: int) -> bool:
    """March for a given number of steps in full and in partial contact; whether nothing drifts."""
    held = True
    for contact in PRESSURES:
        found = drift(-(-steps // PERIOD), contact)
        print(f"{contact} contact: {found}", flush=True)
        held &= not drifts(found)
    return held


def drifts(found: Drift) -> list[str]:
    """What is more than rounding. Of a body that forgets, errors of maps do not add up: some hundred roundings
    whatever the number of steps. Sums of energy round once in every step: their errors grow with it at most."""
    sums = 4 * EPS * found.periods * PERIOD
    allowed = {"step": 200 * EPS, "total": 200 * EPS, "mean": 200 * EPS, "error": 200 * EPS, "balance": sums}
    allowed["loss"] = sums * found.periods  # a difference of two such sums, as a part of that difference
    return [name for name, most in allowed.items() if getattr(found, name) > most]
