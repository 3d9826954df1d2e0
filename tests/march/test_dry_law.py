"""The contact law without adhesion: when it starts cold, and that pressures stay below the hardness."""

from typing import Any

import pytest
from marched_jobs import column, marched
from restarting import ELASTIC, SPHERE

from parcontact.contact import starts

LOADS = [{"pressure": 1e3}, {"pressure": 2e4}]
JOB: dict[str, Any] = {"grid": {"points": 24, "size": 1e-3}, "surface": SPHERE, "history": LOADS}


def test_only_the_first_contact_starts_cold(monkeypatch: pytest.MonkeyPatch) -> None:
    prepare, cold = starts.prepare_start, list[float]()

    def note(solver: Any, problem: Any, *others: Any) -> Any:
        cold.append(problem.control.mean)
        return prepare(solver, problem, *others)

    monkeypatch.setattr(starts, "prepare_start", note)
    march, rows = marched({**JOB, "material": ELASTIC})
    unit = march.state.contact.last.alpha * march.scene.units.pressure
    assert [mean * unit for mean in cold] == pytest.approx([rows[1].measures.pressure], rel=1e-12)


def test_no_pressure_is_above_the_hardness() -> None:
    """The highest pressure of the sphere is half of the hardness under the first load, and reaches it under the
    second; solved to 1e-10."""
    scene = {**JOB, "numerics": {"tolerance": 1e-10}}
    _, soft = marched({**scene, "material": ELASTIC})
    hardness = 2.0 * soft[1].measures.max_pressure
    assert soft[-1].measures.max_pressure > hardness > 2.0 * soft[-1].measures.pressure
    _, hard = marched({**scene, "material": {**ELASTIC, "hardness": hardness}})
    assert column(hard, "max_pressure")[1] == pytest.approx(hardness / 2.0, rel=1e-6)
    assert column(hard, "max_pressure")[-1] == pytest.approx(hardness, rel=1e-12)
