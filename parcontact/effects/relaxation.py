"""The relaxation function of a job's material, and whether there is any."""

import numpy as np

from .. import job as jobs
from ..job import Job
from ..physics.prony import Prony, normal_form, zener_to_prony
from .effect import Decision


def relaxation_of(job: Job) -> Prony:
    """The relaxation function of a job's material [Pa, s]; one modulus and no terms if it is elastic."""
    material = job.material
    if isinstance(material, jobs.Elastic):
        return Prony(material.shear_modulus, np.zeros(0), np.zeros(0))
    if isinstance(material, jobs.Dma):
        material = material.fitted
    zener = [b for b in material.branches if isinstance(b, jobs.ZenerBranch)]
    plain = [b for b in material.branches if isinstance(b, jobs.PronyBranch)]
    series, kelvin, viscosity = ([getattr(b, name) for b in zener] for name in ("G0", "G1", "eta1"))
    prony = zener_to_prony(series, kelvin, viscosity, material.modulus_inf)
    moduli, times = [b.modulus for b in plain], [b.relaxation_time for b in plain]
    all_times = [material.time_factor * time for time in (*prony.relaxation_times, *times)]
    return normal_form(prony.modulus_inf, [*prony.moduli, *moduli], all_times)


def time_factor_of(job: Job) -> float:
    """By what factor relaxation times at the temperature of a job are longer than at the reference, a_T [-]."""
    body = job.material.fitted if isinstance(job.material, jobs.Dma) else job.material
    return body.time_factor if isinstance(body, jobs.Zener) else 1.0


def decide(job: Job) -> Decision:
    """One map per branch that relaxes, and the last displacement."""
    count = relaxation_of(job).moduli.size
    what = "a branch relaxes" if count == 1 else f"{count} branches relax"
    return Decision("viscoelasticity", count > 0, what if count else "the body has one modulus and no memory")
