"""Decisions that follow from a job: methods of `choices.Choices` that return a verdict, each called once."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

from ..effects.effect import Decision

Verdict = tuple[bool, str]  # True if an effect is on, and the reason


class Decided(cached_property[Decision]):
    """A decision, made at its first use. `parcontact plan` prints all decisions in the order of their code."""


def decided(name: str) -> Callable[[Callable[[Any], Verdict]], Decided]:
    """Turn a method that returns a verdict into a decision with this name."""
    return lambda method: Decided(lambda choices: Decision(name, *method(choices)))
