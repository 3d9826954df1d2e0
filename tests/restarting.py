"""Short jobs, their runs, and what a run has left, for tests of runs that are cut into pieces."""

import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import h5py
import yaml
from csv_rows import measures as rows
from mpi4py import MPI

from parcontact import job
from parcontact.files import outputs, run
from parcontact.files.stopping import Options
from parcontact.parallel.slab import Slab

ROUGH = {
    "shape": "rough",
    "hurst": 0.8,
    "long_wavelength": 5e-4,
    "short_wavelength": 2e-4,
    "rms_slope": 0.02,
    "seed": 3,
}
WAVE = {"shape": "wave", "amplitude": 1e-6, "waves": [2, 1]}
SPHERE = {"shape": "sphere", "radius": 1e-2}
ELASTIC = {"model": "elastic", "shear_modulus": 1e6}
ZENER = {
    "model": "zener",
    "modulus_inf": 1e6,
    "branches": [{"modulus": 2e6, "relaxation_time": 1e-3}, {"G0": 1e6, "G1": 5e5, "eta1": 20.0}],
}
PRESS = {"name": "press", "pressure": 1e5, "duration": 1e-3, "time_step": {"first": 1e-4, "growth": 2.0}}
SLIDE = {"name": "slide", "pressure": 1e5, "velocity": 0.2, "distance": 2e-4, "cells_per_step": 1}
FASTER = {"name": "faster", "pressure": 2e5, "velocity": 1.0, "distance": 1.5e-4, "cells_per_step": 1}
OBLIQUE = {"name": "oblique", "pressure": 1e5, "velocity": [0.2, 0.1], "duration": 4e-4, "time_step": 1e-4}
RAMP = {"name": "ramp", "pressure": {"from": 1e5, "to": 3e5}, "duration": 4e-4, "time_step": 1e-4}
LIFT = {"name": "lift", "approach": {"from": 1e-6, "to": 5e-7}, "duration": 4e-4, "time_step": 1e-4}
TOUCH = {"name": "touch", "pressure": 1e5}
GLIDE = {"pressure": 1e5, "velocity": 0.1, "distance": 2e-4}  # chooses its steps, more of them than estimated
SCENES: dict[str, tuple[str, Any, Any, list[Any], dict[str, Any]]] = {  # boundary, surface, material, history, numerics
    "elastic": ("periodic", ROUGH, ELASTIC, [TOUCH, SLIDE, FASTER], {}),
    "viscoelastic": ("periodic", ROUGH, ZENER, [PRESS, SLIDE, FASTER], {}),
    "chosen": ("periodic", WAVE, {"include": "synthetic_tyre"}, [GLIDE], {"accuracy": 0.1}),
    "free": ("free", SPHERE, ZENER, [PRESS, {**OBLIQUE, "name": "slide"}], {}),
    "approach": ("free", SPHERE, ZENER, [LIFT, {**LIFT, "velocity": 0.1}], {}),
    "mixed": (
        "periodic",
        [ROUGH, SPHERE],
        {**ZENER, "hardness": 1e6},
        [RAMP, OBLIQUE, {**SLIDE, "pressure": {"from": 3e5, "to": 0.0}, "cells_per_step": 0.7}],
        {"precision": "mixed", "tolerance": 1e-3, "integrator": "backward-euler"},
    ),
}


@dataclass
class Bench:
    """Runs jobs in a directory that all ranks see."""

    comm: MPI.Intracomm
    where: Path

    def job(self, name: str, **changes: Any) -> dict[str, Any]:
        """A job; a mapping among the changes is merged into its section."""
        boundary, surface, material, history, numerics = SCENES[name]
        data: dict[str, Any] = {
            "grid": {"points": [20, 14], "size": [1e-3, 7e-4], "boundary": boundary},
            "surface": surface,
            "material": material,
            "history": history,
            "numerics": numerics,
            "output": {
                "fields": ["pressure", "displacement", "gap", "height"],
                "energy": True,
                "branch_dissipation": True,
            },
            "checkpoint": {"every": 1, "keep": 1000},
        }
        for key, value in changes.items():
            merged = isinstance(value, dict) and not value.keys() & {"shape", "model"}
            data[key] = {**data.get(key, {}), **value} if merged else value
        return data

    def run(self, data: dict[str, Any], out: Path, **options: Any) -> int:
        path = self.where / f"{out.name}.yaml"
        if self.comm.rank == 0:
            path.write_text(yaml.safe_dump(data))
        self.comm.Barrier()
        loaded = job.load(path, [f"output.directory={out}"])
        return run.run_job(loaded, Slab(self.comm, *loaded.grid.points), Options(quiet=True, **options))


def maps(path: Path) -> dict[str, bytes]:
    """All numbers of a checkpoint or a file of fields but the transform plans."""
    found: dict[str, bytes] = {}

    def take(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and not name.startswith("plans"):
            found[name] = item[()].tobytes()

    with h5py.File(path) as file:
        file.visititems(take)
    return found


def same(one: Path, other: Path, step: int) -> None:
    assert rows(one) == rows(other)
    assert maps(one / "fields.h5") == maps(other / "fields.h5")
    last = f"checkpoint/step-{step}.h5"
    assert maps(one / last) == maps(other / last)


def cut(bench: Bench, whole: Path, step: int) -> Path:
    """A copy of a run that was killed after its last step, of which the checkpoints after `step` are lost."""
    copy = whole.with_name(f"{whole.name}-{step}")
    if bench.comm.rank == 0:
        shutil.copytree(whole, copy)
        for path in (copy / "checkpoint").glob("step-*.h5"):
            if int(path.stem.removeprefix("step-")) > step:
                path.unlink()
        if step == 0:  # before its first checkpoint
            claims = outputs.read_claims(copy)
            outputs.write_claims(copy, {"run": replace(claims["run"], saved=False)})
    bench.comm.Barrier()
    return copy


def part_way(bench: Bench, data: dict[str, Any], step: int = 6) -> Path:
    """A run that was stopped after a step."""
    out = bench.where / "out"
    assert bench.run(data, bench.where / "whole") == 0
    return cut(bench, bench.where / "whole", step).rename(out)
