"""Compiled loops: one decorator for those over rows, one for functions of points.

Sums may be reordered to use vector units; NaN and infinity keep their meaning, so that a solver sees them. Machine code
is kept in a private directory, so that only a first run waits for the compiler; where there is none, every run does.
"""

import fcntl
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from glob import escape
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

from . import private

Function = TypeVar("Function", bound=Callable[..., Any])
LOCK = ".lock"
OPTIONS: dict[str, Any] = {"fastmath": {"reassoc", "contract", "nsz"}, "error_model": "numpy"}


def loop(function: Function) -> Function:
    """Compile a loop over this rank's rows."""
    return cast(Function, _compiled(lambda kept: numba.njit(cache=kept, **OPTIONS)(function)))


def pointwise(function: Function) -> Function:
    """Compile a function of numbers for all points of arrays."""
    return cast(Function, _compiled(lambda kept: numba.vectorize(cache=kept)(function)))


def cache_path(compiled: Any) -> Path | None:
    """The directory in which machine code of a compiled function is kept, if any."""
    kept = getattr(*_store_of(compiled), None)
    return Path(kept.cache_path) if kept and kept.cache_path else None


class _OneAtATime:
    """numba's store of the machine code of a function, which nobody reads while another process writes to it.

    numba writes its index of files before the files: a process that reads in between is given what was in them before,
    the code of an older source or of other types.
    """

    def __init__(self, store: Any, lock: Path) -> None:
        self._store, self._lock = store, lock

    def __getattr__(self, name: str) -> Any:
        return getattr(self._store, name)

    def load_overload(self, *given: Any) -> Any:
        with _locked(self._lock, fcntl.LOCK_SH):
            return self._store.load_overload(*given)

    def save_overload(self, *given: Any) -> None:
        with _locked(self._lock, fcntl.LOCK_EX):
            self._remove_code_of_older_source()
            self._store.save_overload(*given)

    def _remove_code_of_older_source(self) -> None:
        """Were this process killed now, the next one would take it for the code of the new one."""
        with suppress(AttributeError, OSError):  # another numba, or no room
            files = self._store._cache_file
            if not files._load_index():
                for path in Path(self.cache_path).glob(f"{escape(files._index_name.removesuffix('.nbi'))}.*.nbc"):
                    path.unlink()


@contextmanager
def _locked(path: Path, kind: int) -> Iterator[None]:
    """Lock a file meanwhile, where the file system knows locks and has room for it."""
    with ExitStack() as stack:
        with suppress(OSError):
            fcntl.flock(stack.enter_context(path.open("a")), kind)
        yield


def _store_of(compiled: Any) -> tuple[Any, str]:
    """The owner of numba's store of a compiled function, and its attribute; there is none if compiling is off."""
    dispatcher = getattr(compiled, "_dispatcher", compiled)  # of a function of points, or of a loop
    return dispatcher, "_cache" if hasattr(dispatcher, "_cache") else "cache"


def _compiled(compiler: Callable[[bool], Any]) -> Any:
    """Make a function by `compiler(kept)`, with its machine code kept if there is a private place for it."""
    place = private.directory("compiled")
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
    if not path or not path.is_relative_to(place):
        return compiler(False)  # numba has other places, for all
    holder, name = _store_of(compiled)
    setattr(holder, name, _OneAtATime(getattr(holder, name), place / LOCK))
    return compiled


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
