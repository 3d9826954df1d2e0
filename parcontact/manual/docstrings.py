"""Text of the manual's page on Python, from the docstrings of functions and classes, to be read in a terminal.

The web site has it from Sphinx, by the same directives: `.. autoclass:: NAME`, `:members:`, `.. autofunction:: NAME`.
"""

from __future__ import annotations

import inspect
import pydoc
import re
import textwrap
from collections.abc import Iterator
from dataclasses import is_dataclass
from typing import Any

ROOM = 64  # letters for the first sentence of a docstring in the list of names
BLOCK = re.compile(r"^```\{eval-rst\}\n(.*?)^```$", re.MULTILINE | re.DOTALL)
DIRECTIVE = re.compile(r"^\.\. auto(?:class|function):: (\S+)\n(?:   :members:(.*)\n)?", re.MULTILINE)


def written(page: str) -> str:
    """A page with headings and docstrings for its blocks of directives."""
    return BLOCK.sub(lambda block: "\n\n".join(_entries(block.group(1))), page)


def _entries(block: str) -> Iterator[str]:
    named = DIRECTIVE.findall(block)
    width = max(len(_short(name)) for name, _ in named)
    yield "```text\n" + "\n".join(f"{_short(name):{width}}  {_first_sentence(name)}" for name, _ in named) + "\n```"
    for name, members in named:
        found: Any = pydoc.locate(name)
        yield f"## {_short(name)}{_parameters(found)}\n\n{inspect.getdoc(found)}"
        named = [member.strip() for member in members.split(",") if member.strip()]
        all_of = members == "" and f"{name}\n   :members:" in block
        for member in named or (_public(found) if all_of else ()):
            value = inspect.getattr_static(found, member)
            yield f"### {member}{_parameters(getattr(value, '__func__', value))}\n\n{inspect.getdoc(value)}"


def _short(name: str) -> str:
    """Return a name as a program writes it: `pc.steady`."""
    return name.replace("parcontact.", "pc.", 1)


def _first_sentence(name: str) -> str:
    """Return the beginning of a docstring, as far as a line of a terminal has room for it."""
    text = re.split(r"(?<=[.:;]) ", " ".join((inspect.getdoc(pydoc.locate(name)) or "").split()))[0]
    return textwrap.shorten(text.rstrip(".:;"), ROOM, placeholder=" ...")


def _public(kind: type) -> list[str]:
    return [name for name, value in vars(kind).items() if not name.startswith("_") and inspect.getdoc(value)]


def _parameters(found: Any) -> str:
    """Return parameters as in a call: `(job, set=None)`; '' of attributes, results and errors, which nobody calls."""
    if not callable(found) or is_dataclass(found) or (isinstance(found, type) and issubclass(found, Exception)):
        return ""
    signature = inspect.signature(found)
    plain = [
        parameter.replace(annotation=parameter.empty)
        for name, parameter in signature.parameters.items()
        if name not in ("self", "cls")
    ]
    return str(signature.replace(parameters=plain, return_annotation=signature.empty))
