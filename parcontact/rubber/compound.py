"""A compound from a table of measured moduli: fitted, and written as a material file that any job can include."""

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..printed import per_cent
from .shift import WLF, Arrhenius, Factors, Shift

if TYPE_CHECKING:
    from .series import Weigh

TITLE = "# Fitted by parcontact fit to"  # with which material files of fits begin
POOR, HOPELESS = 0.2, 1.0  # accuracy: rms errors of fits that are warned of, and refused
CONTRADICTS, LEAST_DOUBT = 2.0, 0.02  # accuracy: misfits of more than so many times the scatter, and so much, are told
SWAPPED = 0.5  # accuracy: of the misfit: that of exchanged moduli, if they were
WIDE_GAP = 1.0  # accuracy: decades between sweeps as shifted, beyond which they say nothing of the shift
DIGITS = 7  # accuracy: of the numbers in a material file
LAWS = {WLF: "wlf", Arrhenius: "arrhenius", Factors: "factors"}


@dataclass(frozen=True)
class Compound:
    """The measurement (`measured`, its `sets` at `temperatures`), the `series` fitted to it at the reference, and the
    `shift` (None for a table of one temperature); `poisson` is the ratio with which Young's moduli were divided; both
    moduli count in the fit, or only the one to `weigh`; whether the shift was fitted to the sweeps that it `joined`."""

    measured: Any
    series: Any
    shift: Shift | None
    poisson: float
    weigh: "Weigh" = "both"
    joined: bool = False

    def material(self) -> dict[str, Any]:
        """The material section of a job."""
        pairs = zip(self.series.moduli, self.series.times, strict=True)
        degrees = self.measured.temperatures
        return {
            "model": "zener",
            "poisson": self.poisson,
            "modulus_inf": _rounded(self.series.modulus_inf),
            "branches": [_rounded({"modulus": g, "relaxation_time": t}) for g, t in pairs],
            **({"shift": _shift_section(self.shift)} if self.shift is not None else {}),
            "band": _rounded([rate / (2 * math.pi) for rate in self.series.band]),
            **({"temperatures": _rounded([min(degrees), max(degrees)])} if self.shift and degrees else {}),
        }

    @property
    def _weighed(self) -> str:
        return "moduli" if self.weigh == "both" else f"{self.weigh} modulus"

    def doubts(self) -> list[str]:
        """Return warnings of a fit that misses the table by more than it scatters, and of tables of no rubber."""
        from .sane import odd_moduli  # with numpy, which is slow to import

        series, found = self.series, []
        if series.error > POOR:
            found.append(
                f"the fit misses the {self._weighed} by {per_cent(series.error)} (rms), more than {per_cent(POOR)}"
            )
        noise = 0.0 if math.isnan(series.scatter) else series.scatter
        both = self.measured.kind == "frequency" and self.weigh == "both"
        if both and series.best > max(CONTRADICTS * noise, LEAST_DOUBT):
            storage, loss = series.alone
            found.append(
                "storage and loss moduli contradict each other (Kramers-Kronig), or the sweeps do not shift onto one "
                f"curve: the best fit to both misses them by {per_cent(series.best)}, fits to one of them by "
                f"{per_cent(storage)} and {per_cent(loss)}, and neighbouring points of a sweep scatter by "
                f"{per_cent(noise)}. Check the table, or fit one of them: --weight storage, or --weight loss"
            )
        return [*found, *self._gaps(), *odd_moduli(self.measured.sets)]

    def _gaps(self) -> Iterator[str]:
        """Tell neighbouring sweeps that are far from overlapping, where the shift was fitted to them."""
        if self.shift is None or not self.joined:
            return
        sign = 1.0 if self.measured.kind == "frequency" else -1.0
        logs = [sign * self.shift.log_factor(t) for t in self.measured.temperatures]
        ends = [
            (math.log10(each.at.min()) + log, math.log10(each.at.max()) + log)
            for each, log in zip(self.measured.sets, logs, strict=True)
        ]
        for (one, mine), (other, its) in pairwise(zip(self.measured.temperatures, ends, strict=True)):
            gap = max(mine[0], its[0]) - min(mine[1], its[1])
            if gap > WIDE_GAP:
                yield (
                    f"the sweeps at {one:g} and {other:g} C do not overlap: after the shift a gap of {gap:.2g} decades "
                    "is left, in which moduli are a guess; measure at a temperature in between, or give the shift: "
                    "--shift FILE"
                )

    def text(self) -> str:
        """The material file: what it is and how good, then the material."""
        series, shift, section = self.series, self.shift, self.material()
        to = f", shifted to {shift.reference:g} C" if shift is not None else ""
        kind = "Young's moduli, divided by 2 (1 + poisson)," if self.measured.tension else "shear moduli"
        temperatures = self.measured.temperatures
        noise = (
            ""
            if math.isnan(series.scatter)
            else f"; neighbouring points of a sweep scatter by {per_cent(series.scatter)}"
        )
        lines = [
            f"{TITLE} {self.measured.path.name}: {kind} over {self.measured.kind}.",
            f"# {len(series.moduli)} branches. The fit misses the {self._weighed} by {per_cent(series.error)} (rms), "
            f"the best one of any number of branches by {per_cent(series.best)}{noise}.",
            f"# Measured frequencies{to}: {section['band'][0]:.3g} to {section['band'][1]:.3g} Hz.",
            *([f"# Measured at {', '.join(f'{t:.4g}' for t in temperatures)} C."] if temperatures else []),
            "# Moduli are shear moduli [Pa], times are in s"
            + (
                f" at {shift.reference:g} C, where a job is that has no `temperature: T`." if shift is not None else "."
            ),
        ]
        branches = section.pop("branches")
        lines += [f"{key}: {_flow(value)}" for key, value in section.items()]
        lines += ["branches:", *(f"  - {_flow(branch)}" for branch in branches)]
        return "\n".join(lines) + "\n"


