"""Steady sliding of bodies a thousand times as stiff at once as in the end, whose loss tangent goes up to 16;
and free boxes, where proximal points follow projected steps."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from steady_scenes import CREEP_TIME, certificate, sliding

from parcontact.contact import projected as proximal
from parcontact.errors import RunError

from .test_sliding import LINE, cylinder_on

RATIO, MODULUS, TIME = 1000.0, 1.0e6, 1.0e-3  # G0/G_inf, G_inf [Pa], relaxation time [s]
PEAK = 2.5e-4 / (2 * np.pi * TIME * np.sqrt(RATIO))  # at which the loss tangent of waves of 0.25 mm is largest [m/s]
ROUGH = (
    "grid: {points: 64, size: 1.0e-3}\n"
    "surface: {shape: rough, hurst: 0.8, long_wavelength: 5.0e-4, short_wavelength: 1.25e-4, rms_slope: 0.05}\n"
    f"material: {{model: zener, modulus_inf: {MODULUS!r}, branches: [{{modulus: {MODULUS * (RATIO - 1)!r}, "
    f"relaxation_time: {TIME!r}}}]}}\n"
    "history: [{pressure: 1.0}]\nnumerics: {tolerance: 1.0e-4}\n"
)


@pytest.mark.parametrize(("speed", "share"), [(0.1, 0.1), (0.2, 0.1), (0.3, 0.6), (1.0, 0.1), (1.0, 0.4)])
def test_rough(shared_path: Path, comm: MPI.Intracomm, speed: float, share: float) -> None:
    """By an operator of numpy's own, the contact conditions are met; 275 to 445 operator calls were seen."""
    states = sliding(shared_path, ROUGH, comm)
    pressure = share * 0.05 * MODULUS * float(np.sqrt(RATIO))
    point = states.solve((speed * PEAK, 0.0), pressure)
    assert point.certificate.worst <= 1e-4
    assert certificate(states, speed * PEAK, pressure) <= 1e-4 * (1 + 1e-6)
    assert point.operator_calls <= 600


@pytest.mark.parametrize("speed", [2.0, 10.0])
def test_line(shared_path: Path, comm: MPI.Intracomm, speed: float) -> None:
    """The contact fills up to 0.8 of the box."""
    states, pressure = cylinder_on(shared_path, comm, RATIO, 60.0)
    velocity = speed * LINE / CREEP_TIME
    states.solve((velocity, 0.0), pressure)
    assert certificate(states, velocity, pressure) <= 1e-7 * (1 + 1e-6)


FREE = """\
grid: {points: 48, size: 1.0e-3, boundary: free}
surface: {shape: sphere, radius: 1.0e-2}
material: {model: zener, modulus_inf: 1.0e6, branches: [{modulus: 1.0e8, relaxation_time: 1.0e-4}]}
history: [{pressure: 1.0}]
numerics: {tolerance: 1.0e-3}
"""


@pytest.mark.mpi(2)
def test_proximal_points_agree_with_projected_steps(
    shared_path: Path, comm: MPI.Intracomm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a free box, to ten times the tolerance of both, 1e-3."""
    states = sliding(shared_path, FREE, comm)
    projected = states.solve((0.1, 0.0), 2e5)
    monkeypatch.setattr(proximal, "PATIENCE", 0)
    points = sliding(shared_path, FREE, comm).solve((0.1, 0.0), 2e5)
    assert points.operator_calls > projected.operator_calls
    assert points.friction == pytest.approx(projected.friction, rel=1e-2)
    assert points.certificate.worst <= 1e-3


def test_what_cannot_be_solved_is_given_up(
    shared_path: Path, comm: MPI.Intracomm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When the certificate has not halved in a given number of contacts, here none."""
    monkeypatch.setattr(proximal, "PATIENCE", 0)
    monkeypatch.setattr(proximal, "MAX_CONTACTS_TO_HALVE", 0)
    with pytest.raises(RunError, match="no progress in 0 contacts: the residual is"):
        sliding(shared_path, FREE, comm).solve((0.1, 0.0), 2e5)
