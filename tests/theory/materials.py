"""Bodies that several tests use, each as (modulus_inf, moduli, relaxation_times) in Pa and s."""

import numpy as np

from parcontact.physics.prony import Prony

# one Zener branch: 2.75 MPa at once, a tenth of it in the end, creep time 10 ms and so relaxation time 1 ms
ZENER = Prony(0.275e6, np.array([2.475e6]), np.array([1e-3]))

# twelve decades, made up; no measured rubber
TWELVE_DECADES = Prony(
    1e6,
    1e6 * np.array([300, 350, 220, 80, 24, 7, 2.4, 1.0, 0.5, 0.3, 0.2, 0.15]),
    5 * np.logspace(-9, 2, 12),
)
