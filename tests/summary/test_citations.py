"""The references of a run follow from its job."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from parcontact import job
from parcontact.errors import InputError
from parcontact.summary import citations

JOB: dict[str, Any] = {
    "grid": {"points": 64, "size": 1e-3},
    "surface": {"shape": "wave", "amplitude": 1e-7, "waves": [1, 1]},
    "material": {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]},
    "history": [{"pressure": 1e3, "duration": 1e-3}],
}


def test_what_to_cite(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no run"):
        citations.describe(tmp_path)
    data = {**JOB, "grid": {**JOB["grid"], "boundary": "free"}, "surface": {"shape": "sphere", "radius": 1e-2}}
    (tmp_path / "job.yaml").write_text(yaml.safe_dump({**data, "material": {"model": "elastic", "shear_modulus": 1e6}}))
    (tmp_path / "job.resolved.yaml").write_text(job.load(tmp_path / "job.yaml").resolved())
    elastic = citations.describe(tmp_path)
    assert "Love" in elastic
    assert "Bugnicourt" not in elastic
    assert "Persson" not in elastic
    (tmp_path / "theory.csv").touch()
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))
    (tmp_path / "job.resolved.yaml").write_text(job.load(tmp_path / "job.yaml").resolved())
    rubber = citations.describe(tmp_path)
    assert "Love" not in rubber
    assert "Bugnicourt" in rubber
    assert "Persson" in rubber
    assert "Taylor" in rubber


@pytest.mark.parametrize(("name", "credited"), [("road.npy", False), ("road.txt", False), ("road.nc", True)])
def test_surface_topography_is_credited_for_what_it_reads(tmp_path: Path, name: str, credited: bool) -> None:
    (tmp_path / name).touch()
    part = {"shape": "topography", "path": name, "unit": "um", "pixel": 1e-6}
    (tmp_path / "job.yaml").write_text(yaml.safe_dump({**JOB, "surface": part}))
    (tmp_path / "job.resolved.yaml").write_text(job.load(tmp_path / "job.yaml").resolved())
    assert ("SurfaceTopography" in citations.describe(tmp_path)) == credited
