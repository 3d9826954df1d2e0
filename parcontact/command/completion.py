"""Completion of the command line for bash, generated from the parser: verbs, then options, their choices, and files."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

HEAD = """\
# Completion of parcontact for bash. Now: eval "$(parcontact completion bash)"; always: put that line into ~/.bashrc
_parcontact() {
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} words=""
    case "${COMP_WORDS[1]} $before" in"""
TAIL = """\
    esac
    COMPREPLY=($(compgen -W "$words" -- "$word"))
    [[ $word == -* ]] || COMPREPLY+=($(compgen -f -- "$word"))
}
complete -o filenames -F _parcontact parcontact"""


def bash(parser: argparse.ArgumentParser) -> str:
    """A script for bash."""
    verbs = verbs_of(parser)
    lines = [HEAD]
    for verb, own in verbs.items():
        for action in own._actions:
            if action.choices and action.option_strings:
                patterns = "|".join(f'"{verb} {option}"' for option in action.option_strings)
                lines.append(f"        {patterns}) words={_quoted(action.choices)} ;;")
        positional = [word for action in own._actions if not action.option_strings for word in action.choices or ()]
        lines.append(f'        "{verb} "*) words={_quoted([*_options(own), *positional])} ;;')
    lines.append(
        f"        *) (( COMP_CWORD > 1 )) && words={_quoted(_options(verbs['run']))} "
        f"|| words={_quoted([*verbs, 'help', '--help', '--version'])} ;;"
    )
    return "\n".join([*lines, TAIL])


def verbs_of(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """The parsers of all verbs."""
    (action,) = (one for one in parser._actions if isinstance(one, argparse._SubParsersAction))
    return dict(action.choices)


def reference(parser: argparse.ArgumentParser) -> str:
    """What the manual says of the verbs: the help of each."""
    return "\n".join(
        f"\n## `{verb}`\n\n```text\n{own.format_help().rstrip()}\n```" for verb, own in verbs_of(parser).items()
    )


def _options(parser: argparse.ArgumentParser) -> Iterator[str]:
    for action in parser._actions:
        if action.help != argparse.SUPPRESS:
            yield from (option for option in action.option_strings if option.startswith("--"))


def _quoted(words: object) -> str:
    return '"' + " ".join(map(str, words)) + '"'  # type: ignore[call-overload]
