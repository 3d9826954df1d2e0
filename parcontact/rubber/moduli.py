"""Reading of tables of measured moduli, which are converted to SI units, or refused with file and line.

Headers, units and numbers are read by `text_tables`: two header rows, as in pyvisco's files, or units in brackets or
behind a slash. The columns are:

* `f, omega, t, f_set` (Hz, rad/s, s) and `T` (C, K);
* `E_stor, E_loss, E_relax`, also written E', E'', E(t), or in words, such as Storage Modulus; the same with G (Pa, kPa,
  MPa, GPa);
* `tan_del`; |E*| and |G*|, absolute values, and delta, the phase angle (deg, rad);
* D(t) and J(t), creep compliances in tension and shear (1/MPa, ...).

A modulus that is named by words alone is taken as Young's modulus, but as the shear modulus if rates are in rad/s, as
rheometers write them. A compliance that is named by words alone is taken as a compliance in shear. There is a warning
if a modulus or a compliance is taken as one in shear. Missing moduli follow from tan delta or the phase angle. Columns
with other names are ignored. Rows of one temperature form a set. Without a column T all rows form one set. In a table
of one frequency and many temperatures each row is a set.

Tables with values that no rubber has, such as moduli in a wrong unit, are refused before a fit.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..columns import MODULI, TEMPERATURES
from ..errors import InputError
from ..text_tables import read_named_columns, unit_size

Array = NDArray[np.float64]
MOST_DECADES = 40.0  # tuning: largest range of frequencies or times of a table
COLDEST = -150.0  # physics [deg C]: lowest temperature of a measurement
SOFTEST, HARDEST = 3e3, 1e13  # physics [Pa]: limits on the largest modulus of a table: a soft gel, ten times diamond
GLASS, SOFT = 4e9, 1e5  # physics [Pa]: largest glassy modulus of rubbers, and least modulus at a glass transition
RISE = 0.1  # accuracy: relative rise of a relaxation modulus that scatter may cause


def refuse_odd(path: Path, kind: str, at: Array, storage: Array, temperatures: Array | None) -> None:
    """Raise InputError for too wide a range of rates or times `at` [rad/s or s], for a largest modulus `storage` [Pa]
    that no solid has, and for `temperatures` [deg C] that are too low; each of these has the shape (n,)."""
    what = "frequencies" if kind == "frequency" else "times"
    decades = math.log10(at.max()) - math.log10(at.min())
    if decades > MOST_DECADES:
        raise InputError(f"{path}: its {what} span {decades:.0f} decades; at most {MOST_DECADES:g} were expected")
    if storage.max() < SOFTEST or storage.max() > HARDEST:
        bound = f"below {SOFTEST:g} Pa, softer than a gel" if storage.max() < SOFTEST else f"above {HARDEST:g} Pa"
        raise InputError(f"{path}: its largest modulus is {storage.max():.3g} Pa, {bound}; is the unit right?")
    if temperatures is not None and temperatures.min() < COLDEST:
        raise InputError(
            f"{path}: its lowest temperature is {temperatures.min():.4g} C, below {COLDEST:g} C; is the unit C, not K?"
        )


def odd_moduli(sets: Sequence[Any]) -> Iterator[str]:
    """Yield a warning if the largest shear modulus of all `sets` (`Set`) is too high or too low for rubber."""
    largest = max(float(each.storage.max()) for each in sets)
    if largest > GLASS:
        yield f"its largest shear modulus is {largest:.3g} Pa, more than rubber has as a glass: is the unit right?"
    if largest < SOFT:
        yield f"its largest shear modulus is {largest:.3g} Pa, softer than any rubber: is the unit right?"


def refuse_rising(path: Path, kind: str, sets: Sequence[Array]) -> None:
    """Raise InputError if a relaxation modulus, or an inverse compliance, rises with time. Each of the `sets` has the
    moduli of one temperature [Pa], shape (n,), by rising times."""
    for moduli in sets:
        if moduli[-1] <= (1.0 + RISE) * moduli[0]:
            continue
        if kind == "creep":
            raise InputError(f"{path}: a compliance falls with time, and every one rises; is it a relaxation modulus?")
        raise InputError(
            f"{path}: a relaxation modulus rises with time, from {moduli[0]:.3g} to {moduli[-1]:.3g} Pa, and every "
            "one falls; are these creep compliances, or storage moduli over frequency?"
        )


def scatter(sweeps: Sequence[tuple[Array, Array]]) -> float:
    """Return the scatter of moduli: the rms deviation of the logarithm of each modulus from the curve through the next
    two points on its left and the next two on its right.

    Each of the `sweeps` has rates and moduli, both of shape (n,), in the order of rising rates. The result is NaN if no
    sweep has five points. The interpolation is cubic in the logarithms, so that smooth curves have no scatter.
    Deviations are divided by the root of 1 + the sum of squared interpolation weights, as for independent errors.
    """
    found = []
    for rates, moduli in sweeps:
        x, y = np.log(rates), np.log(moduli)
        for i in range(2, len(x) - 2):
            others = [i - 2, i - 1, i + 1, i + 2]
            if len(set(x[i - 2 : i + 3])) < 5:
                continue
            weights = [math.prod((x[i] - x[k]) / (x[j] - x[k]) for k in others if k != j) for j in others]
            missed = y[i] - sum(w * y[j] for w, j in zip(weights, others, strict=True))
            found.append(missed / math.sqrt(1.0 + sum(w**2 for w in weights)))
    return float(np.sqrt(np.mean(np.square(found)))) if found else math.nan


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
OTHERS = {*RATES_OF, "t", "T", "tan_del", "delta"}
EXAMPLE = "f[Hz] E'[MPa] E''[MPa]"


@dataclass(frozen=True)
class Set:
    """Moduli measured at one `temperature` [deg C], None for a table without temperatures, by rising rates or times.

    `at`, shape (n,), are angular frequencies [rad/s] of a frequency sweep, or times [s] of relaxation or creep.
    `storage` and `loss`, shape (n,) [Pa], are shear moduli. For relaxation `storage` is the relaxation modulus, for
    creep the inverse compliance, and `loss` is empty.
    """

    temperature: float | None
    at: Array
    storage: Array
    loss: Array


@dataclass(frozen=True)
class Measurement:
    """All sets of a file in the order of their temperatures; `tension` is True if Young's moduli were converted.

    `derived` names the modulus that the table does not have and that was computed from the other modulus and tan delta:
    "stor", "loss", or "" for none. `doubts` are sentences about ambiguities and omissions.
    """

    path: Path
    kind: Kind
    sets: tuple[Set, ...]
    tension: bool
    derived: str = ""
    doubts: tuple[str, ...] = ()

    @property
    def temperatures(self) -> list[float]:
        """Return the measured temperatures [deg C], rising; an empty list if the file has none."""
        return [each.temperature for each in self.sets if each.temperature is not None]

    def without_short_sets(self) -> "Measurement":
        """Return the measurement with only those sets that are long enough to determine a shift; raises InputError if
        there are none."""
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


def read_moduli(path: Path, poisson: float = 0.5) -> Measurement:
    """Return the measurement in the file of a table. Young's moduli are converted to shear moduli, `G = E/(2 (1 +
    nu))`, with the Poisson ratio nu. Raises InputError for a table that cannot be read or that no rubber has."""
    table = read_named_columns(path, "a table of moduli", EXAMPLE, MODULI | OTHERS, _are_enough)
    if len(table.lines) < LEAST_ROWS:
        raise InputError(f"{path} has {len(table.lines)} rows of numbers; at least {LEAST_ROWS} were expected")
    if set(table.columns) >= RATES_OF:
        raise InputError(f"{path}: two columns mean the same: f and omega; remove one")
    values = {name: np.array(column) for name, column in table.columns.items()}
    return _Table(path, values, dict(table.units), table.lines).measurement(poisson)


def _are_enough(names: set[str]) -> bool:
    """Return True if names are those of a table: a modulus, and a rate, time or temperature."""
    return bool(names & MODULI and names & OTHERS)


@dataclass
class _Table:
    """Columns of a file by name, their units, and the line number of each row."""

    path: Path
    values: dict[str, Array]
    units: dict[str, str]
    lines: Sequence[int]

    def measurement(self, poisson: float) -> Measurement:
        """Return the table as a measurement: sets of shear moduli in SI units."""
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
        degrees = None
        if "T" in self.values:
            degrees = self.values["T"] + unit_size(self.path, "T", self.units["T"], TEMPERATURES)
        refuse_odd(self.path, kind, at, moduli[0], degrees)
        sets = tuple(_sets(self.path, at, moduli, degrees))
        if kind != "frequency":
            refuse_rising(self.path, kind, [each.storage for each in sets])
        return Measurement(self.path, kind, sets, letter == "E", derived, doubts)

    def _name_letter(self, factor: float) -> Iterator[str]:
        """Decide whether moduli named by words are of tension (E) or shear (G); yield a warning for shear."""
        if not any(name.startswith("*") for name in self.values):
            return
        creep = "*_creep" in self.values
        named = [letter for letter in "EG" if any(f"{letter}_" in name for name in self.values)]
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
            angles = self._column("delta", ANGLES)
            if (wrong := np.flatnonzero(angles >= math.pi / 2.0)).size:
                row, unit = wrong[0], self.units["delta"]
                got = f"{self.values['delta'][row]:g} {unit}, {math.degrees(angles[row]):.3g} degrees"
                raise InputError(
                    f"{self.path}:{self.lines[row]}: delta must be below 90 degrees, got {got}; is the unit right?"
                )
            self.values["tan_del"], self.units["tan_del"] = np.tan(angles), ""
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
        return self._positive(name) * unit_size(self.path, name, self.units[name], units)

    def _positive(self, name: str) -> Array:
        if name not in self.values:
            raise InputError(f"{self.path} has no column {name}; it has {', '.join(self.values)}")
        wrong = np.flatnonzero(self.values[name] <= 0.0)
        if wrong.size:
            line, value = self.lines[wrong[0]], self.values[name][wrong[0]]
            raise InputError(f"{self.path}:{line}: {name} must be positive, got {value:g}")
        return self.values[name]


def _sets(path: Path, at: Array, moduli: list[Array], temperatures: Array | None) -> Iterator[Set]:
    """Yield the set of each temperature, by rising rates; for a temperature sweep one set per row."""
    one = iter([np.arange(at.size)])
    for rows in one if temperatures is None else _of_one_temperature(path, at, temperatures):
        mean = None if temperatures is None else float(temperatures[rows].mean())
        rows = rows[np.argsort(at[rows], kind="stable")]
        yield Set(mean, at[rows], moduli[0][rows], moduli[1][rows] if len(moduli) > 1 else np.zeros(0))


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
