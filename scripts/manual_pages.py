"""Write the pages of the manual as sources for Sphinx, with generated tables, executed notebooks, and pictures.

.venv/bin/python scripts/manual_pages.py --to out/manual/source [--no-notebooks]
"""

import argparse
import contextlib
import io
import json
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

from parcontact.door import manual_texts
from parcontact.door.arguments import describe_verbs

ROOT = Path(__file__).resolve().parents[1]
NOTEBOOKS = manual_texts.PAGES.parent / "notebooks"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--to", type=Path, required=True, help="directory of the pages")
    parser.add_argument("--no-notebooks", action="store_true", help="write the notebooks without running them")
    options = parser.parse_args()
    target: Path = options.to
    target.mkdir(parents=True, exist_ok=True)
    for name in manual_texts.page_names():
        (target / f"{name}.md").write_text(manual_texts.page(name, {"verbs": describe_verbs}))
    shutil.copy(ROOT / "scripts" / "sphinx_conf.py", target / "conf.py")
    (target / "static").mkdir(exist_ok=True)
    shutil.copy(manual_texts.PAGES.parent / "manual.css", target / "static")
    shutil.copytree(ROOT / "jobs" / "pictures", target / "pictures", dirs_exist_ok=True)
    for notebook in sorted(NOTEBOOKS.glob("*.ipynb")):
        text = "\n\n".join(pieces(notebook, target, not options.no_notebooks))
        (target / f"notebook_{notebook.stem}.md").write_text(text + "\n")
        shutil.copy(notebook, target)
    print(f"{len(list(target.glob('*.md')))} pages in {target}")
    return 0


def pieces(notebook: Path, target: Path, run: bool) -> Iterator[str]:
    """Yield a notebook as Markdown: its texts, its cells, and their output and pictures."""
    space: dict[str, Any] = {"__name__": "__main__"}
    for number, cell in enumerate(json.loads(notebook.read_text())["cells"]):
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            yield source
            continue
        yield f"```python\n{source}\n```"
        if run:
            yield from outcome(source, space, target, f"{notebook.stem}_{number}")
    yield f"This page is a notebook: {{download}}`{notebook.name}`."


def outcome(source: str, space: dict[str, Any], target: Path, name: str) -> Iterator[str]:
    """Run a cell in a temporary directory; yield its printed output and its figures."""
    from matplotlib import pyplot

    printed = io.StringIO()
    with tempfile.TemporaryDirectory() as directory, working_in(directory), contextlib.redirect_stdout(printed):
        exec(compile(source, name, "exec"), space)
    if printed.getvalue().strip():
        yield f"```text\n{re.sub(r' +$', '', printed.getvalue().rstrip(), flags=re.MULTILINE)}\n```"
    for figure in map(pyplot.figure, pyplot.get_fignums()):
        (target / "pictures").mkdir(exist_ok=True)
        figure.savefig(target / "pictures" / f"{name}.png", dpi=200, bbox_inches="tight")
        yield f"![What the cell above draws](pictures/{name}.png)"
    pyplot.close("all")


@contextlib.contextmanager
def working_in(directory: str) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(directory)
    try:
        yield
    finally:
        os.chdir(before)


if __name__ == "__main__":
    sys.exit(main())
