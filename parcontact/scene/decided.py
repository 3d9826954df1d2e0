"""Decisions that follow from a job: methods of `choices.Choices` that give a verdict, each asked once."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

from ..effects.effect import Decision

Verdict = tuple[bool, str]  # whether an effect is on, and why


class Decided(cached_property[Decision]):
    """A decision, made when it is first asked for; `parcontact plan` prints all of them in the order of their code."""


def decided(name: str) -> Callable[[Callable[[Any], Verdict]], Decided]:
    """Make a decision with a name out of a method that gives a verdict."""
    return lambda method: Decided(lambda choices: Decision(name, *method(choices)))
