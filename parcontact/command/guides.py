"""Verbs that answer from what the program knows of itself: its manual, its job files, what to cite, its own words."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from .ranks import root_alone
from .verbs import DONE

if TYPE_CHECKING:
    import argparse

    Verbs = argparse._SubParsersAction[Any]


def add_verbs(found: Verbs, parser: argparse.ArgumentParser) -> None:
    """Add the verbs of this file to those of the command line."""
    own = found.add_parser("manual", help="print a page of the manual, or say which there are")
    own.add_argument("page", nargs="?", default="", help="the name of a page (default: list them)")
    own.add_argument("--open", action="store_true", help="open the page in a browser, where scripts/manual has run")
    own.set_defaults(act=manual, parser=parser)

    own = found.add_parser("schema", help="print a JSON Schema of job files, for editors")
    own.set_defaults(act=schema)

    own = found.add_parser("cite", help="say what to cite for a run")
    own.add_argument("directory", metavar="OUT", type=Path, help="output directory of a run or curve")
    own.set_defaults(act=cite)

    own = found.add_parser("completion", help="print a script that completes command lines of parcontact")
    own.add_argument("shell", choices=("bash",))
    own.set_defaults(act=completion, parser=parser)


@root_alone
def manual(options: argparse.Namespace) -> int:
    from ..manual import texts
    from .completion import reference

    if options.open:
        import webbrowser

        webbrowser.open(texts.built(options.page or "index").as_uri())
    elif options.page:
        print(texts.plain(options.page, {"verbs": lambda: reference(options.parser)}))
    else:
        print(texts.contents())
    return DONE


@root_alone
def schema(options: argparse.Namespace) -> int:
    import json
    import sys

    from ..job import extension
    from ..job import schema as job_schema

    for text in extension.unusable():
        print(f"warning: {text}; the schema is without it", file=sys.stderr)
    print(json.dumps(job_schema.schema(), indent=1))
    return DONE


@root_alone
def cite(options: argparse.Namespace) -> int:
    from ..summary import citations

    print(citations.describe(options.directory))
    return DONE


@root_alone
def completion(options: argparse.Namespace) -> int:
    from .completion import bash

    print(bash(options.parser))
    return DONE
