"""Rules that a job as a whole must keep, and warnings about what will probably disappoint."""

from typing import Any, Protocol

from ..sections.calculation import Body, Grid, Numerics, Output
from ..sections.materials import AnyMaterial
from ..sections.stages import Initial, Stage, Steady


class Sections(Protocol):
    """Sections of a job that warnings are about."""

    grid: Grid
    surface: tuple[Any, ...]
    material: AnyMaterial
    initial: Initial
    history: tuple[Stage, ...]
    numerics: Numerics
    output: Output
    steady: Steady | None
    body: Body | None
