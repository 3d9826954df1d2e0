"""Transient contact of a rough rigid surface on a viscoelastic half space, on any number of MPI ranks.

    import parcontact as pc

    run = pc.Simulation("job.yaml", set={"grid.points": 256})     # or a mapping like a job file
    for row in run.steps():
        print(row.time, row.friction, row.contact_area)

Public names are imported when they are first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .doubts import ParcontactWarning
from .errors import InputError, JobError, RunError

if TYPE_CHECKING:
    from .effects.leakage.flow import Flow, Leak, leak
    from .python.curves import Curve, steady
    from .python.opened import open
    from .python.row import Row
    from .python.simulation import Simulation
    from .python.surface_and_material import Material, material, surface

__version__ = "0.2.0"
__all__ = ["Curve", "Flow", "InputError", "JobError", "Leak", "Material", "ParcontactWarning", "Row", "RunError"]
__all__ += ["Simulation", "leak", "material", "open", "steady", "surface"]

_ROOMS = {
    "Simulation": "python.simulation",
    "Row": "python.row",
    "steady": "python.curves",
    "Curve": "python.curves",
    "open": "python.opened",
    "surface": "python.surface_and_material",
    "material": "python.surface_and_material",
    "Material": "python.surface_and_material",
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
