"""Text of the manual's page on Python, from the docstrings of functions and classes, to be read in a terminal.

The web site has it from Sphinx, by the same directives: `.. autoclass:: NAME`, `:members:`, `.. autofunction:: NAME`.
"""

from __future__ import annotations

import inspect
import pydoc
import re
from collections.abc import Iterator
from dataclasses import is_dataclass
from typing import Any

BLOCK = re.compile(r"^```\{eval-rst\}\n(.*?)^```$", re.MULTILINE | re.DOTALL)
DIRECTIVE = re.compile(r"^\.\. auto(?:class|function):: (\S+)\n(?:   :members:(.*)\n)?", re.MULTILINE)


def written(page: str) -> str:
    """A page with headings and docstrings for its blocks of directives."""
    return BLOCK.sub(lambda block: "\n\n".join(_entries(block.group(1))), page)


def _entries(block: str) -> Iterator[str]:
    for name, members in DIRECTIVE.findall(block):
        found: Any = pydoc.locate(name)
        yield f"## {name}{_parameters(found)}\n\n{inspect.getdoc(found)}"
        named = [member.strip() for member in members.split(",") if member.strip()]
        all_of = members == "" and f"{name}\n   :members:" in block
        for member in named or (_public(found) if all_of else ()):
            value = inspect.getattr_static(found, member)
            yield f"### {member}{_parameters(getattr(value, '__func__', value))}\n\n{inspect.getdoc(value)}"


def _public(kind: type) -> list[str]:
    return [name for name, value in vars(kind).items() if not name.startswith("_") and inspect.getdoc(value)]


def _parameters(found: Any) -> str:
    """Return parameters as in a call: `(job, set=None)`; '' of attributes, results and errors, which nobody calls."""
    if not callable(found) or is_dataclass(found) or _is(found, Exception):
        return ""
    signature = inspect.signature(found)
    plain = [
        parameter.replace(annotation=parameter.empty)
        for name, parameter in signature.parameters.items()
        if name not in ("self", "cls")
    ]
    return str(signature.replace(parameters=plain, return_annotation=signature.empty))


def _is(found: Any, kind: type) -> bool:
    return isinstance(found, type) and issubclass(found, kind)
