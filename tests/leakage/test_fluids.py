"""Flow of liquids and gases through an even gap, against closed forms, and the sentences on them."""

import math

import numpy as np
import pytest

from parcontact.leakage.flow import solve_flow
from parcontact.leakage.fluids import FLUIDS, Fluid, PressureDrop

SIZE, GAP = (2e-3, 1e-3), 1e-6  # [m]
EVEN = np.full((4, 8), GAP)


def rate(drop: PressureDrop) -> float:
    flow = solve_flow(drop.conducting_gap(EVEN), SIZE)
    return drop.flow_rate(flow.conductivity, *SIZE)


def test_a_liquid() -> None:
    """Plane Poiseuille flow, h^3/(12 eta) (p1 - p2) W/L, to rounding."""
    found = rate(PressureDrop(Fluid("oil", 0.1), 3e5, 1e5))
    assert found == pytest.approx(GAP**3 / (12 * 0.1) * 2e5 * SIZE[1] / SIZE[0], rel=1e-12)


@pytest.mark.parametrize("name", ["air", "nitrogen", "helium"])
def test_a_gas_that_expands_and_slips(name: str) -> None:
    """As many molecules pass each place: with the slip length lambda(p) the integral of `h^3 p (1 + 6 lambda/h) dp/eta`
    from p2 to p1, here by 2000 trapezoids (exact, as it is linear in p: 1e-9)."""
    fluid, high, low = FLUIDS[name], 3e5, 1e4
    p = np.linspace(low, high, 2001)
    slip = 1.0 + 6.0 * np.array([fluid.mean_free_path(each) for each in p]) / GAP
    density = GAP**3 * p * slip
    passing = float(0.5 * (density[1:] + density[:-1]) @ np.diff(p))
    exact = passing / (12.0 * fluid.viscosity) / low * SIZE[1] / SIZE[0]
    assert rate(PressureDrop(fluid, high, low)) == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize(("name", "path"), [("air", 66e-9), ("nitrogen", 65e-9), ("helium", 192e-9)])
def test_mean_free_paths(name: str, path: float) -> None:
    """Those of tables at 20 C and 1 bar, which differ by some per cent (air 66 to 68 nm, helium 190 to 198 nm)."""
    assert FLUIDS[name].mean_free_path(1e5) == pytest.approx(path, rel=0.03)


def test_masses() -> None:
    """Dry air at 20 C and 1 bar has 1.189 kg/m^3; 1e-9 m^3/s of it are 1.189e-3 mg/s, and 3.6 ml/h."""
    drop = PressureDrop(FLUIDS["air"], 2e5, 1e5)
    assert FLUIDS["air"].density_at(1e5) == pytest.approx(1.189, rel=1e-3)
    assert drop.describe_rate(1e-9) == "1e-09 m^3/s (3.6 ml/h, 0.00119 mg/s)"
    assert math.isnan(Fluid("oil", 0.1).density_at(1e5))
