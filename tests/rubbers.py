"""Bodies that several tests use, each as (modulus_inf, moduli, relaxation_times) in Pa and s, and their functions."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from parcontact.physics.prony import Prony

Array = NDArray[np.float64]
Waves = NDArray[np.complex128]

# one Zener branch: 2.75 MPa at once, a tenth of it in the end, creep time 10 ms and so relaxation time 1 ms
ZENER = Prony(0.275e6, np.array([2.475e6]), np.array([1e-3]))

# twelve decades, made up; no measured rubber
TWELVE_DECADES = Prony(
    1e6, 1e6 * np.array([300, 350, 220, 80, 24, 7, 2.4, 1.0, 0.5, 0.3, 0.2, 0.15]), 5 * np.logspace(-9, 2, 12)
)


# -- their functions as they are defined, term by term: nothing of the program ---------------------------------------


def relaxation(t: ArrayLike, modulus_inf: float, moduli: ArrayLike, relaxation_times: ArrayLike) -> Array:
    """G(t) = G_inf + sum G_k exp(-t/tau_k) [Pa] at times of any shape [s]."""
    t, terms = np.asarray(t, float), zip(np.ravel(moduli), np.ravel(relaxation_times), strict=True)
    return np.asarray(modulus_inf + sum(modulus * np.exp(-t / tau) for modulus, tau in terms))


def complex_modulus(omega: ArrayLike, modulus_inf: float, moduli: ArrayLike, relaxation_times: ArrayLike) -> Waves:
    """G' + i G'' [Pa] at angular frequencies of any shape [rad/s]: J. D. Ferry (1980), chapter 3, in real numbers."""
    storage, loss = np.full(np.shape(omega), float(modulus_inf)), np.zeros(np.shape(omega))
    for modulus, tau in zip(np.ravel(moduli), np.ravel(relaxation_times), strict=True):
        phase = np.asarray(omega, float) * tau
        storage = storage + modulus * phase**2 / (1 + phase**2)
        loss = loss + modulus * phase / (1 + phase**2)
    return np.asarray(storage + 1j * loss)
