"""What a call of the program consists of, for scripts/bench.py: seconds by part, bytes by loop, flops of transforms.

While a `Meter` is in place, FFTW's plans, compiled loops and exchanges between ranks tell it of each call. Bytes are
those of every array that a loop reads, and those of every array that it writes, once each however often it does: the
least that passes through memory when maps are larger than caches. Which arrays it reads and writes is seen in its
source. Copies and fills by numpy are not counted.
"""

import ast
import inspect
import sys
import textwrap
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

import numpy as np

from parcontact.parallel import pyramid, transpose
from parcontact.parallel.fftw import pyfftw
from parcontact.parallel.slab import Slab

TRANSFORM, EXCHANGE, OTHER = "transform", "exchange", "everything else"
EXCHANGES = [(transpose.Leg, name) for name in ("post", "to_columns", "to_rows", "collect")]
EXCHANGES += [(Slab, "reduce"), (pyramid, "fetch"), (pyramid.RowsBeside, "fetch")]
Reads = dict[str, int]  # how many times the bytes of each parameter pass: read, written, or both


class Meter:
    """Sums since the last `clear`."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self.bytes: dict[str, float] = defaultdict(float)
        self.flops = 0.0

    def parts(self, whole: float) -> dict[str, float]:
        """Seconds of each part of a call that took the `whole`."""
        seen = {name: self.seconds[name] for name in (TRANSFORM, EXCHANGE)}
        return {**seen, OTHER: whole - sum(seen.values())}

    @contextmanager
    def in_place(self) -> Iterator["Meter"]:
        """Of all plans that are made inside, and all loops and exchanges."""
        with ExitStack() as stack:
            stack.enter_context(patch.object(pyfftw, "FFTW", _metered_plans(self)))
            for owner, name in EXCHANGES:
                stack.enter_context(patch.object(owner, name, self._timed(EXCHANGE, getattr(owner, name))))
            for module, name, function in _loops():
                stack.enter_context(patch.object(module, name, self._counted(function)))
            yield self

    def _timed(self, part: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def wrapper(*given: Any) -> Any:
            began = time.perf_counter()
            try:
                return function(*given)
            finally:
                self.seconds[part] += time.perf_counter() - began

        return wrapper

    def _counted(self, function: Any) -> Callable[..., Any]:
        name = function.py_func.__name__.strip("_")
        passes = passes_of(function.py_func)

        def wrapper(*given: Any) -> Any:
            named = dict(zip(passes, given, strict=True))
            passed = sum(passes[key] * value.nbytes for key, value in named.items() if isinstance(value, np.ndarray))
            self.bytes[name] += passed / named.get("stride", 1)
            return function(*given)

        return wrapper


def _metered_plans(meter: Meter) -> type:
    original = pyfftw.FFTW

    class Metered:
        """A plan of FFTW that tells of its executions."""

        def __init__(self, source: Any, target: Any, axes: tuple[int], *rest: Any) -> None:
            self._plan = original(source, target, axes, *rest)
            self._execute = meter._timed(TRANSFORM, self._plan.execute)
            self._bytes = source.nbytes + target.nbytes
            self._flops = flops(source if np.isrealobj(source) else target, axes[0])

        def execute(self) -> None:
            meter.bytes[TRANSFORM] += self._bytes
            meter.flops += self._flops
            self._execute()

        def __getattr__(self, name: str) -> Any:
            return getattr(self._plan, name)

    return Metered


def flops(field: Any, axis: int) -> float:
    """Of a transform along one axis, as FFTW's authors count them: 5 n log2 n of n complex numbers, half for real."""
    return (2.5 if np.isrealobj(field) else 5.0) * field.size * float(np.log2(field.shape[axis]))


# -- loops -------------------------------------------------------------------------------------------------------------


def _loops() -> Iterator[tuple[Any, str, Any]]:
    """Compiled loops of the program that Python calls, with their module and name."""
    for module in [module for name, module in sys.modules.items() if name.startswith("parcontact.")]:
        found = {name: value for name, value in vars(module).items() if hasattr(value, "py_func")}
        inner = {word for value in found.values() for word in value.py_func.__code__.co_names}
        yield from ((module, name, value) for name, value in found.items() if name not in inner)


def passes_of(function: Callable[..., Any]) -> Reads:
    """How often a loop passes over each parameter: 1 where it reads or writes, 2 where it does both."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    names = list(inspect.signature(function).parameters)
    views = _views(tree, {name: {name} for name in names})
    seen: set[tuple[str, str]] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node not in views.definitions:
            ways = ["write"] if isinstance(node.ctx, ast.Store) else ["read"]
            seen |= {(name, way) for name in views.of.get(node.value.id, ()) for way in ways}
        if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Subscript):
            base = node.target.value
            seen |= {(name, "read") for name in views.of.get(getattr(base, "id", ""), ())}
    return {name: sum((name, way) in seen for way in ("read", "write")) for name in names}


class _Views:
    """Names that stand for rows of parameters, and the expressions that make them, which read nothing."""

    def __init__(self, of: dict[str, set[str]]) -> None:
        self.of, self.definitions = of, set[ast.AST]()


def _views(tree: ast.AST, of: dict[str, set[str]]) -> _Views:
    views = _Views(of)
    used = {node.value.id for node in ast.walk(tree) if isinstance(node, ast.Subscript) and _is_name(node.value)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign):
            for target, value in _pairs(node.targets[0], node.value):
                if _is_name(target) and target.id in used and (sources := _sources(value, views)):
                    of.setdefault(target.id, set()).update(sources)
    return views


def _pairs(target: Any, value: Any) -> list[tuple[Any, Any]]:
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        return list(zip(target.elts, value.elts, strict=True))
    return [(target, value)]


def _sources(value: Any, views: _Views) -> set[str]:
    """Parameters whose rows an expression is: `map[j]`, `row if above else map[j]`, `_row(map, beside, j)`."""
    if isinstance(value, ast.IfExp):
        return _sources(value.body, views) | _sources(value.orelse, views)
    if isinstance(value, ast.Subscript) and _is_name(value.value):
        views.definitions.add(value)
        return views.of.get(value.value.id, set())
    if isinstance(value, ast.Call) and _is_name(value.func):
        return set[str]().union(*(views.of.get(part.id, set()) for part in value.args if isinstance(part, ast.Name)))
    return views.of.get(value.id, set()) if isinstance(value, ast.Name) else set()


def _is_name(node: Any) -> bool:
    return isinstance(node, ast.Name)
