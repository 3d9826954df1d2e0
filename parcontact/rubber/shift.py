"""Time-temperature superposition: relaxation times at a temperature T are a_T times those at the reference temperature.

WLF         log10 a_T = -C1 (T - T_ref)/(C2 + T - T_ref)      (M. L. Williams, R. F. Landel, J. D. Ferry,
                                                               J. Am. Chem. Soc. 77 (1955) 3701)
Arrhenius   log10 a_T = E/(R ln 10) (1/T - 1/T_ref)           temperatures in K
table       log10 a_T given at some temperatures, linear between them, undefined outside

Moduli are b_T times those at the reference:

density     b_T = rho T/(rho_ref T_ref), temperatures in K     (J. D. Ferry, Viscoelastic Properties of Polymers (1980),
            rho = rho_ref (1 - expansion (T - T_ref))           chapter 11: the entropy of a network)
table       log10 b_T given at some temperatures, likewise
"""

import math
from bisect import bisect_left
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from ..columns import TEMPERATURES
from ..errors import Doubt, InputError, Kind
from ..text_tables import read_named_columns

GAS = 8.314462618  # physics: J/(mol K)
ENERGY = 1e3, 1e7  # physics: limits on the activation energy [J/mol]
CONSTANT = 1e-3, 1e4  # physics: limits on C1 [-] and C2 [K] of WLF
HOTTEST = 200.0  # physics: limit on temperatures of rubber [deg C], which decomposes beyond; 200 K is -73 C
SHOWN = 12  # largest number of factors that are printed
ZERO = 273.15  # physics: K at 0 deg C


@dataclass(frozen=True)
class Density:
    """Moduli proportional to density times temperature; `expansion` [1/K] is the relative loss of density per kelvin at
    the reference temperature [deg C]."""

    expansion: float
    reference: float

    def __str__(self) -> str:
        return f"density times temperature, with an expansion of {self.expansion:.3g} 1/K"

    def log_factor(self, temperature: float) -> float:
        """Return log10 of b_T; raises InputError at or below absolute zero, and if the density is not positive."""
        density = 1.0 - self.expansion * (temperature - self.reference)
        if temperature <= -ZERO or density <= 0.0:
            raise InputError(f"{temperature:g} C is beyond the density law of the moduli")
        return math.log10(density * (temperature + ZERO) / (self.reference + ZERO))


@dataclass(frozen=True)
class WLF:
    """Shift law of Williams, Landel and Ferry: `C1` [-] and `C2` [K] at the reference temperature [deg C]."""

    C1: float
    C2: float
    reference: float
    vertical: "Density | Factors | None" = None

    def __str__(self) -> str:
        return f"WLF with C1 = {self.C1:.4g}, C2 = {self.C2:.4g} K, reference {self.reference:g} C"

    def log_factor(self, temperature: float) -> float:
        """Return log10 of a_T; raises InputError at or below T_ref - C2, where the law is not defined."""
        above = temperature - self.reference
        if self.C2 + above <= 0.0:
            lowest = self.reference - self.C2
            raise InputError(f"{temperature:g} C is below {lowest:g} C, where the WLF law of this compound ends")
        return -self.C1 * above / (self.C2 + above)


@dataclass(frozen=True)
class Arrhenius:
    """Shift law of Arrhenius: activation `energy` [J/mol] and reference temperature [deg C]."""

    energy: float
    reference: float
    vertical: "Density | Factors | None" = None

    def __str__(self) -> str:
        return f"Arrhenius with {self.energy:.4g} J/mol, reference {self.reference:g} C"

    def log_factor(self, temperature: float) -> float:
        """Return log10 of a_T; raises InputError at or below absolute zero."""
        if temperature <= -ZERO:
            raise InputError(f"{temperature:g} C is below absolute zero")
        inverse = 1.0 / (temperature + ZERO) - 1.0 / (self.reference + ZERO)
        return self.energy / (GAS * math.log(10.0)) * inverse


