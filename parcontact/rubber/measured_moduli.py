"""Tables of measured moduli, converted to SI units, or refused in one sentence with file and line.

Lines of a laboratory may precede the names of the columns. These have one of two forms; nothing is guessed.

* Two header rows, the names and the units of the columns, as in pyvisco's files (comma, semicolon or tab between
  them): `f, omega, t, f_set` (Hz, rad/s, s), `E_stor, E_loss, E_relax` or `G_...` (Pa, kPa, MPa, GPa), `T` (C, K),
  `tan_del`. E(t) and G(t) are relaxation moduli, D(t) and J(t) creep compliances in tension and shear (1/MPa, ...),
  |E*| and |G*| absolute values, and delta the phase angle (deg, rad).
* One header row with units in brackets: `f[Hz] E'[MPa] E''[MPa] T[C]`, separated by white space or commas; or words
  with units, `Frequency (Hz), Storage Modulus (MPa), Loss Modulus (MPa)`, separated by commas, semicolons or tabs.

A modulus named by words alone is Young's. With rates in rad/s, as from rheometers, and for compliances, it is taken as
shear, with a warning. Missing moduli follow from tan delta or the phase angle. Lines that begin with # are
comments; columns with other names are ignored. Rows of one temperature are one set; without T all rows are one set,
and rows of one frequency at many temperatures are one set each.
"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..datafiles import has_decimal_commas, read_lines, split_cells
from ..errors import InputError
from .sane import refuse_odd, refuse_rising

Array = NDArray[np.float64]
Kind = Literal["frequency", "time", "creep"]
LEAST_ROWS = 3  # accuracy: least number of rows of a set
NEAR = 1.5  # accuracy: largest variation of the temperatures of one set [K]
ONE_FREQUENCY = 1.01  # accuracy: highest over lowest frequency of a temperature sweep
PRESSURES = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9}
COMPLIANCES = {form.format(unit): 1.0 / size for unit, size in PRESSURES.items() for form in ("1/{}", "{}^-1", "{}-1")}
RATES_OF = {"f", "omega"}  # one of them is needed
RATES = {"Hz": 2 * math.pi, "rad/s": 1.0, "1/s": 1.0}
TIMES = {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}
ANGLES = {"deg": math.pi / 180, "°": math.pi / 180, "degrees": math.pi / 180, "rad": 1.0}
TEMPERATURES = {"C": 0.0, "°C": 0.0, "degC": 0.0, "deg C": 0.0, "K": -273.15}
PRIMES = {"'": "stor", "''": "loss", '"': "loss"}  # E', E'', E"
WORDS = {  # lower case, as instruments write them; * is an unknown letter
    **{"frequency": "f", "f_set": "f", "angular frequency": "omega", "w": "omega", "ω": "omega", "time": "t"},
    **{"step time": "t", "temperature": "T", "temp": "T", "temp.": "T"},
    **{"storage modulus": "*_stor", "loss modulus": "*_loss", "relaxation modulus": "*_relax"},
    **{"complex modulus": "*_abs", "creep compliance": "*_creep", "compliance": "*_creep"},
    **{f"shear {word} modulus": f"G_{short}" for word, short in (("storage", "stor"), ("loss", "loss"))},
    **{f"shear {word} modulus": f"G_{short}" for word, short in (("relaxation", "relax"), ("complex", "abs"))},
    **{"complex shear modulus": "G_abs", "shear creep compliance": "G_creep", "tensile creep compliance": "E_creep"},
    **{"e(t)": "E_relax", "g(t)": "G_relax", "d(t)": "E_creep", "j(t)": "G_creep"},
    **dict.fromkeys(("tan delta", "tan(delta)", "tan_delta", "tan d", "tan δ", "tanδ", "loss factor"), "tan_del"),
    **dict.fromkeys(("tan(δ)", "damping factor"), "tan_del"),
    **dict.fromkeys(("delta", "δ", "phase angle", "phase", "loss angle", "phase shift angle"), "delta"),
}
KNOWN = {f"{letter}_{part}" for letter in "EG*" for part in ("stor", "loss", "relax", "abs", "creep")}
OTHERS = {*RATES_OF, "t", "T", "tan_del", "delta"}
WITH_UNIT = re.compile(r"(.+?)\s*(?:\[([^\]]*)\]|\(([^()]*)\))")  # Storage Modulus (MPa), E'[MPa]


@dataclass(frozen=True)
class Set:
    """Moduli measured at one temperature [deg C] (None if the table has none), at rising rates or times.

    `at`, shape (n,): angular frequencies [rad/s] of a frequency sweep, times [s] of relaxation or creep. `storage`
    and `loss`, shape (n,) [Pa], of shear. For relaxation `storage` is the relaxation modulus, for creep the inverse
    compliance, and `loss` is empty.
    """

    temperature: float | None
    at: Array
    storage: Array
    loss: Array


@dataclass(frozen=True)
class Measurement:
    """All sets of a file, by temperature; `tension`: Young's moduli were converted.

    `derived` is the modulus computed from the other one and tan delta, "stor" or "loss", or "". `doubts` are
    sentences about ambiguities and omissions.
    """

    path: Path
    kind: Kind
    sets: tuple[Set, ...]
    tension: bool
    derived: str = ""
    doubts: tuple[str, ...] = ()

    @property
    def temperatures(self) -> list[float]:
        """Measured temperatures [deg C], rising; none if the file has none."""
        return [each.temperature for each in self.sets if each.temperature is not None]

    @property
    def has_short_sets(self) -> bool:
        """True if a set is too short to determine a shift, as in a temperature sweep."""
        return any(each.at.size < LEAST_ROWS for each in self.sets)

    def without_short_sets(self) -> "Measurement":
        """Return the sets that are long enough to determine a shift; raises InputError if there are none."""
        long = tuple(each for each in self.sets if each.at.size >= LEAST_ROWS)
        short = [each for each in self.sets if each.at.size < LEAST_ROWS]
        if not long:
            raise InputError(
                f"{self.path} has {len(short)} temperatures with less than {LEAST_ROWS} rows each: a temperature sweep "
                "does not show how times shift with temperature; give the shift, parcontact fit --shift wlf:C1,C2 "
                "--reference T, or --shift FILE with a table of T[C],log_aT"
            )
        lost = tuple(
            f"the sweep at {each.temperature:g} C is left out: it has less than {LEAST_ROWS} rows ({each.at.size})"
            for each in short
        )
        return replace(self, sets=long, doubts=self.doubts + lost)


class _Column(NamedTuple):
    name: str
    unit: str | None  # None in a one-row header without a unit


def read_moduli(path: Path, poisson: float = 0.5) -> Measurement:
    """Read a table; Young's moduli are converted to shear, `G = E/(2 (1 + nu))`. Raises InputError."""
    lines = read_lines(path, "a table of moduli")
    columns, first = _columns(path, lines)
    rows = np.array([_numbers(path, number, text, columns) for number, text in lines[first:]])
    if len(rows) < LEAST_ROWS:
        raise InputError(f"{path} has {len(rows)} rows of numbers; at least {LEAST_ROWS} were expected")
    names = [column.name for column in columns]
    for name in KNOWN | OTHERS:
        if names.count(name) > 1 or (name in RATES_OF and len(RATES_OF & set(names)) > 1):
            raise InputError(f"{path}: two columns mean the same: {name} is given twice; remove one")
    values = {name: rows[:, k] for k, name in enumerate(names)}
    units = {column.name: column.unit or "" for column in columns}
    return _Table(path, values, units, [number for number, _ in lines[first:]]).measurement(poisson)


