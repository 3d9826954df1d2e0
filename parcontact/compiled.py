"""Compiled loops: one decorator for all of them.

Sums may be reordered to use vector units; NaN and infinity keep their meaning, so that a solver sees them.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def loop(function: Function) -> Function:
    """Compile a loop over this rank's rows; kept on disk where there is a place, so that only a first run waits."""
    compiler = partial(numba.njit, fastmath={"reassoc", "contract", "nsz"}, error_model="numpy")
    try:
        return cast(Function, compiler(cache=True)(function))
    except RuntimeError:  # numba may write neither beside the code nor into a home directory
        return cast(Function, compiler()(function))