@dataclass(frozen=True)
class Factors:
    """Factors by a table: `logs` are log10 of a_T, or of b_T, at rising `temperatures` [deg C]; they are taken relative
    to the factor at the `reference` temperature [deg C]."""

    temperatures: tuple[float, ...]
    logs: tuple[float, ...]
    reference: float
    vertical: "Density | Factors | None" = None

    def __str__(self) -> str:
        pairs = [f"{log:.3g} at {t:.4g} C" for t, log in zip(self.temperatures, self.logs, strict=True)]
        shown = pairs if len(pairs) <= SHOWN else [pairs[0], "...", pairs[-1]]
        return f"{len(pairs)} factors, log10: {', '.join(shown)}, reference {self.reference:.4g} C"

    def log_factor(self, temperature: float) -> float:
        """Return log10 of a_T; raises InputError outside the given temperatures."""
        low, high = self.temperatures[0], self.temperatures[-1]
        if not low <= temperature <= high:
            raise InputError(f"{temperature:g} C is outside the shift factors, which reach from {low:g} to {high:g} C")
        return self._between(temperature) - self._between(self.reference)

    def _between(self, temperature: float) -> float:
        above = max(1, bisect_left(self.temperatures, temperature))
        (low, high), (start, end) = self.temperatures[above - 1 : above + 1], self.logs[above - 1 : above + 1]
        return start + (end - start) * (temperature - low) / (high - low)


Shift = WLF | Arrhenius | Factors  # shift of relaxation times, which are given at `reference` [deg C]


def highest_temperature(shift: Shift) -> float:
    """Return the temperature [deg C] at which the tables of a shift end; inf for a law without tables."""
    tables = [law for law in (shift, shift.vertical) if isinstance(law, Factors)]
    return min((law.temperatures[-1] for law in tables), default=math.inf)


def log_vertical(shift: Shift, temperature: float) -> float:
    """Return log10 of b_T at a temperature [deg C], 0 without a vertical law; raises InputError outside its range."""
    return 0.0 if shift.vertical is None else shift.vertical.log_factor(temperature)


WARN_KELVIN = Kind(
    "kelvin",
    "{degrees:g} C is hotter than rubber endures (limit: {most:g} C). Temperatures are in deg C: if this is in "
    "kelvin, give {celsius:g}",
)


def doubt_kelvin(place: str, temperatures: Iterable[float | None]) -> Iterator[Doubt]:
    """Yield a warning if the highest of the `temperatures` [deg C] is hotter than rubber endures."""
    highest = max((value for value in temperatures if value is not None), default=0.0)
    if highest > HOTTEST:
        yield WARN_KELVIN(place, {"degrees": highest, "most": HOTTEST, "celsius": round(highest - ZERO, 6)})


def read_shift(text: str, reference: float | None) -> str | Shift:
    """Return the shift that a command line gives: the name of a law whose constants are to be fitted, or a known law.

    `wlf:8.86,101.6` and `arrhenius:1.2e5` have constants at the reference temperature; another text is the path of a
    file with the columns T[C] and log_aT, and optionally log_bT. Raises InputError.
    """
    if text in ("wlf", "arrhenius", "free"):
        return text
    name, colon, rest = text.partition(":")
    if colon and name in ("wlf", "arrhenius"):
        if reference is None:
            raise InputError(f"--shift {text} needs --reference, the temperature [deg C] that its constants belong to")
        if not reference > -ZERO:
            raise InputError(f"--reference must be above {-ZERO:g} C, got {reference:g}")
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


NAMES = {"T", "log_aT", "log_bT"}
EXAMPLE = "T[C],log_aT or T[C],log_aT,log_bT"


def _table(path: Path, reference: float | None) -> Factors:
    if not path.is_file():
        laws = "wlf, arrhenius, free, wlf:C1,C2, arrhenius:J/mol or a readable file"
        raise InputError(f"--shift must be {laws}: there is no file {path}")
    table = read_named_columns(path, "a table of T[C],log_aT", EXAMPLE, NAMES, {"T", "log_aT"}.issubset)
    if not {"T", "log_aT"} <= table.columns.keys() or len(table.lines) < 2:
        raise InputError(f"{path}: a table of {EXAMPLE}, with at least two rows was expected")
    zero = table.unit("T", TEMPERATURES)
    for name in table.columns.keys() - {"T"}:
        table.unit(name, {"": 1.0})
    columns = [table.columns[name] for name in ("T", "log_aT", "log_bT") if name in table.columns]
    rows = sorted((row[0] + zero, *row[1:]) for row in zip(*columns, strict=True))
    temperatures, *logs = zip(*rows, strict=True)
    if len(set(temperatures)) < len(temperatures):
        raise InputError(f"{path}: a temperature has two factors")
    nearest = min(zip(logs[0], temperatures, strict=True), key=lambda pair: abs(pair[0]))[1]
    at = nearest if reference is None else reference
    if not temperatures[0] <= at <= temperatures[-1]:
        raise InputError(f"{path}: the reference temperature {at:g} C is outside its factors")
    return Factors(temperatures, logs[0], at, Factors(temperatures, logs[1], at) if len(logs) > 1 else None)
