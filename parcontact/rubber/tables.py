"""Tables of measured moduli: what a text file says, in SI units, or one sentence with file and line why it will not do.

Two forms are read. Both name what their columns are; nothing is guessed.

* Two header rows, the names and the units of the columns, as in pyvisco's files (comma, semicolon or tab between them):
  `f, omega, t, f_set` (Hz, rad/s, s), `E_stor, E_loss, E_relax` or `G_...` (Pa, kPa, MPa, GPa), `T` (C, K), `tan_del`.
  E(t) and G(t) are relaxation moduli, too.
* One header row in which units stand in brackets: `f[Hz] E'[MPa] E''[MPa] T[C]`, any white space or comma between; or
  words with units, `Frequency (Hz), Storage Modulus (MPa), Loss Modulus (MPa)`, a comma, semicolon or tab between.
  A modulus without the word shear is Young's.

A missing storage or loss modulus follows from tan delta. Lines that begin with # are comments. Rows of one temperature
are one set; without T all rows are one set.
"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..datafiles import has_decimal_commas, read_lines
from ..errors import InputError
from .sane import refuse_odd, refuse_rising

Array = NDArray[np.float64]
Kind = Literal["frequency", "time"]
LEAST_ROWS = 3  # accuracy: of a set: fewer say nothing about a spectrum
NEAR = 1.5  # accuracy: degrees: measured temperatures of one set vary by less
PRESSURES = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9}
RATES_OF = {"f", "omega"}  # one of them is needed
RATES = {"Hz": 2 * math.pi, "rad/s": 1.0}
TEMPERATURES = {"C": 0.0, "°C": 0.0, "degC": 0.0, "K": -273.15}
NAMES = {"'": "stor", "''": "loss", '"': "loss"}  # E', E'', E"
WORDS = {  # in small letters, as instruments write them
    **{"frequency": "f", "f_set": "f", "angular frequency": "omega", "w": "omega", "ω": "omega", "time": "t"},
    **{"temperature": "T", "temp": "T", "storage modulus": "E_stor", "loss modulus": "E_loss"},
    **{"shear storage modulus": "G_stor", "shear loss modulus": "G_loss", "relaxation modulus": "E_relax"},
    **{"e(t)": "E_relax", "g(t)": "G_relax"},
    **{"shear relaxation modulus": "G_relax", "tan delta": "tan_del", "tan(delta)": "tan_del", "tan_delta": "tan_del"},
    **{"tan d": "tan_del", "tan δ": "tan_del", "tanδ": "tan_del", "loss factor": "tan_del"},
}
WITH_UNIT = re.compile(r"(.+?)\s*(?:\[([^\]]*)\]|\(([^)]*)\))")  # Storage Modulus (MPa), E'[MPa]


@dataclass(frozen=True)
class Set:
    """Moduli measured at one temperature [deg C] (None if the table has none), at rising rates or times.

    `at`, shape (n,): angular frequencies [rad/s] of a frequency sweep, times [s] of a relaxation. `storage` and `loss`,
    shape (n,) [Pa]: of shear; of a relaxation `storage` is the relaxation modulus and `loss` is empty.
    """

    temperature: float | None
    at: Array
    storage: Array
    loss: Array


@dataclass(frozen=True)
class Measurement:
    """All sets of a file, by temperature; `tension` tells that moduli were Young's and have been divided.

    `derived` is the modulus that follows from the other one and tan delta, "stor" or "loss"; "" where both are given.
    """

    path: Path
    kind: Kind
    sets: tuple[Set, ...]
    tension: bool
    derived: str = ""

    @property
    def temperatures(self) -> list[float]:
        """At which it was measured [deg C], rising; none if the file does not say."""
        return [each.temperature for each in self.sets if each.temperature is not None]


class _Column(NamedTuple):
    name: str
    unit: str


def read(path: Path, poisson: float = 0.5) -> Measurement:
    """Read a table; Young's moduli become those of shear, `G = E/(2 (1 + nu))`. Raises InputError."""
    lines = read_lines(path, "a table of moduli")
    columns, first = _columns(path, lines)
    rows = np.array([_numbers(path, number, text, columns) for number, text in lines[first:]])
    if len(rows) < LEAST_ROWS:
        raise InputError(f"{path} has {len(rows)} rows of numbers; at least {LEAST_ROWS} were expected")
    names = [column.name for column in columns]
    for name in names:
        if names.count(name) > 1 or (name in RATES_OF and len(RATES_OF & set(names)) > 1):
            raise InputError(f"{path}: two columns mean the same: {name} is given twice; remove one")
    values = {name: rows[:, k] for k, name in enumerate(names)}
    units = {column.name: column.unit for column in columns}
    return _Table(path, values, units, [number for number, _ in lines[first:]]).measurement(poisson)


