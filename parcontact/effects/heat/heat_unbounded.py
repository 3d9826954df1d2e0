"""Heat that slides over a free half space: influence coefficients for `effects.heat.heat`.

A uniform heat on one cell of `dx x dy`, while the body passes below it with the velocity -v, warms the distance (x,
y) from the cell by the heat of all earlier times t,

    K(x, y) = 1/e int_0^inf W(t) P(x + v_x t, dx, t) P(y + v_y t, dy, t) dt/sqrt(pi t),                           (1)
    P(x, dx, t) = (erf((x + dx/2)/sqrt(4 D t)) - erf((x - dx/2)/sqrt(4 D t)))/2,

with the effusivity e (H. S. Carslaw, J. C. Jaeger, Conduction of Heat in Solids (1959), section 10.4). W is 1 for
heat on the surface. For heat that waves of the wavenumber q dissipate it is, with tau = D t and s = 2 q sqrt(tau),

    W(t) = sqrt(pi) s^3 erfcx''(s)/2,     erfcx''(s) = (2 + 4 s^2) erfcx(s) - 4 s/sqrt(pi),                  (2)

which tends to 1 - 3/s^2. For the temperature at the depths where heat is released it is `sqrt(pi tau)` times
`Depths.staying`. Panels of the integral resolve the passage of a cell and the spreading of heat.
"""

import numpy as np

from ...parallel.fft import FFT
from ...parallel.slab import Array
from ...physics.convolution import Convolution, padded_lengths, tabulate
from .heat import Conductor, Depths, Vector

GAUSS = np.polynomial.legendre.leggauss(4)
FIRST = 1e-4  # accuracy: end of the first panel over the shortest time scale; the integrand is smooth in sqrt(t) before
GROWTH, PASSING = 1.3, 0.5  # accuracy: largest ratio of panel ends; largest panel over the time to pass the warm zone
SPREAD = 6.5  # accuracy: distance over sqrt(2 D t) beyond which heat is below rounding
LAST = 1e8  # accuracy: end of the integral over the time to spread over the box, at rest
ASYMPTOTIC = 100.0  # accuracy: s beyond which W is 1 - 3/s^2 to 1e-7


def sliding_heat_unbounded(
    fft: FFT,
    size: Vector,
    body: Conductor,
    velocity: Vector,
    depths: Depths | None = None,
    felt: bool = False,
    time: float = np.inf,
) -> Convolution:
    """Return the operator from heat [W/m^2] to temperature rise [K] below a contact that has slid steadily at
    `velocity` [m/s] for a `time` [s] and fits into a free box of `size` [m]; collective. Other parameters are those
    of `sliding_heat`."""
    slab = fft.slab
    padded = FFT(slab, padded_lengths(slab.nx, slab.ny), np.float64, measured=False)

    def coefficient(x: Array, y: Array, dx: float, dy: float) -> Array:
        times, shares = _times(size, (dx, dy), body, velocity, time)
        if depths is not None:
            tau = body.diffusivity * times
            shares = shares * (np.sqrt(np.pi * tau) * depths.staying(tau) if felt else _reaching(times, body, depths))
        along_x = _covered(x[0] + velocity[0] * times[:, None], dx, times, body)
        along_y = _covered(y[:, 0] + velocity[1] * times[:, None], dy, times, body)
        return np.asarray((along_y * shares[:, None]).T @ along_x) / body.effusivity

    table = tabulate(padded, size, coefficient)
    return Convolution(padded, table.__getitem__, padded.complex, even=not velocity[1])


def _covered(x: Array, dx: float, times: Array, body: Conductor) -> Array:
    """Return P of (1), of shape (times, positions)."""
    from scipy.special import erf

    reach = np.sqrt(4.0 * body.diffusivity * times)[:, None]
    return np.asarray(0.5 * (erf((x + 0.5 * dx) / reach) - erf((x - 0.5 * dx) / reach)))


def _times(size: Vector, cell: Vector, body: Conductor, velocity: Vector, time: float) -> tuple[Array, Array]:
    """Return times t [s], up to `time`, and their shares of `dt/sqrt(pi t)`, by Gauss panels in sqrt(t)."""
    speed, smallest, longest = float(np.hypot(*velocity)), min(cell), 2.0 * float(np.hypot(*size))
    start = FIRST * smallest / max(speed, body.diffusivity / smallest)
    end = LAST * longest**2 / body.diffusivity
    if speed:  # the warmed body has left when v t > longest + SPREAD sqrt(2 D t)
        wide = SPREAD * np.sqrt(2.0 * body.diffusivity) / speed
        end = min(end, ((wide + np.sqrt(wide**2 + 4.0 * longest / speed)) / 2.0) ** 2)
    end = min(end, time)
    edges = [0.0, min(start, end)]
    while edges[-1] < end:
        passing = max(smallest, np.sqrt(4.0 * body.diffusivity * edges[-1])) / speed if speed else np.inf
        edges.append(min(edges[-1] * GROWTH, edges[-1] + PASSING * passing, end))
    roots = np.sqrt(edges)
    half = 0.5 * np.diff(roots)[:, None]
    nodes = (roots[:-1, None] + half * (1.0 + GAUSS[0])).ravel()
    return nodes**2, (half * GAUSS[1]).ravel() * 2.0 / np.sqrt(np.pi)


def _reaching(times: Array, body: Conductor, depths: Depths) -> Array:
    """Return W of (2) at these times, averaged over the waves."""
    from scipy.special import erfcx

    total = np.zeros_like(times)
    for q, share in zip(depths.wavenumbers, depths.shares, strict=True):
        s = 2.0 * q * np.sqrt(body.diffusivity * times)
        near = np.minimum(s, ASYMPTOTIC)
        bend = (2.0 + 4.0 * near**2) * erfcx(near) - 4.0 * near / np.sqrt(np.pi)
        late = 1.0 - 3.0 / np.maximum(s, ASYMPTOTIC) ** 2
        total += share * np.where(s < ASYMPTOTIC, 0.5 * np.sqrt(np.pi) * near**3 * bend, late)
    return total
