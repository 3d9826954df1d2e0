"""Time-temperature superposition: at a temperature T a compound relaxes as at the reference, `a_T` times as slowly.

WLF         log10 a_T = -C1 (T - T_ref)/(C2 + T - T_ref)      (M. L. Williams, R. F. Landel, J. D. Ferry,
                                                               J. Am. Chem. Soc. 77 (1955) 3701)
Arrhenius   log10 a_T = E/(R ln 10) (1/T - 1/T_ref)           temperatures in K
table       log10 a_T given at some temperatures, linear between them and nowhere beyond
"""

import math
from bisect import bisect_left
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from ..datafiles import read_lines
from ..errors import InputError

GAS = 8.314462618  # physics: J/(mol K)
ENERGY = 1e3, 1e7  # physics: J/mol: energies of activation are some 1e5
CONSTANT = 1e-3, 1e4  # physics: C1 [-] and C2 [K] of WLF
ZERO = 273.15  # physics: K at 0 deg C


class Shift(Protocol):
    """Dependence of relaxation times on temperature; `reference` [deg C] is where they are as given."""

    @property
    def reference(self) -> float: ...

    def log_factor(self, temperature: float) -> float: ...


@dataclass(frozen=True)
class WLF:
    """`C1` [-] and `C2` [K] at the reference temperature [deg C]."""

    C1: float
    C2: float
    reference: float

    def __str__(self) -> str:
        return f"WLF with C1 = {self.C1:.4g}, C2 = {self.C2:.4g} K, reference {self.reference:g} C"

    def log_factor(self, temperature: float) -> float:
        """log10 of a_T; raises InputError where the law has no meaning, at or below T_ref - C2."""
        above = temperature - self.reference
        if self.C2 + above <= 0.0:
            lowest = self.reference - self.C2
            raise InputError(f"{temperature:g} C is below {lowest:g} C, where the WLF law of this compound ends")
        return -self.C1 * above / (self.C2 + above)


@dataclass(frozen=True)
class Arrhenius:
    """`energy` of activation [J/mol], reference temperature [deg C]."""

    energy: float
    reference: float

    def __str__(self) -> str:
        return f"Arrhenius with {self.energy:.4g} J/mol, reference {self.reference:g} C"

    def log_factor(self, temperature: float) -> float:
        """log10 of a_T; raises InputError at or below absolute zero."""
        if temperature <= -ZERO:
            raise InputError(f"{temperature:g} C is below absolute zero")
        inverse = 1.0 / (temperature + ZERO) - 1.0 / (self.reference + ZERO)
        return self.energy / (GAS * math.log(10.0)) * inverse


@dataclass(frozen=True)
class Factors:
    """log10 of a_T at rising temperatures [deg C]; 0 at the reference."""

    temperatures: tuple[float, ...]
    logs: tuple[float, ...]
    reference: float

    def __str__(self) -> str:
        pairs = ", ".join(f"{log:.3g} at {t:g} C" for t, log in zip(self.temperatures, self.logs, strict=True))
        return f"factors with log10 a_T = {pairs}, reference {self.reference:g} C"

    def log_factor(self, temperature: float) -> float:
        """log10 of a_T; raises InputError beyond the temperatures given."""
        low, high = self.temperatures[0], self.temperatures[-1]
        if not low <= temperature <= high:
            raise InputError(f"{temperature:g} C is outside the shift factors, which reach from {low:g} to {high:g} C")
        return self._between(temperature) - self._between(self.reference)

    def _between(self, temperature: float) -> float:
        above = max(1, bisect_left(self.temperatures, temperature))
        (low, high), (start, end) = self.temperatures[above - 1 : above + 1], self.logs[above - 1 : above + 1]
        return start + (end - start) * (temperature - low) / (high - low)


def given(text: str, reference: float | None) -> str | Shift:
    """Return what a text of the command line means: the name of a law whose constants are to be fitted, or a law.

    `wlf:8.86,101.6` and `arrhenius:1.2e5` hold constants at the reference temperature, another text is the path of a
    file with the columns T[C] and log_aT. Raises InputError.
    """
    if text in ("wlf", "arrhenius", "free"):
        return text
    name, colon, rest = text.partition(":")
    if colon and name in ("wlf", "arrhenius"):
        if reference is None:
            raise InputError(f"--shift {text} needs --reference, the temperature [deg C] that its constants belong to")
        try:
            if name == "arrhenius":
                return Arrhenius(_within(text, float(rest), *ENERGY), reference)
            first, second = (_within(text, float(part), *CONSTANT) for part in rest.split(","))
            return WLF(first, second, reference)
        except ValueError:
            form = "wlf:C1,C2" if name == "wlf" else "arrhenius:J/mol"
            raise InputError(f"--shift must be of the form {form}, got {text!r}") from None
    return _table(Path(text), reference)


def _within(text: str, value: float, low: float, high: float) -> float:
    if not low <= value <= high:
        raise InputError(f"--shift {text}: {value:g} must be {low:g} to {high:g}")
    return value


def _table(path: Path, reference: float | None) -> Factors:
    if not path.is_file():
        laws = "wlf, arrhenius, free, wlf:C1,C2, arrhenius:J/mol or a readable file"
        raise InputError(f"--shift must be {laws}: there is no file {path}")
    lines = read_lines(path, "a table of T[C],log_aT")
    rows = [[cell.strip() for cell in line.split(",")] for _, line in lines]
    units = 2 if rows[0] == ["T", "log_aT"] and rows[1:2] in ([["C", "-"]], [["°C", "-"]]) else 1  # as pyvisco's
    try:
        pairs = sorted((float(temperature), float(log)) for temperature, log in rows[units:])
    except ValueError:
        raise InputError(f"{path}: each row must hold a temperature [deg C] and log10 of a_T") from None
    if (units == 1 and rows[0] != ["T[C]", "log_aT"]) or len(pairs) < 2:
        raise InputError(f"{path}: a table of T[C],log_aT with at least two rows was expected")
    temperatures, logs = zip(*pairs, strict=True)
    if len(set(temperatures)) < len(temperatures):
        raise InputError(f"{path}: a temperature has two factors")
    at = min(pairs, key=lambda pair: abs(pair[1]))[0] if reference is None else reference
    if not temperatures[0] <= at <= temperatures[-1]:
        raise InputError(f"{path}: the reference temperature {at:g} C is outside its factors")
    return Factors(temperatures, logs, at)
