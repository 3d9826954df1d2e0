"""Compiled loops: one decorator for those over rows, one for functions of points.

Sums may be reordered to use vector units; NaN and infinity keep their meaning, so that a solver sees them. Machine code
is kept in a private directory, so that only a first run waits for the compiler; where there is none, every run does.
"""

from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

from . import private

Function = TypeVar("Function", bound=Callable[..., Any])
OPTIONS: dict[str, Any] = {"fastmath": {"reassoc", "contract", "nsz"}, "error_model": "numpy"}


def loop(function: Function) -> Function:
    """Compile a loop over this rank's rows."""
    return cast(Function, _compiled(lambda kept: numba.njit(cache=kept, **OPTIONS)(function)))


def pointwise(function: Function) -> Function:
    """Compile a function of numbers for all points of arrays."""
    return cast(Function, _compiled(lambda kept: numba.vectorize(cache=kept)(function)))


def cache_path(compiled: Any) -> Path | None:
    """The directory in which machine code of a compiled function is kept, if any."""
    dispatcher = getattr(compiled, "_dispatcher", compiled)  # of a function of points, or of a loop
    kept = getattr(dispatcher, "_cache", None) or getattr(dispatcher, "cache", None)  # none if compiling is off
    return Path(kept.cache_path) if kept and kept.cache_path else None


def _compiled(compiler: Callable[[bool], Any]) -> Any:
    """What `compiler(kept)` makes, with its machine code kept if there is a private place for it."""
    place = _place()
    if place is None:
        return compiler(False)
    config: Any = numba.config
    others, config.CACHE_DIR = config.CACHE_DIR, str(place)  # where numba looks first while it decorates
    try:
        compiled = compiler(True)
    except RuntimeError:
        return compiler(False)
    finally:
        config.CACHE_DIR = others
    path = cache_path(compiled)
    return compiled if path and path.is_relative_to(place) else compiler(False)  # numba has other places, for all


@cache
def _place() -> Path | None:
    return private.directory("compiled")


def _import_numba_arrays() -> None:
    """Import what numba has for loops over arrays, without scipy.linalg.

    numba imports that only to see whether there is a BLAS, which takes a fifth of a second of every short run. There is
    one if scipy is there, and a loop that multiplies matrices imports it still.
    """
    with suppress(ImportError, AttributeError):  # another numba, which asks otherwise
        algebra: Any = import_module("numba.np.linalg")
        asks, algebra.ensure_blas = algebra.ensure_blas, _find_scipy
        try:
            arrays: Any = import_module("numba.np.arraymath")
            arrays.ensure_blas = asks
        finally:
            algebra.ensure_blas = asks


def _find_scipy() -> None:
    if find_spec("scipy") is None:
        raise ImportError("there is no scipy")


_import_numba_arrays()
