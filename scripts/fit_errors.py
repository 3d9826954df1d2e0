#!/usr/bin/env python3
"""Stated and true errors of the loss modulus in fits to random rubbers with noise.

    .venv/bin/python scripts/fit_errors.py [--rubbers 100] [--seed 0] [--from 0] [--only NUMBER]

Rubbers have a smooth spectrum of one to three bells over 16 decades of times, and a spring. Tables are frequency sweeps
or relaxations of 3 to 8 decades, with noise of 0.1 to 3 %. The table has the median true error of the loss modulus by
the fit (rms inside the band, and at its ends), the stated error over it with the range of 90 % of the fits, and the
share of fits in which it is at least the true one. ROUGH and BEYOND of `rubber.series` are judged by it: ROUGH by the
errors inside, BEYOND by those at the ends.
"""

import sys
from collections import Counter, defaultdict
from collections.abc import Iterator

import campaign
import numpy as np
from numpy.typing import NDArray

from parcontact.rubber.series import PER_DECADE, ReducedData, complex_kernel, fit_series, kernel

TIMES = np.geomspace(1e-10, 1e6, 16 * 20 + 1)  # [s]
PLACES = "inside", "lower end", "upper end"
Table = dict[tuple[str, str], list[tuple[float, float]]]  # stated and true errors, by kind of data and place


def rubber(dice: np.random.Generator) -> NDArray[np.float64]:
    """Return the moduli [Pa] of TIMES, followed by the spring."""
    decades, moduli = np.log10(TIMES), np.zeros(TIMES.size)
    for _ in range(dice.integers(1, 4)):
        centre, width = dice.uniform(-8.0, 2.0), dice.uniform(1.0, 4.0)
        moduli += 10.0 ** dice.uniform(-1.0, 1.0) * np.exp(-0.5 * ((decades - centre) / width) ** 2)
    return 1e6 * np.append(moduli / moduli.sum() * 10.0 ** dice.uniform(0.5, 3.0), 1.0)


def trial(seed: int, found: Table, number: int) -> Iterator[str]:
    """Fit a table of a random rubber; add its errors to a table."""
    dice = np.random.default_rng([seed, number])
    weights, kind = rubber(dice), ("frequency", "time")[number % 2]
    decades, noise = dice.uniform(3.0, 8.0), 10.0 ** dice.uniform(-3.0, -1.5)
    at = 10.0 ** (dice.uniform(-4.0, 4.0) + np.linspace(-0.5, 0.5, round(PER_DECADE * decades)) * decades)
    moduli = kernel(at, kind, TIMES) @ weights  # type: ignore[arg-type]
    moduli *= 1.0 + noise * dice.standard_normal(moduli.size)
    series = fit_series(ReducedData(kind, at, moduli, slice(None)), 0.02)  # type: ignore[arg-type]
    low, high = series.band
    omega = np.geomspace(low, high, max(9, round(PER_DECADE * np.log10(high / low))))
    true = (complex_kernel(omega, "frequency", TIMES) @ weights).imag
    errors = np.abs(series.modulus(omega).imag / true - 1.0)
    inner = errors[(omega >= 10.0**0.5 * low) & (omega <= high / 10.0**0.5)]
    seen = float(np.sqrt(np.mean(inner**2))), float(errors[0]), float(errors[-1])
    for place, stated, own in zip(PLACES, series.loss_errors, seen, strict=True):
        found[kind, place].append((stated, own))
    yield from ()


def main() -> int:
    asked, found = campaign.parser(__doc__, trials=100, what="rubbers").parse_args(), defaultdict(list)
    faulty = campaign.go(asked, lambda number: trial(asked.seed, found, number), Counter())
    print(f"{'':20} {'fits':>4} {'error':>8} {'stated over true':>24} {'at least':>9}")
    for (kind, place), pairs in found.items():
        stated, true = np.array(pairs).T
        low, middle, high = np.quantile(stated / true, (0.05, 0.5, 0.95))
        ratio, share = f"{middle:.3g}, {low:.2g} to {high:.3g}", np.mean(stated >= true)
        print(f"{kind:10} {place:9} {len(true):4} {np.median(true):8.2g} {ratio:>24} {share:9.2f}")
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())
