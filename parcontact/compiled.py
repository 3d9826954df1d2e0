"""Decorators that compile loops over rows and functions of points, by numba.

Sums may be reordered for SIMD instructions; NaN and infinity keep their meaning. Machine code is kept in a private
directory, so that only the first run waits for the compiler; without such a directory every run compiles.

Plans of transforms are kept in such a directory, too. Files in these directories are executed, or trusted without a
check, so that no other user may be able to write there. Therefore both have the mode 0700 and lie in the user's cache
directory, or are not made.
"""

import gc
import hashlib
import os
import stat
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from glob import escape
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import codegen, event

Function = TypeVar("Function", bound=Callable[..., Any])
OPTIONS: dict[str, Any] = {
    "fastmath": {"reassoc", "contract", "nsz"},
    "error_model": "numpy",
    "no_cfunc_wrapper": True,  # no C code calls our loops
}


def loop(function: Function) -> Function:
    """Compile a loop over this rank's rows."""
    return cast(Function, _compiled(lambda kept: numba.njit(cache=kept, **OPTIONS)(function)))


def pointwise(function: Function) -> Function:
    """Compile a function of numbers to a function of arrays, which acts on each point."""
    return cast(Function, _compiled(lambda kept: numba.vectorize(cache=kept)(function)))


def cache_path(compiled: Any) -> Path | None:
    """Return the directory in which the machine code of a compiled function is kept; None if it is not kept."""
    kept = _cache_of(compiled)
    return Path(kept.cache_path) if kept and kept.cache_path else None


def _save_data_first(files: Any, key: Any, data: Any) -> None:
    """Write machine code to a file named by a hash of source and types, then the index of numba's cache `files`.

    numba writes the index first and numbers its files, so another process may read code of an older source or of
    other types. Here two processes that write at the same time lose at most an entry of the index, and compile again.
    """
    base = files._index_name.removesuffix(".nbi")
    name = hashlib.sha256(repr((files._source_stamp, key)).encode()).hexdigest()[:16]
    files._save_data(f"{base}.{name}.nbc", data)
    kept = files._load_index() | {key: f"{base}.{name}.nbc"}
    files._save_index(kept)
    for path in Path(files._cache_path).glob(f"{escape(base)}.*.nbc"):
        if path.name not in kept.values():
            path.unlink(missing_ok=True)  # code of an older source


def _cache_of(compiled: Any) -> Any:
    """Return numba's cache of a compiled function; None if compiling is switched off."""
    dispatcher = getattr(compiled, "_dispatcher", compiled)  # compiled loops are dispatchers themselves
    return getattr(dispatcher, "_cache", None) or getattr(dispatcher, "cache", None)


def _compiled(compiler: Callable[[bool], Any]) -> Any:
    """Return the function made by `compiler(kept)`; `kept` is True if a private directory can hold its code."""
    place = directory("compiled")
    if place is None:
        return compiler(False)
    config: Any = numba.config
    others, config.CACHE_DIR = config.CACHE_DIR, str(place)  # numba reads it in `compiler`
    try:
        compiled = compiler(True)
    except RuntimeError:
        return compiler(False)
    finally:
        config.CACHE_DIR = others
    path = cache_path(compiled)
    if not path or not path.is_relative_to(place):
        return compiler(False)  # numba chose a directory that others may write to
    files = _cache_of(compiled)._cache_file
    files.save = partial(_save_data_first, files)
    return compiled


def _import_numba_arrays() -> None:
    """Import numba's functions of arrays without scipy.linalg.

    numba imports scipy.linalg only to check that a BLAS exists, which takes 0.2 s; an installed scipy is check enough.
    """
    with suppress(ImportError, AttributeError):  # a version of numba with another check
        algebra: Any = import_module("numba.np.linalg")
        asks, algebra.ensure_blas = algebra.ensure_blas, _find_scipy
        try:
            arrays: Any = import_module("numba.np.arraymath")
            arrays.ensure_blas = asks
        finally:
            algebra.ensure_blas = asks


