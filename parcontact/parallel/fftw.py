"""pyfftw without its copies of scipy's interfaces, for which it imports half of scipy, until somebody asks for them.

That takes a fifth of a second, of which every short run would have a share.
"""

import importlib
import sys
from types import ModuleType

INTERFACES = "pyfftw.interfaces"


def _interfaces(name: str) -> ModuleType:
    """Import the interfaces, which `pyfftw` does not find."""
    if name == "interfaces":
        return importlib.import_module(INTERFACES)
    raise AttributeError(f"module 'pyfftw' has no attribute {name!r}")


if "pyfftw" in sys.modules:
    import pyfftw
else:
    sys.modules[INTERFACES] = ModuleType(INTERFACES)  # stands there while pyfftw is imported
    try:
        import pyfftw
    finally:
        del sys.modules[INTERFACES]
    vars(pyfftw).pop("interfaces", None)
    vars(pyfftw)["__getattr__"] = _interfaces

__all__ = ["pyfftw"]
