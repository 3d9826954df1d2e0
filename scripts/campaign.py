"""Frame of campaigns: trials drawn from a seed and a number; the numbers of trials with faults are printed."""

import argparse
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

EVERY = 50  # trials between two lines of progress


def parser(doc: str | None, trials: int, what: str = "trials", **more: tuple[Any, str]) -> argparse.ArgumentParser:
    """Return the options of all campaigns, and the options in `more`: a default and a help text by name."""
    made = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument(f"--{what}", type=int, default=trials, dest="trials", metavar="N")
    made.add_argument("--seed", type=int, default=0, help="seed of all random choices")
    made.add_argument("--from", type=int, default=0, dest="first", metavar="NUMBER", help="number of the first trial")
    made.add_argument("--only", type=int, metavar="NUMBER", help="make this trial only")
    made.add_argument("--minutes", type=float, default=1e9, help="begin no further trial after this time")
    for name, (value, text) in more.items():
        kind: Any = {"action": "store_true"} if value is False else {"type": type(value), "default": value}
        made.add_argument(f"--{name.replace('_', '-')}", help=text, **kind)
    return made


def numbers(asked: argparse.Namespace) -> range:
    """Return the numbers of the requested trials."""
    return (
        range(asked.only, asked.only + 1) if asked.only is not None else range(asked.first, asked.first + asked.trials)
    )


def go(
    asked: argparse.Namespace,
    trial: Callable[[int], Iterable[str]],
    counts: Counter[str],
    also: Callable[[], bool] = lambda: False,
) -> int:
    """Make the trials, and further ones while `also` returns True; return the number of trials with faults.

    `trial` returns its faults as sentences; an exception is a fault, too. `counts` has counts of the trials, printed at
    the end.
    """
    chosen, began, faulty, number = numbers(asked), time.monotonic(), 0, numbers(asked).start
    while (number < chosen.stop or also()) and time.monotonic() - began < 60.0 * asked.minutes:
        faults = _made(trial, number)
        for fault in faults:
            print(f"{number}: {fault}", flush=True)
        faulty += bool(faults)
        number += 1
        if (number - chosen.start) % EVERY == 0:
            seconds = time.monotonic() - began
            made = number - chosen.start
            print(f"{made:6} made, {faulty} with faults, {seconds:.0f} s: {stated(counts)}", flush=True)
    print(f"{number - chosen.start} made: {faulty} with faults; {stated(counts)}")
    return faulty


def stated(counts: Counter[str]) -> str:
    return ", ".join(f"{count} {what}" for what, count in sorted(counts.items()))


def _made(trial: Callable[[int], Iterable[str]], number: int) -> list[str]:
    try:
        return list(trial(number))
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return [f"{type(error).__name__}: {str(error)[:300]} ({Path(where.filename).name}:{where.lineno})"]