def _find_scipy() -> None:
    if find_spec("scipy") is None:
        raise ImportError("scipy is not installed")


@cache
def say_that_it_compiles() -> None:
    """Print once that loops are being compiled, on root and only if a person watches: on a terminal or in a
    notebook."""
    mpi = sys.modules.get("mpi4py.MPI")
    watched = sys.stderr.isatty() or "ipykernel" in sys.modules
    if watched and (mpi is None or mpi.COMM_WORLD.rank == 0):
        kept = "once on this machine" if directory("compiled") else "in each run, as they cannot be kept"
        text = f"compiling loops, some ten seconds, {kept}; `parcontact doctor` compiles them beforehand"
        print(f"parcontact: {text}", file=sys.stderr, flush=True)


class _CompileListener(event.Listener):
    """Says that loops compile, and makes the compiler faster meanwhile.

    The compiler makes many objects and no cycles worth collecting: the garbage collector only costs time. It also
    optimizes each function before the module that contains it, which is then optimized as a whole again.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._restore: list[Callable[[], None]] = []

    def on_start(self, event: Any) -> None:
        say_that_it_compiles()
        self._depth += 1
        if self._depth == 1:
            self._restore = [_pause_collector(), _skip_first_pass()]

    def on_end(self, event: Any) -> None:
        self._depth -= 1
        if self._depth == 0:
            for restore in self._restore:
                restore()


def _pause_collector() -> Callable[[], None]:
    """Stop the garbage collector; return a function that starts it again if it ran."""
    enabled = gc.isenabled()
    gc.disable()
    return gc.enable if enabled else gc.disable


def _skip_first_pass() -> Callable[[], None]:
    """Skip numba's optimization of single functions; return a function that takes this back."""
    library: Any = codegen.CPUCodeLibrary
    usual = getattr(library, "_optimize_functions", None)
    if usual is None:  # a version of numba without this pass
        return lambda: None
    library._optimize_functions = _set_layout
    return lambda: setattr(library, "_optimize_functions", usual)


def _set_layout(library: Any, module: Any) -> None:
    module.data_layout = library._codegen._data_layout


event.register("numba:compile", _CompileListener())
_import_numba_arrays()


OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def directory(name: str) -> Path | None:
    """Return the program's directory `name` in the user's cache directory, created if missing; None if other users
    could write there."""
    with suppress(OSError, RuntimeError):
        home = Path.home()
        given = Path(os.environ.get("XDG_CACHE_HOME") or "")
        cache = given if given.is_absolute() else home / ".cache"
        if given.is_absolute() or home.is_dir():  # a home that does not exist is not made
            cache.mkdir(mode=0o700, parents=True, exist_ok=True)
            place = cache.resolve() / "parcontact" / name
            place.mkdir(mode=0o700, parents=True, exist_ok=True)
            return place if _private(place) else None
    return None


def _private(place: Path) -> bool:
    """Return True if the directory belongs to this user and no other user can write to it or replace it."""
    found = place.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid() or found.st_mode & OTHERS_WRITE:
        return False
    if not all(_keeps_its_entries(parent) for parent in place.parents) or not os.access(place, os.W_OK | os.X_OK):
        return False
    if stat.S_IMODE(found.st_mode) != 0o700:
        place.chmod(0o700)
    return True


def _keeps_its_entries(parent: Path) -> bool:
    """Return True if only root and this user can replace entries of a directory.

    A group may write to the directory if it is the user's private group, which has the same number as the user.
    """
    found, own = parent.stat(), os.geteuid()
    if found.st_uid not in (0, own):
        return False
    others = stat.S_IWOTH if found.st_uid == found.st_gid == own else OTHERS_WRITE
    return not found.st_mode & others or bool(found.st_mode & stat.S_ISVTX)