def _columns(path: Path, lines: Sequence[tuple[int, str]]) -> tuple[list[_Column], int]:
    """Return the columns, and the number of lines down to the last header row: the first row that names a modulus and a
    rate, time or temperature, else the first of all."""
    heads = [_head(text) for _, text in lines]
    named = (at for at, head in enumerate(heads) if (names := {each.name for each in head}) & KNOWN and names & OTHERS)
    at = next(named, 0)
    (number, text), head = lines[at], heads[at]
    if any(each.unit for each in head):
        for each in head:
            if each.unit is None and each.name in (KNOWN | OTHERS) - {"tan_del"}:
                cell = next(cell for cell in _cells(text) if _name(cell) == each.name)
                raise InputError(f"{path}:{number}: {cell!r} must be a name with its unit in brackets, such as f[Hz]")
        return head, at + 1
    units = split_cells(lines[at + 1][1]) if len(lines) > at + 1 else []
    units += [""] * (len(head) - len(units))
    if not (math.isnan(_number(head[0].name)) and math.isnan(_number(units[0]))):
        raise InputError(
            f"{path}:{number}: names and units of the columns were expected, such as f[Hz] E'[MPa] E''[MPa], or two "
            "rows with names and units"
        )
    return [_Column(each.name, unit) for each, unit in zip(head, units, strict=False)], at + 2


