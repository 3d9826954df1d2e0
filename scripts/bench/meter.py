"""What a call of the program consists of: seconds by part, bytes by loop, flops of transforms.

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
        """Meter all plans that are made inside, and all loops and exchanges."""
        with ExitStack() as stack:
            stack.enter_context(patch.object(pyfftw, "FFTW", self._metered_plans()))
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

    def _metered_plans(self) -> type:
        meter, original = self, pyfftw.FFTW

        class Metered:
            """A plan of FFTW that tells of its executions; flops as FFTW's authors count them, half for real data."""

            def __init__(self, source: Any, target: Any, axes: tuple[int], *rest: Any) -> None:
                self._plan = original(source, target, axes, *rest)
                self._execute = meter._timed(TRANSFORM, self._plan.execute)
                self._bytes = source.nbytes + target.nbytes
                field = source if np.isrealobj(source) else target
                each = 2.5 if np.isrealobj(field) else 5.0
                self._flops = each * field.size * float(np.log2(field.shape[axes[0]]))

            def execute(self) -> None:
                meter.bytes[TRANSFORM] += self._bytes
                meter.flops += self._flops
                self._execute()

            def __getattr__(self, name: str) -> Any:
                return getattr(self._plan, name)

        return Metered


def _loops() -> Iterator[tuple[Any, str, Any]]:
    """Compiled loops of the program that Python calls, with their module and name."""
    for module in [module for name, module in sys.modules.items() if name.startswith("parcontact.")]:
        found = {name: value for name, value in vars(module).items() if hasattr(value, "py_func")}
        inner = {word for value in found.values() for word in value.py_func.__code__.co_names}
        yield from ((module, name, value) for name, value in found.items() if name not in inner)


def passes_of(function: Callable[..., Any]) -> dict[str, int]:
    """How often a loop passes over each parameter: 1 where it reads or writes, 2 where it does both."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    names = list(inspect.signature(function).parameters)
    views = _Views(tree, names)
    seen: set[tuple[str, str]] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node not in views.definitions:
            kind = "write" if isinstance(node.ctx, ast.Store) else "read"
            seen |= {(name, kind) for name in views.parameters.get(node.value.id, ())}
        if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Subscript):
            base = getattr(node.target.value, "id", "")
            seen |= {(name, "read") for name in views.parameters.get(base, ())}
    return {name: sum((name, kind) in seen for kind in ("read", "write")) for name in names}


class _Views:
    """Which parameters a local name is a row of, and the expressions that make such rows, which read nothing."""

    def __init__(self, tree: ast.AST, names: list[str]) -> None:
        self.parameters, self.definitions = {name: {name} for name in names}, set[ast.AST]()
        subscripts = [node.value for node in ast.walk(tree) if isinstance(node, ast.Subscript)]
        used = {value.id for value in subscripts if isinstance(value, ast.Name)}
        for node in ast.walk(tree):
            if not isinstance(node, ast.Assign):
                continue
            target, value = node.targets[0], node.value
            both = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
            for left, right in zip(target.elts, value.elts, strict=True) if both else [(target, value)]:
                if isinstance(left, ast.Name) and left.id in used and (sources := self._sources(right)):
                    self.parameters.setdefault(left.id, set()).update(sources)

    def _sources(self, value: Any) -> set[str]:
        """Parameters whose rows an expression is: `map[j]`, `row if above else map[j]`, `_row(map, beside, j)`."""
        if isinstance(value, ast.IfExp):
            return self._sources(value.body) | self._sources(value.orelse)
        if isinstance(value, ast.Subscript) and isinstance(value.value, ast.Name):
            self.definitions.add(value)
            return self.parameters.get(value.value.id, set())
        if isinstance(value, ast.Call) and isinstance(value.func, ast.Name):
            given = [part.id for part in value.args if isinstance(part, ast.Name)]
            return set[str]().union(*(self.parameters.get(name, set()) for name in given))
        return self.parameters.get(value.id, set()) if isinstance(value, ast.Name) else set()
