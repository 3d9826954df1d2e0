"""What tests of steady sliding start from: a body, and the states of a job."""

from pathlib import Path

from mpi4py import MPI

from parcontact import job as jobs
from parcontact import scene
from parcontact.parallel.slab import Slab
from parcontact.steady_sliding.sliding import SteadySliding

RADIUS, G0, CREEP_TIME = 1.0e-2, 2.75e6, 1.0e-2  # m, Pa, s


def sliding(path: Path, text: str, comm: MPI.Intracomm, *overrides: str) -> SteadySliding:
    file = path / f"steady-{comm.rank}.yaml"
    file.write_text(text)
    job = jobs.load(file, overrides)
    return SteadySliding(scene.frame(job, Slab(comm, *job.grid.points)))
