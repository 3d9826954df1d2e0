"""From a job to what is calculated with: the choices that follow from it, the rigid surface, the body, the solver."""

from .scene import Scene, Setup, build, effects, facts, set_up, solver_in_double, solver_on

__all__ = ["Scene", "Setup", "build", "effects", "facts", "set_up", "solver_in_double", "solver_on"]
