"""Checks that a table can be of a measured rubber; wrong units are refused before a fit."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Array = NDArray[np.float64]
MOST_DECADES = 40.0  # tuning: largest range of frequencies or times of a table
COLDEST = -150.0  # physics [deg C]: lowest temperature of a measurement
SOFTEST, HARDEST = 3e3, 1e13  # physics [Pa]: limits on the largest modulus of a table: a soft gel, ten times diamond
GLASS, SOFT = 4e9, 1e5  # physics [Pa]: largest glassy modulus of rubbers, and least modulus at a glass transition
RISE = 0.1  # accuracy: relative rise of a relaxation modulus that scatter may cause


def refuse_odd(path: Path, kind: str, at: Array, storage: Array, temperatures: Array | None) -> None:
    """Raise InputError for rates or times `at` [rad/s or s], moduli `storage` [Pa] and temperatures [deg C], each of
    shape (n,), that no measurement has."""
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
    """Yield warnings about shear moduli [Pa] of `sets` that no rubber has."""
    largest = max(float(each.storage.max()) for each in sets)
    if largest > GLASS:
        yield f"its largest shear modulus is {largest:.3g} Pa, more than rubber has as a glass: is the unit right?"
    if largest < SOFT:
        yield f"its largest shear modulus is {largest:.3g} Pa, softer than any rubber: is the unit right?"


def refuse_rising(path: Path, kind: str, sets: Sequence[Array]) -> None:
    """Raise InputError if relaxation moduli, or inverse compliances, of a set rise with time."""
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
    """Return the rms scatter of the logarithms of moduli: the deviation of a point from the curve through its two
    neighbours on either side.

    `sweeps` are rates and moduli, each of shape (n,), by rising rates; nan if all have less than five points. The
    interpolation is cubic in the logarithms, so that smooth curves have no scatter. For independent errors the
    deviation is divided by the root of 1 + the squares of its weights.
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
