"""Closed forms that only tests use: what follows a step of load, approach or velocity, and time steps of a code.

The equations and their sources are those of `hertz` and `wavy` of `parcontact.theory`.
"""

import numpy as np
from numpy.typing import ArrayLike

from parcontact.physics.prony import (
    CreepSpectrum,
    Integrator,
    Moduli,
    creep_spectrum,
    discrete_modulus,
    normal_form,
    relaxation,
)
from parcontact.theory.hertz import _time_of_equal_radius
from parcontact.theory.wavy import (
    Array,
    ComplexArray,
    ComplexValues,
    Values,
    _fraction,
    _friction,
    frequency,
    pressure_amplitude,
    traction,
)

from .quadrature import graded_rule


def load_step_contact_radius(t: ArrayLike, force: float, radius: float, *material: *Moduli) -> Array:
    """a(t) = (3 R W J(t)/16)^(1/3) in m at times t >= 0 (s, any shape)."""
    compliance = creep_spectrum(*material).compliance(t)
    return np.cbrt(3 * radius * force * compliance / 16)


def load_step_pressure(r: ArrayLike, t: ArrayLike, force: float, radius: float, *material: *Moduli) -> Array:
    """p(r, t) in Pa at distances r (m) from the axis and times t >= 0 (s), which broadcast, for a force > 0.

    With f(s) = sqrt(a^2(s) - r^2)_+ and the time t_r at which the edge of the contact passes r, the history integral is
    G(t - t_r) f(t) + int_{t_r}^t (f(t) - f(s)) sum_j G_j/tau_j exp(-(t-s)/tau_j) ds, all of it positive. It is computed
    by Gauss rules on panels that shrink towards both ends; the relative error is about 1e-13 G(0)/G(t).
    """
    spring, terms, times = normal_form(*material)
    spectrum = creep_spectrum(spring, terms, times)

    def pressure(r: float, t: float) -> float:
        past = min(spectrum.time(16 * r**3 / (3 * radius * force)), t)
        elapsed, remaining, weights = (t - past) * graded_rule()
        chords = [_half_chord(s, r, force, radius, spectrum) for s in (past + elapsed, t)]
        forgotten = np.exp(-remaining[:, None] / times) @ (terms / times)
        lasting = relaxation(t - past, spring, terms, times) * chords[1]
        return float(8 / (np.pi * radius) * (lasting + np.sum(weights * forgotten * (chords[1] - chords[0]))))

    return np.asarray(np.vectorize(pressure, otypes=[float])(r, t))


def displacement_step_force(t: ArrayLike, approach: float, radius: float, *material: *Moduli) -> Array:
    """W(t) = (16/3) sqrt(R) d^(3/2) G(t) in N at times t >= 0 (s, any shape)."""
    modulus = relaxation(t, *material)
    return np.asarray(16 / 3 * np.sqrt(radius * approach) * approach * modulus)


def triangle_contact_radius(
    t: ArrayLike, peak_approach: float, rise_time: float, radius: float, *material: *Moduli
) -> Array:
    """a(t) in m at times t >= 0 (s, any shape); zero from lift-off on."""
    earlier = _time_of_equal_radius(t, rise_time, *material)
    return np.sqrt(radius * peak_approach / rise_time * earlier)


def _half_chord(s: ArrayLike, r: float, force: float, radius: float, spectrum: CreepSpectrum) -> Array:
    """sqrt(a^2(s) - r^2), zero outside the contact, after a load step."""
    contact_radius = np.cbrt(3 * radius * force * spectrum.compliance(s) / 16)
    return np.asarray(np.sqrt(np.maximum(contact_radius**2 - r * r, 0)))


def pressure_variance(amplitude: ComplexValues, kx: Values, ky: Values, modulus: ComplexValues) -> Array:
    """The mean square fluctuation of the pressure in Pa^2, summed over waves on the last axis."""
    return np.asarray(np.sum(np.abs(pressure_amplitude(amplitude, kx, ky, modulus)) ** 2, axis=-1) / 2)


def discrete_friction_coefficient(
    mean_pressure: Values,
    amplitude: ComplexValues,
    kx: Values,
    ky: Values,
    vx: float,
    vy: float,
    dt: float,
    *material: *Moduli,
    integrator: Integrator = "exponential",
) -> Array:
    """The mu that a code with exact derivatives and Fourier kernel finds in steady sliding with time steps dt (s).

    The surface goes by n cells of size c per step when dt = n c/|v|.
    """
    omega = frequency(kx, ky, vx, vy)
    modulus = discrete_modulus(omega, dt, *material, integrator=integrator)
    return _friction(traction(amplitude, kx, ky, modulus), vx, vy, mean_pressure)


def velocity_step_modulus(
    t: ArrayLike, omega_before: ComplexValues, omega_after: ArrayLike, *material: *Moduli
) -> ComplexArray:
    """M(t) in Pa at times t >= 0 (s) after steady sliding at omega_before became sliding at omega_after.

    M = G_inf + sum_j G_j [b_j + (a_j - b_j) exp(-t/tau_j - i omega_after t)], with i omega tau_j/(1 + i omega tau_j)
    before (a) and after (b). The frequencies (rad/s, one per wave) are those of `frequency`. The shape is that of t
    followed by that of the frequencies.
    """
    before = _memory(omega_before, normal_form(*material).relaxation_times)
    return _modulus_after(t, before, omega_after, *material)


def load_rest_slide_modulus(t: ArrayLike, rest: float, omega: ArrayLike, *material: *Moduli) -> ComplexArray:
    """M(t) in Pa at times t >= 0 (s) of sliding at omega (rad/s) after `rest` (s) in full contact of a virgin body.

    As `velocity_step_modulus` with a_j = exp(-rest/tau_j). The shape is that of t followed by that of omega.
    """
    before = np.exp(-rest / normal_form(*material).relaxation_times)
    return _modulus_after(t, before, omega, *material)


def _modulus_after(t: ArrayLike, before: ComplexValues, omega: ArrayLike, *material: *Moduli) -> ComplexArray:
    """M(t), given by the shares of the moduli that are `before` in memory at t = 0 (last axis: terms of the series)."""
    spring, terms, times = normal_form(*material)
    t, omega = np.asarray(t, float), np.asarray(omega, float)
    t = t.reshape(t.shape + (1,) * (omega.ndim + 1))
    after = _memory(omega, times)
    fading = np.exp(-t / times - 1j * omega[..., None] * t)
    return np.asarray(spring + (after + (before - after) * fading) @ terms)


def _memory(omega: ArrayLike, times: Array) -> ComplexArray:
    phase = 1j * np.asarray(omega, float)[..., None] * times
    return phase / (1 + phase)


def load_step_contact_fraction(
    t: ArrayLike, mean_pressure: float, amplitude: float, wavelength: float, *material: *Moduli
) -> Array:
    """The contact fraction at times t >= 0 (s) after `mean_pressure` was put on a virgin viscoelastic body.

    Contact only grows, so that the elastic solution holds with 1/E* = J(t)/4, where J is the creep compliance
    (E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438).
    """
    compliance = creep_spectrum(*material).compliance(t)
    return _fraction(mean_pressure * compliance * wavelength / (4 * np.pi * amplitude))


def load_step_full_contact_time(mean_pressure: float, amplitude: float, wavelength: float, *material: *Moduli) -> float:
    """When `load_step_contact_fraction` reaches 1, in s: J(t) = 4 pi Delta/(p lambda); 0 or inf if always or never."""
    spectrum = creep_spectrum(*material)
    return spectrum.time(4 * np.pi * amplitude / (mean_pressure * wavelength))
