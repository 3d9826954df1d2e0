"""A viscoelastic body with branches far from its time steps, and its energies."""

from typing import Any

import numpy as np
import pytest
from marching import BRANCHES, SLS, begun, column, marched
from numpy.testing import assert_allclose

from parcontact.march.loop import March
from parcontact.physics.body import BodyMemory, ZenerBody, surface_of
from parcontact.physics.energy import ElasticPressure, ZenerEnergy

Json = dict[str, Any]


def bumps(**changes: Any) -> Json:
    return {
        "grid": {"points": [32, 24], "size": [1e-3, 0.75e-3]},
        "surface": [
            {"shape": "wave", "amplitude": 1e-6, "waves": [2, 1]},
            {"shape": "wave", "amplitude": 5e-7, "waves": [-1, 3], "phase": 0.4},
            {"shape": "sphere", "radius": 0.05},
        ],
        "material": SLS,
        "history": [
            {"pressure": 2e4, "duration": 2e-3, "time_step": {"first": 1e-4, "growth": 1.5}},
            {"pressure": 3e4, "velocity": [0.1, 0.02], "duration": 2e-3, "time_step": 2e-4},
            {"pressure": 0.0, "duration": 1e-3, "time_step": 5e-4},
            {"pressure": {"from": 0.0, "to": 2e4}, "velocity": -0.05, "duration": 2e-3, "time_step": 5e-4},
        ],
        "numerics": {"tolerance": 1e-9},
        "output": {"energy": True},
        **changes,
    }


MEASURES = ("pressure", "force_x", "force_y", "friction", "contact_area", "approach", "mean_gap", "max_pressure")
ENERGIES = ("work", "stored", "dissipated")


def numbers(data: Json) -> dict[str, np.ndarray]:
    _, rows = marched(data)
    return {name: column(rows, name) for name in ("time", *MEASURES, *ENERGIES)}


@pytest.mark.parametrize("integrator", ["exponential", "backward-euler"])
def test_branches_far_from_the_time_steps(integrator: str) -> None:
    """A relaxation time of 1e9 s is a spring, one of 1e-15 s nothing (after a jump it would be felt). To 1e-8."""
    load = {"pressure": {"from": 0.0, "to": 2e4}, "velocity": 0.1, "duration": 2e-3, "time_step": 2e-4}
    common = {"history": [load], "numerics": {"tolerance": 1e-9, "integrator": integrator}}

    def measures(modulus_inf: float, *more: Json) -> dict[str, np.ndarray]:
        material = {"model": "zener", "modulus_inf": modulus_inf, "branches": [*BRANCHES, *more]}
        return numbers(bumps(material=material, **common))

    slow = measures(0.275e6, {"modulus": 1e6, "relaxation_time": 1e9})
    fast = measures(0.275e6, {"modulus": 1e6, "relaxation_time": 1e-15})
    for found, expected in ((slow, measures(1.275e6)), (fast, measures(0.275e6))):
        for name in MEASURES:
            scale = np.abs(expected[name]).max()
            assert_allclose(found[name], expected[name], rtol=0, atol=1e-8 * scale, err_msg=name)


# -- energy ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("boundary", "kernel"), [("periodic", "spectral"), ("periodic", "love"), ("free", "love")])
def test_energies_are_those_of_the_maps(boundary: str, kernel: str) -> None:
    """Stored energy from the branch maps themselves and A^-1, and the balance, after jumps, sliding, no contact.

    In a free scene the inverse of the operator is known only through what has been: the body's laws in pressures.
    """
    data = bumps(numerics={"tolerance": 1e-6, "kernel": kernel})
    data["grid"]["boundary"] = boundary
    checked = []

    def check(march: March) -> None:
        energy, body = march.scene.energy, march.scene.material
        assert march.state.energy is not None
        assert isinstance(energy, ZenerEnergy)
        assert isinstance(body, ZenerBody)
        maps = maps_of(body, march.state.body)
        if isinstance(energy.inverse, ElasticPressure):
            inner = maps_of(energy.inverse.body, march.state.energy.elastic)[0]
            assert_allclose(applied(march, inner), maps[0], rtol=0, atol=1e-12 * np.abs(maps[0]).max())
        inverses = [inverse(march, index) for index in range(len(maps))]
        weights = [body.prony.modulus_inf, *(1.0 / body.prony.moduli)]
        direct = 0.5 * sum(w * np.sum(a * b) for w, a, b in zip(weights, maps, inverses, strict=True))
        assert march.state.energy.stored == pytest.approx(direct, rel=1e-9, abs=1e-30)
        checked.append(direct)

    _, rows = marched(data, [check])
    assert max(checked) > 0.0
    for row in rows:
        assert row.stored + row.dissipated == pytest.approx(row.work, rel=1e-11, abs=1e-30)
        assert row.dissipated == pytest.approx(sum(row.branch_dissipation), rel=1e-12)


def maps_of(body: ZenerBody, memory: BodyMemory | None) -> list[np.ndarray]:
    """The displacement and the branch maps."""
    assert memory is not None
    body.settle(memory)
    return [surface_of(memory), *memory.branches]


def applied(march: March, field: np.ndarray) -> np.ndarray:
    out = np.empty_like(field)
    return march.scene.operators.operator.apply(np.ascontiguousarray(field), out)


def inverse(march: March, index: int) -> np.ndarray:
    """A^-1 of the displacement (0) or of a branch map (1, 2, ...)."""
    scene = march.scene
    body, energy = scene.material, scene.energy
    assert march.state.energy is not None
    assert isinstance(energy, ZenerEnergy)
    assert isinstance(body, ZenerBody)
    if isinstance(energy.inverse, ElasticPressure):
        return maps_of(energy.inverse.body, march.state.energy.elastic)[index]
    field = maps_of(body, march.state.body)[index]
    return scene.operators.preconditioner.apply(field, np.empty_like(field))


def test_energy_costs_nothing_unless_asked_for() -> None:
    """No map and no operator application more."""
    data = bumps()
    plain = begun({**data, "output": {}})
    asked = begun(data)
    assert plain.scene.energy is None
    assert asked.scene.slab.tally["map bytes"] == plain.scene.slab.tally["map bytes"]
