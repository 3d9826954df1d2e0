"""pyfftw without its interfaces to scipy, which are imported on demand, and FFTW's wisdom (choices of algorithms).

These interfaces import half of scipy, which takes a fifth of a second.
"""

import importlib
import sys
from types import ModuleType

INTERFACES = "pyfftw.interfaces"
SEPARATOR = b"\x1e"  # separates the wisdom of each precision


def _interfaces(name: str) -> ModuleType:
    """Import the interfaces on demand."""
    if name == "interfaces":
        return importlib.import_module(INTERFACES)
    raise AttributeError(f"module 'pyfftw' has no attribute {name!r}")


if "pyfftw" in sys.modules:
    import pyfftw
else:
    sys.modules[INTERFACES] = ModuleType(INTERFACES)  # a placeholder while pyfftw is imported
    try:
        import pyfftw
    finally:
        del sys.modules[INTERFACES]
    vars(pyfftw).pop("interfaces", None)
    vars(pyfftw)["__getattr__"] = _interfaces

__all__ = ["export_wisdom", "import_wisdom", "pyfftw"]


def export_wisdom() -> bytes:
    """Return the algorithms that FFTW has chosen in this process; other algorithms would round differently."""
    return SEPARATOR.join(pyfftw.export_wisdom())


def import_wisdom(wisdom: bytes) -> bool:
    """Use the algorithms of the process that exported this wisdom. Return False if FFTW does not accept it."""
    pyfftw.forget_wisdom()
    precisions = tuple(wisdom.split(SEPARATOR))
    return len(precisions) == 3 and all(pyfftw.import_wisdom(precisions))
