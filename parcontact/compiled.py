"""Compiled loops: one decorator for all of them.

Sums may be reordered to use vector units; NaN and infinity keep their meaning, so that a solver sees them.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def loop(function: Function) -> Function:
    """Compile a loop over this rank's rows; kept on disk, so that only a first run waits."""
    compile_ = numba.njit(cache=True, fastmath={"reassoc", "contract", "nsz"}, error_model="numpy")
    return cast(Function, compile_(function))