def _split(line: str) -> list[str]:
    mark = next((mark for mark in (";", "\t", ",") if mark in line), None)
    return [part.strip().strip('"').strip() for part in line.split(mark)] if mark else line.split()


def _columns(path: Path, lines: Sequence[tuple[int, str]]) -> tuple[list[_Column], int]:
    """The columns, and how many lines name them."""
    number, head = lines[0]
    cells = _split(re.sub(r"\s+(?=[\[(])", "", head))
    with_units = [_with_unit(cell) for cell in cells]
    if any(column and column.unit for column in with_units) and all(with_units):
        return [column for column in with_units if column], 1
    if "[" in head:
        wrong = cells[with_units.index(None)]
        raise InputError(f"{path}:{number}: {wrong!r} must be a name with its unit in brackets, such as f[Hz]")
    names = [_name(name) for name in _split(head)]
    units = _split(lines[1][1]) if len(lines) > 1 else []
    units += [""] * (len(names) - len(units))
    if not (math.isnan(_number(names[0])) and math.isnan(_number(units[0]))):
        raise InputError(
            f"{path}:{number}: names and units of the columns were expected, such as f[Hz] E'[MPa] E''[MPa], or two "
            "rows with names and units"
        )
    return [_Column(*pair) for pair in zip(names, units, strict=False)], 2


def _with_unit(cell: str) -> _Column | None:
    """The column of a cell that names its unit, which tan delta need not; None of another cell."""
    if _name(cell) == "tan_del":
        return _Column("tan_del", "")
    match = WITH_UNIT.fullmatch(cell)
    return _Column(_name(match[1]), (match[2] or match[3] or "").strip()) if match else None


def _name(text: str) -> str:
    """The name of a column as pyvisco spells it: E' is E_stor, f_set is f."""
    text = text.strip().replace("″", "''").replace("′", "'")
    if match := re.fullmatch(r"([EG])('{1,2}|\")", text):
        return f"{match[1]}_{NAMES[match[2]]}"
    return WORDS.get(re.sub(r"\s+", " ", text.lower()), text)


