"""Rules for a job as a whole, and warnings about settings that are allowed but probably not meant."""

from typing import Any, Protocol

from ..sections.calculation import Body, Grid, Numerics, Output
from ..sections.materials import AnyMaterial
from ..sections.stages import Initial, Stage, Steady


class Sections(Protocol):
    """The sections of a job that warnings need."""

    grid: Grid
    surface: tuple[Any, ...]
    material: AnyMaterial
    initial: Initial
    history: tuple[Stage, ...]
    numerics: Numerics
    output: Output
    steady: Steady | None
    body: Body | None

    @property
    def sheared_first(self) -> bool:
        """Return True if an effect shears the contact before it slides."""

    def asked(self, name: str) -> list[Any]:
        """Return what the effects whose sections are given have under a name."""
