"""What tests of steady sliding start from: a body, and the states of a job; and how well a state is solved."""

from pathlib import Path

import numpy as np
from mpi4py import MPI
from rubbers import complex_modulus

from parcontact import job as jobs
from parcontact.effects.branches import relaxation_of
from parcontact.march import scene
from parcontact.march.steady import SteadySliding
from parcontact.parallel.slab import Slab

RADIUS, G0, CREEP_TIME = 1.0e-2, 2.75e6, 1.0e-2  # m, Pa, s


def sliding(path: Path, text: str, comm: MPI.Intracomm, *overrides: str) -> SteadySliding:
    file = path / f"steady-{MPI.COMM_WORLD.rank}.yaml"  # several ranks may each be alone
    file.write_text(text)
    job = jobs.load(file, overrides)
    return SteadySliding(scene.set_up(job, Slab(comm, *job.grid.points)))


def certificate(states: SteadySliding, speed: float, pressure: float) -> float:
    """Worst of load error, pressure-weighted gap and penetration over the surface's height, on one rank."""
    base, contact = states.setup, states.contact
    assert contact is not None
    p = contact.p * base.units.pressure
    nx, ny = base.job.grid.points
    qx = 2 * np.pi / base.job.grid.lx * np.fft.fftfreq(nx, 1 / nx)
    qy = 2 * np.pi / base.job.grid.ly * np.fft.fftfreq(ny, 1 / ny)
    law = relaxation_of(base.job.material)
    modulus = complex_modulus(-qx * speed, *law)
    modulus[nx // 2] = modulus[nx // 2].real
    q = np.hypot(qx[None, :], qy[:, None])
    symbol = np.divide(0.5, q * modulus[None, :], out=np.zeros(q.shape, complex), where=q > 0)
    u = np.fft.ifft2(symbol * np.fft.fft2(p)).real
    h = states.levels[0].heights * base.units.height
    d = np.sum(p * (u - h)) / p.sum()
    gap = u - h - d
    assert p.min() >= 0.0
    height = h.max() - h.min()
    return max(abs(p.mean() / pressure - 1.0), float(np.sum(p * abs(gap)) / p.sum() / height), -gap.min() / height)
