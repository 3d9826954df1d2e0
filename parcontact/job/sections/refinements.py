"""The `study` section: ladders of settings whose errors and costs are compared."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from ..text.fault import Fault
from .part import Part, Rule
from .values import Count, Fraction, Positive, listed

NAMES = ("mesh", "cells_per_step", "integrator", "tolerance", "precision", "kernel")


def _different(name: str) -> Rule:
    def check(values: tuple[Any, ...]) -> Iterator[Fault]:
        for index, value in enumerate(values):
            if value is not None and value in values[:index]:
                yield Fault(f"names {value!r} a second time", (name, index))

    return Rule((name,), check)


def _something(**ladders: tuple[Any, ...]) -> Iterator[Fault]:
    if not any(ladders.values()):
        yield Fault(f"needs at least one ladder: {', '.join(ladders)}")


class Study(Part):
    """What `parcontact study` refines; a ladder that is left out has the job's own value."""

    mesh: Annotated[tuple[Count, ...], BeforeValidator(listed)] = Field(
        default=(), description="a list of positive whole numbers of points along x"
    )
    cells_per_step: Annotated[tuple[Positive, ...], BeforeValidator(listed)] = Field(
        default=(), description="a list of positive numbers of cells (fractions are allowed)"
    )
    integrator: Annotated[tuple[Literal["exponential", "backward-euler"], ...], BeforeValidator(listed)] = Field(
        default=(), description="a list of integrators"
    )
    tolerance: Annotated[tuple[Fraction, ...], BeforeValidator(listed)] = Field(
        default=(), description="a list of tolerances [-] above 0 and below 1"
    )
    precision: Annotated[tuple[Literal["double", "mixed"], ...], BeforeValidator(listed)] = Field(
        default=(), description="a list of precisions"
    )
    kernel: Annotated[tuple[Literal["spectral", "love"], ...], BeforeValidator(listed)] = Field(
        default=(), description="a list of kernels"
    )

    rules = (
        *map(_different, NAMES),
        Rule(
            NAMES,
            lambda *ladders: _something(**dict(zip(NAMES, ladders, strict=True))),
        ),
    )
