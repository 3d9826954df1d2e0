"""Fluids that flow through a gap: liquids, described by their viscosity, and gases, which expand and slip.

A pressure that falls from p1 to p2 over the length L of a gap of conductivity K drives through a width W the flow

    liquid   Q = K/(12 eta) (p1 - p2) W/L,
    gas      Q = K/(12 eta) (p1^2 - p2^2)/(2 p2) W/L,    at the pressure p2,

for an ideal gas at constant temperature T. Its mean free path is (R the gas constant, M the molar mass; J. C.
Maxwell, Phil. Trans. R. Soc. 170 (1879) 231)

    lambda = (eta/p) sqrt(pi R T/(2 M)).

At walls that reflect all molecules diffusely it slips, and a gap g conducts like one of `g^3 (1 + 6 lambda/g)`, here
with lambda at the mean pressure (p1 + p2)/2, which is exact for an even gap. The error is about 10 % for gaps above
ten mean free paths; in smaller gaps the true flow is larger.

Both flows are viscous. A gas has inertia too: through an open section A no more flows than by the isentropic law of
A. Barre de Saint-Venant and L. Wantzel, J. Ecole Polytechnique 16 (1839) 85, with the ratio kappa of its heats,

    A p1 sqrt(M/(R T)) sqrt(2 kappa/(kappa - 1) (r^(2/kappa) - r^((kappa + 1)/kappa))),

r being the larger of p2/p1 and (2/(kappa + 1))^(kappa/(kappa - 1)), at which the flow is choked.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

GAS_CONSTANT = 8.31446261815324  # physics: [J/(mol K)]
BAR = 1.0e5  # [Pa]
INERTIA = 0.2  # accuracy: viscous flow of a gas over its bound by inertia, above which viscous flow is 10 % too large
ROOM = 293.15  # physics: temperature of the table [K]


@dataclass(frozen=True)
class Fluid:
    """A fluid at 20 C: its viscosity [Pa s], and the density of a liquid [kg/m^3], NaN if unknown, or the molar mass
    [kg/mol] and the ratio of heats of a gas."""

    name: str
    viscosity: float
    molar_mass: float | None = None
    density: float = math.nan
    heat_ratio: float = math.nan

    def mean_free_path(self, pressure: float) -> float:
        """Return the mean free path [m] of a gas at a pressure [Pa]; 0 for a liquid."""
        if self.molar_mass is None:
            return 0.0
        return self.viscosity / pressure * math.sqrt(math.pi * GAS_CONSTANT * ROOM / (2.0 * self.molar_mass))

    @property
    def choking_ratio(self) -> float:
        """Ratio of the low to the high pressure below which the flow of a gas is choked."""
        kappa = self.heat_ratio
        return float((2.0 / (kappa + 1.0)) ** (kappa / (kappa - 1.0)))

    def density_at(self, pressure: float) -> float:
        """Return the density [kg/m^3] at a pressure [Pa]; NaN if unknown."""
        return self.density if self.molar_mass is None else pressure * self.molar_mass / (GAS_CONSTANT * ROOM)


FLUIDS = {  # at 20 C and 1 bar: CRC Handbook of Chemistry and Physics, 97th edition (2016), 6-1 and 6-231
    "water": Fluid("water", 1.0016e-3, density=998.2),
    "air": Fluid("air", 1.82e-5, 0.028964, heat_ratio=1.40),
    "nitrogen": Fluid("nitrogen", 1.76e-5, 0.028014, heat_ratio=1.40),
    "helium": Fluid("helium", 1.96e-5, 0.0040026, heat_ratio=1.67),
}


@dataclass(frozen=True)
class PressureDrop:
    """A fluid under a pressure that falls from `high` to `low` [Pa], absolute pressures for a gas.

    With `total` it carries its part of the load, which is measured over the pressure `ambient` [Pa] (default: `low`).
    """

    fluid: Fluid
    high: float
    low: float
    total: bool = False
    ambient: float | None = None

    @property
    def mean_free_path(self) -> float:
        """Mean free path at the mean pressure [m]."""
        return self.fluid.mean_free_path(0.5 * (self.high + self.low))

    @property
    def outside(self) -> float:
        """Pressure [Pa] over which the load is measured."""
        return self.low if self.ambient is None else self.ambient

    @property
    def pressures(self) -> tuple[float, ...]:
        """Pressures [Pa] at which the conductivity for the fluid is calculated: the mean one, and both ends if a gas
        carries a part of the load."""
        ends = (self.low, self.high) if self.total and self.mean_free_path else ()
        return (0.5 * (self.low + self.high), *ends)

    def local_loads(self, load: float) -> tuple[float, float]:
        """Return the loads [Pa] that contact carries at the high and at the low side, if the fluid carries its part."""
        return load + self.outside - self.high, load + self.outside - self.low

    def conducting_gap(self, gap: NDArray[np.float64], pressure: float) -> NDArray[np.float64]:
        """Return the gaps [m] that pass as much mass of a fluid without slip at the mean pressure as `gap` does with
        slip at a pressure [Pa]."""
        if not (path := self.mean_free_path):
            return gap
        return np.cbrt(gap**2 * (pressure / self.pressures[0] * gap + 6.0 * path))

    def flow_rate(self, conductivity: float, length: float, width: float) -> float:
        """Return the flow [m^3/s] at the low side through a conductivity [m^3] over a length and a width [m]; NaN for a
        gas that flows into a vacuum."""
        drive = self.high - self.low
        if self.fluid.molar_mass is not None:
            drive = drive * 0.5 * (self.high + self.low) / self.low if self.low else math.nan
        return conductivity / (12.0 * self.fluid.viscosity) * drive * width / length

    def mass_flow(self, conductivity: float, length: float, width: float) -> float:
        """Return the flow [kg/s] through a conductivity [m^3] over a length and a width [m]; NaN for an unknown
        density."""
        mean = self.fluid.density_at(0.5 * (self.high + self.low))
        return conductivity / (12.0 * self.fluid.viscosity) * (self.high - self.low) * mean * width / length

    def inertial_bound(self, section: float) -> float:
        """Return the largest flow [kg/s] of a gas through an open section [m^2]; inf for a liquid."""
        if self.fluid.molar_mass is None:
            return math.inf
        kappa, ratio = self.fluid.heat_ratio, max(self.low / self.high, self.fluid.choking_ratio)
        square = 2.0 * kappa / (kappa - 1.0) * (ratio ** (2.0 / kappa) - ratio ** ((kappa + 1.0) / kappa))
        return section * self.high * math.sqrt(square * self.fluid.molar_mass / (GAS_CONSTANT * ROOM))

    def describe_inertia(self, axis: str, viscous: float, bound: float) -> str:
        """Return a warning if the viscous flow of a gas [kg/s] along an axis is close to its bound by inertia [kg/s],
        or above; '' otherwise."""
        if not viscous > INERTIA * bound:
            return ""
        both = 1.0 / (1.0 / viscous + 1.0 / bound)
        choked = ", choked," * (viscous > bound and self.low <= self.fluid.choking_ratio * self.high)
        return (
            f"along {axis} inertia limits the flow of {self.fluid.name}: at most {1e6 * bound:.3g} mg/s{choked} pass "
            f"the smallest open section, and viscous flow alone would be {1e6 * viscous:.3g} mg/s; expect some "
            f"{1e6 * both:.3g} mg/s, 1/(1/viscous + 1/bound), within 14 %"
        )

    def describe_rate(self, conductivity: float, length: float, width: float) -> str:
        """Return a text on the flow through a conductivity [m^3] over a length and a width [m]: in ml/h at the low
        side, for a gas also at 1 bar, and in mg/s if the density is known."""
        rate, mass = (flow(conductivity, length, width) for flow in (self.flow_rate, self.mass_flow))
        said = [] if math.isnan(rate) else [f"{rate:.3g} m³/s ({3.6e9 * rate:.3g} ml/h) at the low side"]
        said += [] if math.isnan(mass) else [f"{1e6 * mass:.3g} mg/s"]
        if self.fluid.molar_mass is not None and self.low != BAR:
            said.append(f"{3.6e9 * mass / self.fluid.density_at(BAR):.3g} ml/h of gas at 1 bar")
        return ", ".join(said)
