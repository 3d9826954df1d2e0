"""A compound from a table of measured moduli: fitted, and written as a material file that any job can include."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .shift import WLF, Arrhenius, Factors, Shift

TITLE = "# Fitted by parcontact fit to"  # with which material files of fits begin
DIGITS = 7  # of the numbers in a material file


@dataclass(frozen=True)
class Compound:
    """What was measured (`measured`, its `sets` at `temperatures`), the `series` fitted to it at the reference, and the
    `shift` (None for a table of one temperature); `poisson` is the ratio with which Young's moduli were divided."""

    measured: Any
    series: Any
    shift: Shift | None
    poisson: float

    def material(self) -> dict[str, Any]:
        """The material section of a job."""
        pairs = zip(self.series.moduli, self.series.times, strict=True)
        low, high = (_rounded(rate / (2 * math.pi)) for rate in self.series.band)
        return {
            "model": "zener",
            "poisson": self.poisson,
            "modulus_inf": _rounded(self.series.modulus_inf),
            "branches": [{"modulus": _rounded(g), "relaxation_time": _rounded(t)} for g, t in pairs],
            **({"shift": _shift_section(self.shift)} if self.shift is not None else {}),
            "band": [low, high],
        }

    def text(self) -> str:
        """The material file: what it is and how good, then the material."""
        series, shift, section = self.series, self.shift, self.material()
        at = f" at {shift.reference:g} C" if shift is not None else ""
        kind = "Young's moduli, divided by 2 (1 + poisson)" if self.measured.tension else "shear moduli"
        temperatures = [each.temperature for each in self.measured.sets if each.temperature is not None]
        lines = [
            f"{TITLE} {self.measured.path.name}: {kind}, {self.measured.kind} domain.",
            f"# {len(series.moduli)} branches; rms error of the moduli {series.error:.2%}, "
            f"of which {series.scatter:.2%} is scatter of the data.",
            f"# Measured band, reduced{at}: {section['band'][0]:.3g} to {section['band'][1]:.3g} Hz.",
            *([f"# Measured at {', '.join(f'{t:.4g}' for t in temperatures)} C."] if temperatures else []),
            "# All moduli are of shear [Pa], times in s"
            + (f" at {shift.reference:g} C; temperature: T in a job shifts them." if shift is not None else "."),
        ]
        branches = section.pop("branches")
        lines += [f"{key}: {_flow(value)}" for key, value in section.items()]
        lines += ["branches:", *(f"  - {_flow(branch)}" for branch in branches)]
        return "\n".join(lines) + "\n"


def fitted(path: Path, poisson: float, reference: float | None, law: str | Shift, error: float) -> Compound:
    """Read a table and fit it. `law` is wlf, arrhenius or free (constants are fitted too), or a shift that is known;
    `reference` [deg C] defaults to the middle one of the measured temperatures. Raises InputError."""
    from . import series, tables  # scipy is for fits only

    measured = tables.read(path, poisson)
    temperatures = [each.temperature for each in measured.sets if each.temperature is not None]
    shift: Shift | None = None
    if not isinstance(law, str):
        shift = law
    elif len(temperatures) > 1:
        middle = temperatures[len(temperatures) // 2]
        shift = series.find_shift(measured, middle if reference is None else reference, law)
    logs = [shift.log_factor(t) for t in temperatures] if shift is not None and temperatures else None
    return Compound(measured, series.fit(measured.sets, measured.kind, error, logs), shift, poisson)


def _shift_section(shift: Shift) -> dict[str, Any]:
    if isinstance(shift, WLF):
        return {"law": "wlf", "C1": _rounded(shift.C1), "C2": _rounded(shift.C2), "reference": shift.reference}
    if isinstance(shift, Arrhenius):
        return {"law": "arrhenius", "energy": _rounded(shift.energy), "reference": shift.reference}
    assert isinstance(shift, Factors)
    temperatures, logs = ([_rounded(value) for value in values] for values in (shift.temperatures, shift.logs))
    return {"law": "factors", "temperatures": temperatures, "logs": logs, "reference": shift.reference}


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _flow(value: Any) -> str:
    """A value in one line of YAML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_flow(inner) for inner in value) + "]"
    return repr(value) if isinstance(value, float) else str(value)
