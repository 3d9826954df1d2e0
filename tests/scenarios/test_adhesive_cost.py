"""What adhesion costs: operator calls of steps with it, over those of the same steps without."""

from itertools import pairwise

import numpy as np
import pytest
from marching import begun
from numpy.typing import NDArray
from sticking import ELASTIC, MODULUS, Job, ramp

SIZE, POINTS, SLOPE = 1e-4, 128, 0.1
RUBBER: Job = {
    "model": "zener",
    "modulus_inf": MODULUS / 4,
    "branches": [{"modulus": 9e6, "relaxation_time": 1.0}],
}


def steps(job: Job) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Operator calls of each step but the first two, and how far edges of contact moved in it: the points that come
    into contact or leave it over the points in contact."""
    march, calls, contacts = begun(job), [], []
    for step in march.steps():
        march.advance(step)
        calls.append(march.row.operator_calls)
        contacts.append(march.field("gap") == 0.0)
    moved = [np.sum(one != other) / max(other.sum(), 1) for one, other in pairwise(contacts)]
    return np.array(calls[2:]), np.array(moved[1:])


@pytest.mark.parametrize(("body", "strength"), [(ELASTIC, 0.01), (ELASTIC, 0.05), (RUBBER, 0.01)])
def test_a_resolved_step_with_adhesion(body: Job, strength: float) -> None:
    """Pressed and let go, with a work of adhesion over E* slope^2 and the shortest wave: at most three times the calls
    of the same steps without, to the same tolerance, where edges of contact move little."""
    cell = SIZE / POINTS
    waves = {"hurst": 0.8, "long_wavelength": SIZE / 4, "short_wavelength": 8 * cell, "rms_slope": SLOPE, "seed": 1}
    job: Job = {
        "grid": {"points": POINTS, "size": SIZE},
        "surface": {"shape": "rough", **waves},
        "material": body,
        "history": [{"pressure": 1.0}],
        "numerics": {"tolerance": 5e-3},
    }
    height = float(begun(job).field("height").std())
    low, high = -2.5 * height, -height
    count = 4 * int(np.ceil((high - low) / (SLOPE * cell)))
    job["history"] = [ramp(low, high, count), ramp(high, low, count)]
    sticks = {"work": strength * MODULUS * SLOPE**2 * 8 * cell, "range": "auto"}
    (calls, moved), (without, _) = steps({**job, "adhesion": sticks}), steps(job)
    resolved = moved < 0.2
    assert resolved.sum() >= 5
    assert 0.5 < calls[resolved].sum() / without[resolved].sum() < 3.0
