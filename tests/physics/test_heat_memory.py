"""Heat that changes with time: the sum of exponentials keeps its bound, and waves and depths their closed forms."""

import math

import numpy as np
import pytest
from mpi4py import MPI
from scipy.integrate import quad

from parcontact.parallel import spectra
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.exponentials import fit, shares_of_step
from parcontact.physics.heat import Conductor, Depths
from parcontact.physics.heat_memory import Heating, HeatMemory, MeanMemory, along_depth

RUBBER = Conductor(0.2, 1e-7)
LENGTH, NX, NY = 1e-3, 16, 6


@pytest.mark.parametrize("error", [1e-2, 1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("range_", [(1e-6, 1.0), (1e-3, 1e-2)])
def test_the_sum_keeps_its_bound(error: float, range_: tuple[float, float]) -> None:
    """At a thousand times of the range; it is not idle: the bound is at most twice what is asked, and half reached."""
    found = fit(*range_, error)
    times = np.geomspace(*range_, 1000)
    kept = slice(0, found.kept)
    series = np.exp(-np.outer(times, found.rates[kept])) @ found.weights[kept] * np.sqrt(np.pi * times)
    assert np.abs(series - 1.0).max() <= found.bound <= 1.01 * error
    assert np.abs(series - 1.0).max() > 0.3 * found.bound


def test_shares_of_a_step() -> None:
    """Exact integrals of exponentials over linear heat, on both sides of where their series begin; to 1e-9."""
    for x in (1e-9, 0.999e-3, 1.001e-3, 0.3, 20.0):
        before, after = (float(each[0]) for each in shares_of_step(np.array([x])))
        assert after == pytest.approx(quad(lambda s, x=x: s * math.exp(-x * (1 - s)), 0, 1)[0], rel=1e-9)
        assert before == pytest.approx(quad(lambda s, x=x: (1 - s) * math.exp(-x * (1 - s)), 0, 1)[0], rel=1e-9)


def memory(shortest: float = 1e-5, comm: MPI.Intracomm = MPI.COMM_WORLD, body: Conductor = RUBBER) -> HeatMemory:
    fft = FFT(Slab(comm, NX, NY), measured=False)
    return HeatMemory(fft, (LENGTH, LENGTH / 4), body, fit(shortest, 1.0, 1e-6), rubs=True)


def wave(made: HeatMemory, phase: float = 0.0) -> np.ndarray:
    x = np.arange(NX) / NX
    return 1.0 + np.cos(2 * math.pi * 2 * x - phase)[None] * np.ones((made.fft.slab.shape[0], 1))


K = 2 * math.pi * 2 / LENGTH


@pytest.mark.mpi
def test_heat_that_stays() -> None:
    """A wave and its mean after steps of all lengths: q erf(sqrt(D t) k)/(kappa k) and 2 q sqrt(t/pi)/e. To 1e-4 in
    the first steps, where what only the present makes has this error, to 1e-5 later; the mean to 1e-7."""
    made, time = memory(), 0.0
    heat, rise = wave(made), made.fft.slab.empty()
    made.take(heat, heat, (1.0, 1.0))
    for number, dt in enumerate([1e-5] * 5 + [1e-3] * 5 + [1e-1] * 3):
        pressed = made.fft.forward(heat).copy()
        made.advance(dt, Heating((3.0, 3.0)), heat, pressed, (1.0, 1.0), rise)
        time += dt
        mean = 6 * math.sqrt(time / math.pi) / RUBBER.effusivity
        size = 3 * math.erf(math.sqrt(RUBBER.diffusivity * time) * K) / (RUBBER.conductivity * K)
        exact = mean + size * (heat - 1.0)
        assert np.abs(rise - exact).max(initial=0.0) < (1e-4 if number < 5 else 1e-5) * size + 1e-7 * mean
        assert made.mean.stored == pytest.approx(3 * time, rel=1e-12)


def test_heat_that_slides_becomes_steady() -> None:
    """A wave that moves, in steps of a 200th of it, after ten waves: the steady one, at the surface and from depth.
    To 3e-4: steps over which heat changes linearly make (pi/200)^2/3 of it smaller, and e^-9 of the start is left."""
    depths = Depths(np.array([K]), np.ones(1))
    speed, turn = 0.05, 2 * math.pi / 200
    fast = Conductor(0.2, 1e-6)  # forgets in a tenth of the steps
    beta = np.sqrt(K**2 - 1j * K * speed / fast.diffusivity)
    dt = turn / (K * speed)
    for heating, factor in (
        (Heating((2.0, 2.0)), 1.0),
        (Heating(pressed=(2.0, 2.0), depths=depths), (1 + beta / (2 * K)) ** -3),
    ):
        made = memory(dt, MPI.COMM_SELF, fast)
        rise = made.fft.slab.empty()
        made.take(wave(made), wave(made), (1.0, 1.0))
        for step in range(1, 2001):
            heat = wave(made, turn * step)
            made.advance(dt, heating, heat, made.fft.forward(heat).copy(), (1.0, 1.0), rise)
        x = np.arange(NX) / NX
        exact = 2.0 / fast.conductivity * (np.exp(1j * (2 * math.pi * 2 * x - turn * 2000)) * factor / beta).real
        assert np.abs(rise[0] - rise[0].mean() - exact).max() < 3e-4 * np.abs(exact).max()


def test_the_depth_of_the_mean() -> None:
    """Constant heat of one wave: the cosine transform (2), and the mean after a time, by quadrature; to 1e-6."""
    q, time = 3e4, 2e-3
    depths = Depths(np.array([q]), np.ones(1))
    density = lambda z: 4 * q**3 * z**2 * math.exp(-2 * q * z)  # noqa: E731
    for m in (1.0, 30.0):
        exact = quad(lambda z, m=m: density(z) * math.cos(m * z / math.sqrt(RUBBER.diffusivity)), 0, 6e-4)[0]
        assert along_depth(np.array([m**2]), RUBBER, depths)[0] == pytest.approx(exact, rel=1e-6)
    made = MeanMemory(RUBBER)
    found = made.advance(time, Heating(pressed=(2.0, 2.0), depths=depths))

    def after(root: float) -> float:
        reach = 4 * RUBBER.diffusivity * root**2
        return quad(lambda z: density(z) * math.exp(-(z**2) / reach), 0, 6e-4)[0] if root else 0.0

    exact = 4 / math.sqrt(math.pi) * quad(after, 0, math.sqrt(time))[0] / RUBBER.effusivity
    assert found[0] == pytest.approx(exact, rel=1e-6)
    inside = quad(lambda r: 2 * r * depths.staying(np.array([r * r * RUBBER.diffusivity]))[0], 0, math.sqrt(time))
    assert found[1] == pytest.approx(2 * inside[0] * RUBBER.diffusivity / RUBBER.conductivity, rel=1e-5)
    assert made.stored == pytest.approx(2 * time, rel=1e-12)


@pytest.mark.mpi
@pytest.mark.parametrize("nx", [1, 7, 8])
def test_spectra_as_maps(nx: int) -> None:
    """There and back, every digit, on any number of ranks, for odd and even widths."""
    fft = FFT(Slab(MPI.COMM_WORLD, nx, 5), measured=False)
    random = np.random.default_rng(fft.slab.comm.rank)
    spectrum = fft.forward(random.normal(size=fft.slab.shape)).copy()
    field, rest = np.empty(fft.slab.shape), np.empty((fft.slab.shape[0], spectra.edges(nx)))
    spectra.to_map(fft, spectrum, field, rest)
    back = np.empty_like(spectrum)
    spectra.from_map(fft, field, rest, back)
    assert np.array_equal(back, spectrum)
