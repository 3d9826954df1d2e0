"""pyfftw without its copies of scipy's interfaces, until somebody asks for them; and what FFTW has learnt.

For the interfaces it imports half of scipy. That takes a fifth of a second, of which every short run had a share.
"""

import importlib
import sys
from types import ModuleType

INTERFACES = "pyfftw.interfaces"
SEPARATOR = b"\x1e"  # of the wisdom of each precision, which is text


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

__all__ = ["export_wisdom", "import_wisdom", "pyfftw"]


def export_wisdom() -> bytes:
    """Which transforms FFTW found the fastest in this process; another may choose others, whose last bits differ."""
    return SEPARATOR.join(pyfftw.export_wisdom())


def import_wisdom(wisdom: bytes) -> bool:
    """From now on make the transforms of the process that exported this; False if that cannot be (another FFTW)."""
    pyfftw.forget_wisdom()
    precisions = tuple(wisdom.split(SEPARATOR))
    return len(precisions) == 3 and all(pyfftw.import_wisdom(precisions))