def _number(text: str) -> float:
    """The number that a text is; nan for another text."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def _numbers(path: Path, number: int, text: str, columns: Sequence[_Column]) -> list[float]:
    parts = _split(text)
    if has_decimal_commas(text) and (";" in text or len(parts) != len(columns)):
        raise InputError(f"{path}:{number}: its numbers have decimal commas; write them with points")
    if len(parts) != len(columns):
        raise InputError(f"{path}:{number}: {len(parts)} values where {len(columns)} columns are named")
    for part, column in zip(parts, columns, strict=True):
        if not math.isfinite(_number(part)):
            raise InputError(f"{path}:{number}: {column.name} must be a finite number, got {part!r}")
    return [float(part) for part in parts]


@dataclass
class _Table:
    """The columns of a file by name, their units, and the number of each row's line."""

    path: Path
    values: dict[str, Array]
    units: dict[str, str]
    lines: Sequence[int]

    def measurement(self, poisson: float) -> Measurement:
        """Return the columns as sets in SI units."""
        derived = self._complete()
        modulus = self._name_modulus()
        kind: Kind = "time" if f"{modulus}_relax" in self.values else "frequency"
        factor = 1.0 / (2.0 * (1.0 + poisson)) if modulus == "E" else 1.0
        if kind == "time":
            at, names = self._column("t", {"s": 1.0}), [f"{modulus}_relax"]
        else:
            at = self._column("omega" if "omega" in self.values else "f", RATES)
            names = [f"{modulus}_stor", f"{modulus}_loss"]
        moduli = [self._column(name, PRESSURES) * factor for name in names]
        degrees = self.values["T"] + self._unit("T", TEMPERATURES) if "T" in self.values else None
        refuse_odd(self.path, kind, at, moduli[0], degrees)
        sets = tuple(_sets(self.path, at, moduli, degrees))
        if kind == "time":
            refuse_rising(self.path, [each.storage for each in sets])
        return Measurement(self.path, kind, sets, modulus == "E", derived)

    def _complete(self) -> str:
        """Add the storage or loss modulus that follows from the other one and tan delta; returns which, if one does."""
        for modulus in ("E", "G") if "tan_del" in self.values else ():
            storage, loss = f"{modulus}_stor", f"{modulus}_loss"
            if (storage in self.values) != (loss in self.values):
                known, missing = (storage, loss) if storage in self.values else (loss, storage)
                tangent = self._positive("tan_del")
                given = self.values[known]
                self.values[missing] = given * tangent if missing == loss else given / tangent
                self.units[missing] = self.units[known]
                return missing.removeprefix(f"{modulus}_")
        return ""

    def _name_modulus(self) -> str:
        """E or G, whichever the columns name, and completely."""
        for modulus in ("E", "G"):
            if f"{modulus}_relax" in self.values or {f"{modulus}_stor", f"{modulus}_loss"} <= self.values.keys():
                return modulus
        raise InputError(
            f"{self.path} has the columns {', '.join(self.values)}; it needs f or omega with E_stor and E_loss (or "
            "G_stor and G_loss), or t with E_relax, also spelt E(t) (or G_relax, G(t))"
        )

    def _column(self, name: str, units: dict[str, float]) -> Array:
        """A column of positive numbers in SI units."""
        return self._positive(name) * self._unit(name, units)

    def _positive(self, name: str) -> Array:
        if name not in self.values:
            raise InputError(f"{self.path} has no column {name}; it has {', '.join(self.values)}")
        wrong = np.flatnonzero(self.values[name] <= 0.0)
        if wrong.size:
            line, value = self.lines[wrong[0]], self.values[name][wrong[0]]
            raise InputError(f"{self.path}:{line}: {name} must be positive, got {value:g}")
        return self.values[name]

    def _unit(self, name: str, known: dict[str, float]) -> float:
        unit = self.units[name]
        if unit not in known:
            raise InputError(
                f"{self.path}: the unit of {name} must be one of {', '.join(known)}, got {unit or 'none'!r}"
            )
        return known[unit]


def _sets(path: Path, at: Array, moduli: list[Array], temperatures: Array | None) -> Iterator[Set]:
    """Rows of one temperature each, in the order of their rates."""
    one = iter([np.arange(at.size)])
    for rows in one if temperatures is None else _of_one_temperature(path, at, temperatures):
        mean = None if temperatures is None else float(temperatures[rows].mean())
        if rows.size < LEAST_ROWS:
            raise InputError(f"{path}: {rows.size} rows at {mean:g} C; at least {LEAST_ROWS} were expected")
        rows = rows[np.argsort(at[rows], kind="stable")]
        empty = np.zeros(0)
        yield Set(mean, at[rows], moduli[0][rows], moduli[1][rows] if len(moduli) > 1 else empty)


def _of_one_temperature(path: Path, at: Array, temperatures: Array) -> Iterator[NDArray[np.intp]]:
    """Rows of one temperature each, which may waver: of one sweep, in which no rate or time comes twice."""
    order = np.argsort(temperatures, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(temperatures[order]) >= NEAR) + 1):
        low, high = temperatures[rows[0]], temperatures[rows[-1]]
        numbers = np.split(rows, np.flatnonzero(np.diff(temperatures[rows]) > 0.0) + 1)
        several = high - low >= NEAR or np.unique(at[rows]).size < rows.size
        if several and min(each.size for each in numbers) >= LEAST_ROWS:
            yield from numbers
        elif high - low >= NEAR:
            raise InputError(
                f"{path}: its temperatures from {low:.4g} to {high:.4g} C cannot be told apart: those of one sweep "
                f"must be one number, or lie {NEAR:g} degrees and more from those of the next"
            )
        else:
            yield rows
