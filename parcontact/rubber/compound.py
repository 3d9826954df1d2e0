"""A compound from a table of measured moduli: fitted, and written as a material file that jobs can include."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..printed import per_cent
from .shift import WLF, Arrhenius, Density, Factors, Shift, doubt_kelvin, log_vertical

if TYPE_CHECKING:
    from .series import Superposition, Vertical, Weigh

TITLE = "# Fitted by parcontact fit to"  # first words of material files of fits
POOR, HOPELESS = 0.2, 1.0  # accuracy: rms errors of fits above which there is a warning, or an error
CONTRADICTS, LEAST_DOUBT = 2.0, 0.02  # accuracy: misfit over scatter, and misfit, above which there is a warning
SWAPPED = 0.5  # accuracy: misfit of exchanged moduli over the misfit, below which they were exchanged
WIDE_GAP = 1.0  # accuracy: largest gap between shifted sweeps that determine the shift [decades]
DIGITS = 7  # accuracy: digits of numbers in a material file
LEAST_SHOWN = 1e-5  # accuracy: least misfit that is printed
LIQUID = 1e-4  # accuracy: long-term over lowest storage modulus, below which the body is a liquid
UNKNOWN = 1.0  # accuracy: relative error above which a modulus is unknown
VAGUE = 0.1  # accuracy: error of the loss modulus inside the band above which there is a warning
LAWS = {WLF: "wlf", Arrhenius: "arrhenius", Factors: "factors", Density: "density"}


@dataclass(frozen=True)
class Compound:
    """A fitted compound: the measurement `measured`, the Prony series `series` at the reference temperature, and the
    `shift` with temperature, None for a table of one temperature.

    `poisson` is the Poisson ratio, by which Young's moduli become shear moduli. `weigh` names the fitted moduli:
    storage, loss or both. `found` is the shift that was fitted to sweeps at several temperatures, None if the shift was
    given or there is none.
    """

    measured: Any
    series: Any
    shift: Shift | None
    poisson: float
    weigh: "Weigh" = "both"
    found: "Superposition | None" = None

    def material(self) -> dict[str, Any]:
        """Return the fitted material as the section `material` of a job, in plain data."""
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
        if self.measured.kind == "creep":
            return "compliances"
        return "moduli" if self.weigh == "both" else f"{self.weigh} modulus"

    def doubts(self) -> list[str]:
        """Return warnings about a misfit larger than the scatter, and about moduli that no rubber has."""
        from . import moduli

        series, found = self.series, list(self.measured.doubts)
        if self.measured.kind == "frequency" and series.band[1] < moduli.ONE_FREQUENCY * series.band[0]:
            found.append(
                f"all its points are at one frequency, {series.band[0] / (2 * math.pi):.3g} Hz, and say nothing about "
                "others: measure a sweep over frequencies"
            )
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
        found += [*self._describe_loss(), *self._describe_free(), *self._gaps(), *moduli.odd_moduli(self.measured.sets)]
        given = () if self.found else (getattr(self.shift, "reference", None), *getattr(self.shift, "temperatures", ()))
        of_table = doubt_kelvin("temperatures of the table", self.measured.temperatures)
        return [*found, *map(str, of_table), *map(str, doubt_kelvin("temperatures of the shift", given))]

    def _describe_loss(self) -> Iterator[str]:
        """Yield warnings about a loss modulus that the table hardly determines, and about a body without a spring."""
        series = self.series
        counts = self.measured.kind == "frequency" and self.weigh != "storage"
        low, high = (frequency / (2 * math.pi) for frequency in series.band)
        if (inside := series.loss_errors[0]) > VAGUE and not counts:
            remedy = "measure it, or more points per decade"
            if self.measured.kind == "frequency":
                remedy = "leave out --weight storage"
            known = f"known to {per_cent(inside)} only" if inside < UNKNOWN else "hardly known"
            yield (
                f"the loss modulus that follows from the table is {known} between {low:.3g} and {high:.3g} Hz, and "
                f"friction goes with it: {remedy}"
            )
        if series.modulus_inf < LIQUID * series.storage_at(series.band[0]):
            yield (
                f"modulus_inf is {series.modulus_inf:.3g} Pa: the body flows like a liquid under loads that last "
                f"longer than {1.0 / series.band[0]:.2g} s; measure at lower frequencies or longer times"
            )

    def _describe_free(self) -> Iterator[str]:
        """Yield a warning if free factors b_T join the sweeps much better than the vertical law."""
        free = self.found.free if self.found else None
        also = "" if isinstance(self.shift, Factors) else " and --shift free"
        if self.found and free:
            yield (
                f"free vertical factors b_T would join the sweeps with a misfit of {per_cent(free.misfit)}, not "
                f"{per_cent(self.found.misfit)}, and the shift would be {free.shift}: moduli are not proportional to "
                f"density times temperature, or the law of the shift is wrong; compare --vertical free{also}"
            )

    def _gaps(self) -> Iterator[str]:
        """Yield warnings about neighbouring sweeps that do not overlap, if the shift was fitted to them."""
        if self.shift is None or not self.found:
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

    def _describe_shift(self) -> Iterator[str]:
        """Yield comments about both factors at the lowest and the highest measured temperature, or on the lack of a
        shift."""
        if self.shift is None:
            if self.measured.temperatures:
                yield "# No shift: it takes several temperatures, or given constants, as --shift wlf:C1,C2."
            return
        how = "fitted" if self.found else "given"
        yield f"# Horizontal shift, {how}: {self.shift}."
        degrees = self.measured.temperatures
        ends = [(t, self.shift.log_factor(t), log_vertical(self.shift, t)) for t in {*degrees[:1], *degrees[-1:]}]
        factors = ", ".join(f"a_T = {10.0**a:.3g} and b_T = {10.0**b:.3g} at {t:.4g} C" for t, a, b in sorted(ends))
        vertical = self.shift.vertical or "none, b_T = 1"
        yield f"# Vertical shift: {vertical}{'; ' if factors else ''}{factors}."

    def text(self) -> str:
        """Return the material file: comments on its origin and quality, and the material."""
        series, shift, section = self.series, self.shift, self.material()
        to = f", shifted to {shift.reference:g} C" if shift is not None else ""
        kind = "Young's moduli, divided by 2 (1 + poisson)," if self.measured.tension else "shear moduli"
        if self.measured.kind == "creep":
            kind = "tensile compliances, times 2 (1 + poisson)," if self.measured.tension else "shear compliances"
        over = "frequency" if self.measured.kind == "frequency" else "time"
        temperatures = self.measured.temperatures
        noise = f"; neighbouring points of a sweep scatter by {per_cent(series.scatter)}"
        noise = "" if math.isnan(series.scatter) else noise
        lines = [
            f"{TITLE} {self.measured.path.name}: {kind} over {over}.",
            f"# {len(series.moduli)} branches. The fit misses the {self._weighed} by {per_cent(series.error)} (rms), "
            f"the best one of any number of branches by {per_cent(max(series.best, LEAST_SHOWN))}{noise}.",
            f"# Measured frequencies{to}: {section['band'][0]:.3g} to {section['band'][1]:.3g} Hz.",
            f"# Estimated error of the loss modulus: {_percents(series.loss_errors)} at its upper end.",
            *([f"# Measured at {', '.join(f'{t:.4g}' for t in temperatures)} C."] if temperatures else []),
            *self._describe_shift(),
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
    path: Path,
    poisson: float,
    reference: float | None,
    law: str | Shift,
    error: float,
    weigh: "Weigh" = "both",
    vertical: "Vertical" = "auto",
) -> Compound:
    """Return the compound fitted to a table of measured moduli.

    `poisson` converts Young's moduli to shear moduli. `law` is the name of a shift law whose constants are fitted, wlf,
    arrhenius or free, or a shift with known constants. `vertical` is the law of the vertical factors b_T of moduli
    (`series.superpose`); it has no effect on a known shift with a vertical law of its own. `reference` [deg C] is the
    reference temperature, by default the middle one of all measured temperatures. `error` is the accepted relative
    error of both moduli, and `weigh` names the moduli that are fitted. Raises InputError for a table that cannot be
    read, and for moduli that no series fits.
    """
    from . import moduli, series
    from .series import log_factors, superpose

    measured = moduli.read_moduli(path, poisson)
    if isinstance(law, str):
        measured = measured.without_short_sets()
    temperatures = measured.temperatures
    shift: Shift | None = None if isinstance(law, str) else law
    found: Superposition | None = None
    try:
        short = any(each.at.size < moduli.LEAST_ROWS for each in measured.sets)
        if shift is not None and short and vertical in ("auto", "free"):
            vertical = "none"  # nothing overlaps, as in a temperature sweep
        if len(temperatures) > 1 and (shift is None or shift.vertical is None):
            middle = temperatures[len(temperatures) // 2] if reference is None else reference
            found = superpose(measured, middle if shift is None else shift.reference, law, vertical, weigh)
            shift = found.shift
        logs = log_factors(shift, temperatures) if shift is not None and temperatures else None
    except InputError as failure:
        raise failure if str(failure).startswith(str(path)) else InputError(f"{path}: {failure}") from failure
    data = series.reduce_sets(measured.sets, measured.kind, logs, weigh)
    sweeps = [(each.at, moduli) for each in measured.sets for moduli in (each.storage, each.loss) if moduli.size]
    best = series.fit_series(data, error, sweeps)
    _refuse_misfit(path, best, data)
    return Compound(measured, best, shift, poisson, weigh, found if isinstance(law, str) else None)


def _refuse_misfit(path: Path, best: Any, data: Any) -> None:
    """Raise InputError for moduli that no series fits."""
    missed = best.error
    exchanged = missed if missed <= POOR or data.kind != "frequency" else data.exchanged_misfit()
    if exchanged < min(SWAPPED * missed, POOR):
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


def _percents(errors: tuple[float, float, float]) -> str:
    inside, low, high = (per_cent(error) if error < UNKNOWN else "unknown" for error in errors)
    return (
        f"{inside} in the inner part of this band, half a decade from its ends (rms); {low} at its lower end and {high}"
    )


def _shift_section(shift: Any) -> dict[str, Any]:
    """Return a shift as a section of a job; its vertical law has the same reference."""
    numbers = {name: list(value) if isinstance(value, tuple) else value for name, value in vars(shift).items()}
    vertical = numbers.pop("vertical", None)
    section = {"law": LAWS[type(shift)], **_rounded(numbers)}
    if vertical is None:
        return section
    inner = _shift_section(vertical)
    del inner["reference"]
    return {**section, "vertical": inner}


def _rounded(value: Any) -> Any:
    """Return a number, or all numbers in a list or mapping, with the digits of a material file."""
    if isinstance(value, dict):
        return {key: _rounded(inner) for key, inner in value.items()}
    return [_rounded(inner) for inner in value] if isinstance(value, list) else float(f"{value:.{DIGITS}g}")


def _flow(value: Any) -> str:
    """Return a value in one line of YAML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_flow(inner) for inner in value) + "]"
    return repr(value) if isinstance(value, float) else str(value)
