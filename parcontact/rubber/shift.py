"""Time-temperature superposition: at a temperature T a compound relaxes as at the reference, `a_T` times as slowly.

WLF         log10 a_T = -C1 (T - T_ref)/(C2 + T - T_ref)      (M. L. Williams, R. F. Landel, J. D. Ferry,
                                                               J. Am. Chem. Soc. 77 (1955) 3701)
Arrhenius   log10 a_T = E/(R ln 10) (1/T - 1/T_ref)           temperatures in K
table       log10 a_T given at some temperatures, linear between them and nowhere beyond
"""

import math
from bisect import bisect_left
from dataclasses import dataclass
from typing import Protocol

from ..errors import InputError

GAS = 8.314462618  # J/(mol K)
ZERO = 273.15  # K at 0 deg C


class Shift(Protocol):
    """How relaxation times depend on temperature; `reference` [deg C] is where they are as given."""

    @property
    def reference(self) -> float: ...

    def log_factor(self, temperature: float) -> float: ...


@dataclass(frozen=True)
class WLF:
    """`C1` [-] and `C2` [K] at the reference temperature [deg C]."""

    C1: float
    C2: float
    reference: float

    def log_factor(self, temperature: float) -> float:
        """log10 of a_T; raises InputError where the law has no meaning, at or below T_ref - C2."""
        above = temperature - self.reference
        if self.C2 + above <= 0.0:
            lowest = self.reference - self.C2
            raise InputError(f"temperature {temperature:g} C: the WLF law of this compound ends at {lowest:g} C")
        return -self.C1 * above / (self.C2 + above)


@dataclass(frozen=True)
class Arrhenius:
    """`energy` of activation [J/mol], reference temperature [deg C]."""

    energy: float
    reference: float

    def log_factor(self, temperature: float) -> float:
        """log10 of a_T; raises InputError at or below absolute zero."""
        if temperature <= -ZERO:
            raise InputError(f"temperature {temperature:g} C is below absolute zero")
        inverse = 1.0 / (temperature + ZERO) - 1.0 / (self.reference + ZERO)
        return self.energy / (GAS * math.log(10.0)) * inverse


@dataclass(frozen=True)
class Factors:
    """log10 of a_T at rising temperatures [deg C]; 0 at the reference."""

    temperatures: tuple[float, ...]
    logs: tuple[float, ...]
    reference: float

    def log_factor(self, temperature: float) -> float:
        """log10 of a_T; raises InputError beyond the temperatures given."""
        low, high = self.temperatures[0], self.temperatures[-1]
        if not low <= temperature <= high:
            raise InputError(f"temperature {temperature:g} C is outside the shift factors, {low:g} to {high:g} C")
        return self._between(temperature) - self._between(self.reference)

    def _between(self, temperature: float) -> float:
        above = max(1, bisect_left(self.temperatures, temperature))
        (low, high), (start, end) = self.temperatures[above - 1 : above + 1], self.logs[above - 1 : above + 1]
        return start + (end - start) * (temperature - low) / (high - low)
