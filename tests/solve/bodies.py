"""Small contact problems in the units of a solver: a box of length 1, a body of shear modulus 1."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from parcontact.contact.problem import Approach, Box, Contact, MeanPressure, Operator, Operators, Problem, Workspace
from parcontact.contact.solver import ContactSolver
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.physics.records import Certificate
from parcontact.physics.roughness import Roughness

Map = NDArray[np.float64]
TIGHT = 1e-11  # a certificate to this makes pressures agree to 1e-9 of the highest
ROUNDING = 1e-13
MODULUS = 4.0  # E* of shear modulus 1 and Poisson's ratio 1/2
BODIES = [("periodic", "spectral"), ("periodic", "love"), ("free", "love")]


def solver(
    heights: Map,
    size: tuple[float, float] = (1.0, 1.0),
    boundary: str = "periodic",
    kernel: str = "spectral",
    tolerance: float = 1e-6,
    max_iterations: int = 500,
    poisson: float = 0.5,
) -> "Bench":
    """A solver for maps of the shape of `heights`, on one rank."""
    ny, nx = heights.shape
    slab = Slab.alone(nx, ny)
    fft = FFT(slab)
    half_space = HalfSpace(size, poisson, "love" if kernel == "love" else "spectral", boundary == "free")
    height = float(np.ptp(heights)) or size[0] / nx
    operator, inverse = half_space.operator(fft), half_space.inverse(fft)
    workspace, free = Workspace(slab, tolerance), boundary == "free"
    return Bench(ContactSolver(workspace, height, tolerance, max_iterations, free=free), operator, inverse)


@dataclass
class Bench:
    """A solver and the operators of a body, and what its pressures must obey."""

    solver: ContactSolver
    operator: Operator
    preconditioner: Operator
    constraint: Box = field(default_factory=Box)

    @property
    def slab(self) -> Slab:
        return self.solver.slab

    @property
    def operators(self) -> Operators:
        return Operators(self.operator, self.preconditioner)

    def problem(self, h: Array, control: MeanPressure | Approach) -> Problem:
        return Problem(self.operator, self.preconditioner, h, self.constraint, control)

    def solve(self, h: Array, control: MeanPressure | Approach, start: Array) -> Contact:
        return self.solver.solve(self.problem(h, control), start)


def rough(points: int, seed: int = 1, cells: int = 8) -> Map:
    """Hurst 0.9, four longest waves in the box, the shortest of a given number of cells, rms slope 1."""
    fft = FFT(Slab.alone(points, points))
    waves = Roughness(0.9, 0.25, 0.25, cells / points, seed, rms_slope=1.0).spectrum(fft, (1.0, 1.0))
    return np.asarray(fft.backward(waves, np.empty((points, points))), dtype=np.float64)


def white(shape: tuple[int, int], seed: int = 1) -> Map:
    """Heights without any correlation between neighbours: as rough as a grid can be."""
    return np.random.default_rng(seed).standard_normal(shape)


@dataclass(frozen=True)
class Kept:
    """A contact whose maps outlive the next solve."""

    p: Map
    u: Map
    d: float
    certificate: Certificate
    iterations: int
    failure: str


def keep(contact: Contact) -> Kept:
    """A copy of a contact that must have converged."""
    assert contact.converged, contact.failure
    return Kept(
        contact.p.astype(np.float64),
        contact.u.astype(np.float64),
        contact.d,
        contact.certificate,
        contact.iterations,
        contact.failure,
    )


def solve(h: Map, mean: float, **options: Any) -> Kept:
    """The contact under a mean pressure, from nothing; the options are those of `solver`."""
    return keep(solver(h, **options).solve(h, MeanPressure(mean), np.zeros_like(h)))