def fitted(
    path: Path, poisson: float, reference: float | None, law: str | Shift, error: float, weigh: "Weigh" = "both"
) -> Compound:
    """Read a table and fit it. `law` is wlf, arrhenius or free (constants are fitted too), or a shift that is known;
    `reference` [deg C] defaults to the middle one of the measured temperatures. Raises InputError, also for a table
    that no fit meets."""
    from . import series, tables  # scipy is for fits only

    measured = tables.read(path, poisson)
    temperatures = measured.temperatures
    shift: Shift | None = None
    if not isinstance(law, str):
        shift = law
    elif len(temperatures) > 1:
        middle = temperatures[len(temperatures) // 2]
        shift = series.find_shift(measured, middle if reference is None else reference, law, weigh)
    logs = [shift.log_factor(t) for t in temperatures] if shift is not None and temperatures else None
    joined = isinstance(law, str) and shift is not None
    best = series.fit(measured.sets, measured.kind, error, logs, weigh)
    found = Compound(measured, best, shift, poisson, weigh, joined)
    missed = found.series.error
    exchanged = missed if missed <= POOR or measured.kind == "time" else series.swapped(measured.sets, logs)
    if exchanged < SWAPPED * missed:
        raise InputError(
            f"{path}: storage and loss moduli seem to be exchanged: the fit misses them by {per_cent(missed)}, and by "
            f"{per_cent(exchanged)} if each is taken for the other"
        )
    if missed > HOPELESS:
        raise InputError(
            f"{path}: the best fit misses the moduli by {per_cent(missed)} (rms), more than {per_cent(HOPELESS)}: they "
            "are not those of one linear viscoelastic body, or the sweeps do not shift onto one another; check units "
            "and temperatures"
        )
    return found


def _shift_section(shift: Any) -> dict[str, Any]:
    numbers = {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(shift).items()}
    return {"law": LAWS[type(shift)], **_rounded(numbers)}


def _rounded(value: Any) -> Any:
    """Return a number, or all in a list or mapping, in the digits of a material file."""
    if isinstance(value, dict):
        return {key: _rounded(inner) for key, inner in value.items()}
    return [_rounded(inner) for inner in value] if isinstance(value, list) else float(f"{value:.{DIGITS}g}")


def _flow(value: Any) -> str:
    """A value in one line of YAML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_flow(inner) for inner in value) + "]"
    return repr(value) if isinstance(value, float) else str(value)
