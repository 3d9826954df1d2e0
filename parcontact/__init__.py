"""Transient contact of a rough rigid surface on a viscoelastic half space, on any number of MPI ranks.

    import parcontact as pc

    run = pc.Simulation("job.yaml", set={"grid.points": 256})     # or a mapping like a job file
    for row in run.steps():
        print(row.time, row.friction, row.contact_area)

Public names are imported when they are first used."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .errors import InputError, JobError, ParcontactWarning, RunError

if TYPE_CHECKING:
    from .door.python import Curve, Material, material, open, steady, surface
    from .door.simulation import Row, Simulation
    from .effects.leakage.flow import Flow, Leak, leak

__version__ = "0.2.0"
__all__ = ["Curve", "Flow", "InputError", "JobError", "Leak", "Material", "ParcontactWarning", "Row", "RunError"]
__all__ += ["Simulation", "leak", "material", "open", "steady", "surface"]

_ROOMS = {
    "Simulation": "door.simulation",
    "Row": "door.simulation",
    "steady": "door.python",
    "Curve": "door.python",
    "open": "door.python",
    "surface": "door.python",
    "material": "door.python",
    "Material": "door.python",
    "leak": "effects.leakage.flow",
    "Leak": "effects.leakage.flow",
    "Flow": "effects.leakage.flow",
}

if not TYPE_CHECKING:  # type checkers would accept misspelt names

    def __getattr__(name: str) -> Any:
        if name not in _ROOMS:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        found = getattr(import_module(f"{__name__}.{_ROOMS[name]}"), name)
        globals()[name] = found
        return found


def __dir__() -> list[str]:
    return sorted({*__all__, "__version__"})
