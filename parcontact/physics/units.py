"""Units of a run, in which all its numbers are dimensionless, for any scale of lengths.

All are powers of two: conversion is exact, and a checkpoint in SI units restarts bit for bit.
"""

import math
from dataclasses import dataclass


def _power_of_two(value: float) -> float:
    return 2.0 ** round(math.log2(value)) if value > 0.0 else 1.0


@dataclass(frozen=True)
class Units:
    """Unit of heights and displacements [m], of lengths in the plane [m], and of moduli [Pa]."""

    height: float
    length: float
    modulus: float

    @classmethod
    def near(cls, height: float, length: float, modulus: float) -> "Units":
        """Return the powers of two nearest to typical values; for a flat surface (height 0) the unit of heights is
        `length`."""
        return cls(_power_of_two(height or length), _power_of_two(length), _power_of_two(modulus))

    @property
    def pressure(self) -> float:
        """Unit of pressures [Pa], which moves the half space by `height` over `length`."""
        return self.modulus * self.height / self.length
