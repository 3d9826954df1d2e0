"""A body of one's own, made as the page on the architecture says: its errors by the time steps, and its steps.

It relaxes as rubber does, but the program sees no branches: neither in its section nor in the body.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from marched_jobs import column, marched

import parcontact as pc
from parcontact.errors import InputError
from parcontact.job import Job
from parcontact.job.materials import Elastic
from parcontact.march import scene
from parcontact.march.curve import on_one_grid
from parcontact.parallel.slab import Slab
from parcontact.physics.body import BodyMemory, Trial, ZenerBody
from parcontact.physics.prony import Prony

TIME = 1e-3  # relaxation time [s]
ROUGH = {"shape": "rough", "hurst": 0.8, "long_wavelength": 5e-4, "short_wavelength": 2.5e-4, "rms_slope": 0.05}
GIVEN = {"grid": {"points": 32, "size": 1e-3}, "material": {"model": "elastic", "shear_modulus": 1e6}}
REST = {"pressure": 2e4, "duration": 4 * TIME}


class Gum(Elastic):
    """Its section: like the one of an elastic body, with a memory."""

    remembers: ClassVar[bool] = True


class OwnBody:
    """A body that is stiffer at once by a factor of five, by backward Euler."""

    branched = None
    shortest_time = TIME

    def __init__(self, slab: Slab, modulus: float) -> None:
        series = Prony(modulus, np.array([4.0 * modulus]), np.array([TIME]))
        self.body = ZenerBody(slab, series, "backward-euler")

    def __getattr__(self, name: str) -> Any:
        return getattr(self.body, name)


class JudgedBody(OwnBody):
    """The same with an estimate: backward Euler is of first order, with half a step over the relaxation time."""

    def time_error(self, memory: BodyMemory, trial: Trial, dt: float) -> float:
        return 0.5 * dt / TIME


def job(stage: dict[str, Any]) -> Job:
    return Job.model_validate({**GIVEN, "surface": ROUGH, "history": [stage]}).model_copy(
        update={"material": Gum(shear_modulus=1e6)}
    )


@pytest.fixture
def use(monkeypatch: pytest.MonkeyPatch) -> Callable[[type[OwnBody]], None]:
    def replace(kind: type[OwnBody]) -> None:
        monkeypatch.setattr(
            scene, "_body_and_energy", lambda setup, *_: (kind(setup.slab, setup.prony.modulus_inf), None)
        )

    return replace


def area(steps: int, use: Callable[[type[OwnBody]], None], kind: type[OwnBody]) -> tuple[float, float]:
    """Return the corrected area after some of the equal steps, and its stated error."""
    use(kind)
    _, rows = marched(job({**REST, "time_step": REST["duration"] / steps}))
    return rows[len(rows) // 2].measures.contact_area_corrected, rows[len(rows) // 2].error_area


def test_without_an_estimate_no_error_is_stated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, use: Callable[[type[OwnBody]], None]
) -> None:
    """The area is wrong by more than a per cent, and mesh and solver alone would state less. The log says why."""
    (coarse, unknown), (fine, _) = area(4, use, OwnBody), area(128, use, OwnBody)
    assert abs(coarse / fine - 1.0) > 0.01
    assert math.isnan(unknown)
    monkeypatch.chdir(tmp_path)
    wave = {"surface": {"shape": "wave", "amplitude": 1e-6, "waves": [2, 2]}, "output": {"directory": "out"}}
    run = pc.Simulation({**GIVEN, **wave, "history": [{**REST, "time_step": TIME}]})
    assert math.isnan(run.run().error_area)
    log = Path("out/run.log").read_text()
    assert "the body has no estimate of the error by the time steps: no errors are stated" in log


def test_an_estimate_of_its_own_is_stated(use: Callable[[type[OwnBody]], None]) -> None:
    """It counts for friction and the area in full, and covers the error."""
    (coarse, stated), (fine, _) = area(4, use, JudgedBody), area(128, use, JudgedBody)
    assert 0.5 < stated < 0.6  # half a relaxation time, and the mesh
    assert abs(coarse / fine - 1.0) < stated


def test_it_chooses_its_steps_by_its_own_estimate(use: Callable[[type[OwnBody]], None]) -> None:
    """Steps of a rest are as long as the estimate allows; without one they cannot be chosen."""
    use(JudgedBody)
    _, rows = marched(job(REST))
    longest = max(np.diff(column(rows, "time")))
    assert 0.0 < longest < 0.2 * TIME
    use(OwnBody)
    with pytest.raises(InputError, match="states no error by its steps"):
        marched(job(REST))


def test_its_rest_is_not_cut_short(use: Callable[[type[OwnBody]], None]) -> None:
    """As it would be for an elastic body, which does not change at rest."""
    use(OwnBody)
    _, rows = marched(job({**REST, "time_step": {"first": TIME / 10, "growth": 1.5}}))
    assert len(rows) > 6
    assert column(rows, "contact_area")[-1] > column(rows, "contact_area")[2]


def test_steady_sliding_refuses_it() -> None:
    """It has no complex modulus, and would be taken for elastic."""
    with pytest.raises(InputError, match="material: steady sliding knows a body by its moduli"):
        on_one_grid(job(REST), Slab.alone(32, 32))
