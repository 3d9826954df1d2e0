"""The parts of a calculation on a job: its choices, the rigid surface, the body and the solver."""

from .choices import Choices, choices
from .scene import (
    Scene,
    Setup,
    build,
    build_on,
    describe_roughness,
    describe_scene,
    outline,
    set_up,
    solver_on,
    solver_on_tiles,
)

__all__ = [
    "Choices",
    "Scene",
    "Setup",
    "build",
    "build_on",
    "choices",
    "describe_roughness",
    "describe_scene",
    "outline",
    "set_up",
    "solver_on",
    "solver_on_tiles",
]
