"""Relaxation function of a material from its section of a job."""

import math

import numpy as np

from .. import job
from ..job.materials import heated
from ..physics.prony import Prony, normal_form, zener_to_prony
from ..rubber.shift import highest_temperature

Material = job.Elastic | job.Zener | job.Dma


def relaxation_of(material: Material) -> Prony:
    """Return the relaxation function of a material [Pa, s]; its long-term modulus and no terms if it has no
    branches."""
    body = material.fitted
    if isinstance(body, job.Elastic) or not body.branches:
        return Prony(body.long_modulus, np.zeros(0), np.zeros(0))
    zener = [b for b in body.branches if isinstance(b, job.ZenerBranch)]
    plain = [b for b in body.branches if isinstance(b, job.PronyBranch)]
    series, kelvin, viscosity = ([getattr(b, name) for b in zener] for name in ("G0", "G1", "eta1"))
    prony = zener_to_prony(series, kelvin, viscosity, body.modulus_inf)
    moduli, times = [b.modulus for b in plain], [b.relaxation_time for b in plain]
    all_times = [body.time_factor * time for time in (*prony.relaxation_times, *times)]
    all_moduli = [body.modulus_factor * modulus for modulus in (*prony.moduli, *moduli)]
    return normal_form(body.modulus_factor * prony.modulus_inf, all_moduli, all_times)


def time_factor_of(material: Material) -> float:
    """Return a_T [-]: relaxation times at the material's temperature divided by those at the reference temperature."""
    return material.fitted.time_factor


def temperature_of(material: Material) -> float:
    """Return the temperature of a material [deg C], by default its shift's reference temperature; NaN without a
    shift."""
    body = material.fitted
    if not isinstance(body, job.Zener) or body.shift is None:
        return math.nan
    return body.shift.reference if body.temperature is None else body.temperature


def highest_temperature_of(material: Material) -> float:
    """Return the temperature [deg C] at which the tables of a material's shift end; inf without tables."""
    body = material.fitted
    return highest_temperature(body.shift.made) if isinstance(body, job.Zener) and body.shift else math.inf


def factor_at(material: Material, rise: float) -> float:
    """Return the ratio of a material's relaxation times after a temperature rise [K] to those before it [-]. Raises
    InputError outside the range of its shift."""
    return time_factor_of(heated(material, temperature_of(material) + rise)) / time_factor_of(material)
