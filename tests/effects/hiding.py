"""A program of its own: uses the package without each capability in turn.

`python hiding.py PLAN.json` forks a process for each folder of the plan, in which it can be neither found nor imported,
and prints as JSON what the verbs returned and said. Modules of other packages are imported once, before the forks.
"""

import contextlib
import importlib
import io
import json
import os
import pkgutil
import sys
import traceback
from collections.abc import Iterator, Sequence
from importlib.abc import MetaPathFinder
from pathlib import Path
from typing import Any

ROOM = "parcontact.effects"
OTHERS = ("numpy", "numba", "h5py", "matplotlib.pyplot", "pydantic", "yaml", "xarray", "scipy.interpolate")  # no MPI


class Hider(MetaPathFinder):
    """Finds no module of a folder, as if it were deleted."""

    def __init__(self, folder: str) -> None:
        self.name = f"{ROOM}.{folder}"

    def find_spec(self, name: str, path: Sequence[str] | None, target: Any = None) -> None:
        if f"{name}.".startswith(f"{self.name}."):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def hide(folder: str) -> None:
    """Let a folder of the room be neither listed nor imported; before the package is imported."""
    assert not any(name.partition(".")[0] == "parcontact" for name in sys.modules)
    listed = pkgutil.iter_modules

    def without(path: Any = None, prefix: str = "") -> Iterator[pkgutil.ModuleInfo]:
        here = [Path(each).parts[-2:] for each in path or ()] == [tuple(ROOM.split("."))]
        return (each for each in listed(path, prefix) if not (here and each.name == folder))

    pkgutil.iter_modules = without
    sys.meta_path.insert(0, Hider(folder))


def leave_blank() -> None:
    """Save pictures with nothing on them; nor are they laid out (below), which takes most of the time of a report."""
    figure: Any = importlib.import_module("matplotlib.figure").Figure
    draw = figure.savefig
    figure.savefig = lambda self, file, **options: draw(figure(figsize=(0.1, 0.1)), file, **{**options, "dpi": 20})


def use(folder: str, commands: Sequence[Sequence[str]]) -> Iterator[tuple[int, str]]:
    """Yield the exit code and all output of each command of the program without a folder, with all if it is ''."""
    if folder:
        hide(folder)
    main = importlib.import_module("parcontact.__main__").main
    style: Any = importlib.import_module("parcontact.results.style")
    style.arrange = lambda figure: None
    for words in commands:
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            try:
                code = main(list(words))
            except SystemExit as end:
                code = end.code if isinstance(end.code, int) else 1
            except BaseException:
                code = 1
                traceback.print_exc()
        yield code, said.getvalue()


def main() -> None:
    found: dict[str, Any] = {}
    for name in OTHERS:
        importlib.import_module(name)
    leave_blank()
    for folder, commands in json.loads(Path(sys.argv[1]).read_text()).items():
        reader, writer = os.pipe()
        if os.fork() == 0:
            with os.fdopen(writer, "w") as out:
                json.dump(list(use(folder, commands)), out)
            os._exit(0)
        os.close(writer)
        with os.fdopen(reader) as file:
            found[folder] = json.load(file)
        os.wait()
    print(json.dumps(found))


if __name__ == "__main__":
    main()