def _cells(text: str) -> list[str]:
    return split_cells(re.sub(r"\s+(?=[\[(])", "", text))


def _head(text: str) -> list[_Column]:
    """Return the names in a line, with the units in brackets."""
    return [_with_unit(cell) for cell in _cells(text)]


def _with_unit(cell: str) -> _Column:
    match = WITH_UNIT.fullmatch(cell)
    if match is None or _name(cell) in KNOWN | OTHERS:  # E(t), tan(delta)
        return _Column(_name(cell), None)
    return _Column(_name(match[1]), (match[2] or match[3] or "").strip())


def _name(text: str) -> str:
    """Return the name of a column in pyvisco's spelling: E' is E_stor, f_set is f; |E*| is E_abs."""
    text = text.strip().replace("″", "''").replace("′", "'").replace("’", "'")
    if match := re.fullmatch(r"([EG])('{1,2}|\")", text):
        return f"{match[1]}_{PRIMES[match[2]]}"
    if match := re.fullmatch(r"\|?([EG])\*\|?", text):
        return f"{match[1]}_abs"
    return WORDS.get(re.sub(r"\s+", " ", text.lower()), text)


def _number(text: str) -> float:
    """Return the number in a text; nan if it is not a number."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def _numbers(path: Path, number: int, text: str, columns: Sequence[_Column]) -> list[float]:
    """Return the numbers of a row; nan in ignored columns."""
    parts = split_cells(text)
    if has_decimal_commas(text) and (";" in text or "\t" in text or len(parts) != len(columns)):
        raise InputError(f"{path}:{number}: its numbers have decimal commas; write them with points")
    if len(parts) != len(columns):
        raise InputError(f"{path}:{number}: {len(parts)} values where {len(columns)} columns are named")
    for part, column in zip(parts, columns, strict=True):
        if column.name in KNOWN | OTHERS and not math.isfinite(_number(part)):
            raise InputError(f"{path}:{number}: {column.name} must be a finite number, got {part!r}")
    return [_number(part) for part in parts]


@dataclass
class _Table:
    """Columns of a file by name, their units, and the line number of each row."""

    path: Path
    values: dict[str, Array]
    units: dict[str, str]
    lines: Sequence[int]

    def measurement(self, poisson: float) -> Measurement:
        """Return the columns as sets in SI units."""
        doubts = tuple(self._name_letter(2.0 * (1.0 + poisson)))
        derived = self._complete()
        letter, kind = self._find_moduli()
        factor = 1.0 / (2.0 * (1.0 + poisson)) if letter == "E" else 1.0
        if kind == "frequency":
            at = self._column("omega" if "omega" in self.values else "f", RATES)
            moduli = [self._column(f"{letter}_{part}", PRESSURES) for part in ("stor", "loss")]
        elif kind == "time":
            at, moduli = self._column("t", TIMES), [self._column(f"{letter}_relax", PRESSURES)]
        else:
            at, moduli = self._column("t", TIMES), [1.0 / self._column(f"{letter}_creep", COMPLIANCES)]
        moduli = [factor * each for each in moduli]
        degrees = self.values["T"] + self._unit("T", TEMPERATURES) if "T" in self.values else None
        refuse_odd(self.path, kind, at, moduli[0], degrees)
        sets = tuple(_sets(self.path, at, moduli, degrees))
        if kind != "frequency":
            refuse_rising(self.path, kind, [each.storage for each in sets])
        return Measurement(self.path, kind, sets, letter == "E", derived, doubts)

    def _name_letter(self, factor: float) -> Iterator[str]:
        """Decide whether moduli named by words are of tension (E) or shear (G); yield a warning for shear."""
        if not any(name.startswith("*") for name in self.values):
            return
        creep, named = (
            "*_creep" in self.values,
            [letter for letter in "EG" if any(f"{letter}_" in n for n in self.values)],
        )
        radians = "omega" in self.values and self.units["omega"] != "Hz"
        letter = named[0] if named else "G" if creep or radians else "E"
        for columns in (self.values, self.units):
            for name in [name for name in columns if name.startswith("*")]:
                columns[name.replace("*", letter)] = columns.pop(name)  # type: ignore[assignment]
        if letter == "G" and not named:
            factors = f"otherwise the body is {factor:g} times too stiff"
            if creep:
                yield (
                    f"{self.path.name} does not say whether its compliance is of shear (J) or tension (D): it is taken "
                    f"for J. If it is D, call the column D(t): {factors}"
                )
            else:
                yield (
                    f"{self.path.name} has angular frequencies, as rheometers write them, and does not say whether its "
                    "moduli are of shear (G) or tension (E): they are taken for G. If they are E, call the columns E' "
                    f"and E'': {factors}"
                )

    def _complete(self) -> str:
        """Add the moduli that follow from tan delta or the phase angle. Return the one that follows from the other, or
        ""."""
        if "delta" in self.values and "tan_del" not in self.values:
            self.values["tan_del"], self.units["tan_del"] = np.tan(self._column("delta", ANGLES)), ""
        for letter in "EG" if "tan_del" in self.values else "":
            absolute, storage, loss = (f"{letter}_{part}" for part in ("abs", "stor", "loss"))
            if absolute in self.values and not {storage, loss} & self.values.keys():
                self.values[storage] = self._positive(absolute) / np.sqrt(1.0 + self._positive("tan_del") ** 2)
                self.units[storage] = self.units[absolute]
            if (storage in self.values) != (loss in self.values):
                known, missing = (storage, loss) if storage in self.values else (loss, storage)
                tangent = self._positive("tan_del")
                given = self.values[known]
                self.values[missing] = given * tangent if missing == loss else given / tangent
                self.units[missing] = self.units[known]
                return "" if absolute in self.values else missing.removeprefix(f"{letter}_")
        return ""

    def _find_moduli(self) -> tuple[str, Kind]:
        """Return E or G, whichever the columns name completely, and the kind of measurement."""
        kinds: dict[Kind, tuple[str, ...]] = {"time": ("relax",), "creep": ("creep",), "frequency": ("stor", "loss")}
        for letter in "EG":
            for kind, parts in kinds.items():
                if {f"{letter}_{part}" for part in parts} <= self.values.keys():
                    return letter, kind
        raise InputError(
            f"{self.path} has the columns {', '.join(self.values)}; it needs f or omega with E_stor and E_loss (or "
            "G_stor and G_loss), or one of them or |E*| with tan delta or the phase angle delta, or t with E_relax, "
            "also spelt E(t) (or G_relax, G(t)), or t with a compliance J(t) or D(t)"
        )

    def _column(self, name: str, units: dict[str, float]) -> Array:
        """Return a column of positive numbers in SI units."""
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
    """Yield the set of each temperature, by rising rates; for a temperature sweep one set per row."""
    one = iter([np.arange(at.size)])
    for rows in one if temperatures is None else _of_one_temperature(path, at, temperatures):
        mean = None if temperatures is None else float(temperatures[rows].mean())
        rows = rows[np.argsort(at[rows], kind="stable")]
        empty = np.zeros(0)
        yield Set(mean, at[rows], moduli[0][rows], moduli[1][rows] if len(moduli) > 1 else empty)


def _of_one_temperature(path: Path, at: Array, temperatures: Array) -> Iterator[NDArray[np.intp]]:
    """Yield the rows of each temperature, which may vary within a sweep: no rate or time occurs twice in a sweep."""
    order = np.argsort(temperatures, kind="stable")
    if at.max() < ONE_FREQUENCY * at.min() and np.ptp(temperatures) >= NEAR:
        yield from order[:, None]
        return
    for rows in np.split(order, np.flatnonzero(np.diff(temperatures[order]) >= NEAR) + 1):
        low, high = temperatures[rows[0]], temperatures[rows[-1]]
        numbers = np.split(rows, np.flatnonzero(np.diff(temperatures[rows]) > 0.0) + 1)
        several = high - low >= NEAR or np.unique(at[rows]).size < rows.size
        if several and min(each.size for each in numbers) >= LEAST_ROWS:
            yield from numbers
        elif high - low >= NEAR:
            raise InputError(
                f"{path}: its temperatures from {low:.4g} to {high:.4g} C cannot be separated: those of one sweep "
                f"must be one number, or lie {NEAR:g} degrees and more from those of the next"
            )
        else:
            yield rows
