#!/usr/bin/env python
"""Pictures of web pages as a desk and a telephone show them, and which of them are wider than the screen.

    .venv/bin/python scripts/screenshots.py [FILE.html | DIRECTORY]... [--to out/screenshots]

Without names it takes the manual (out/manual/html, by scripts/manual) and all reports (out/*/report.html). It needs
chromium or chrome; where there is none it says so and ends well. Exit code 1: a page is wider than a screen.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
WIDTHS = (1280, 390)  # px: a desk, a telephone
HEIGHT = 2400  # px: what is below is left out
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--allow-file-access-from-files")
FRAME = """<!doctype html><title>?</title><style>body {{ margin: 0 }}</style>
<iframe src="{page}" width="{width}" height="{height}" style="border: 0"
 onload="document.title = this.contentDocument.documentElement.scrollWidth"></iframe>
"""  # a window of a browser cannot be as narrow as a telephone; a frame can


def pages(given: list[Path]) -> Iterator[Path]:
    """Yield the pages of files and directories, or of the manual and all reports."""
    for path in given or [ROOT / "out" / "manual" / "html", *sorted(ROOT.glob("out/*/report.html"))]:
        yield from sorted(path.glob("*.html")) if path.is_dir() else [path] * path.is_file()


def take(browser: str, page: Path, width: int, target: Path) -> int:
    """Write a picture of a page at a width [px], and return how wide its content is [px]."""
    with tempfile.TemporaryDirectory() as place:
        frame = Path(place) / "frame.html"
        frame.write_text(FRAME.format(page=page.resolve().as_uri(), width=width, height=HEIGHT))
        window = [f"--window-size={max(width, 500)},{HEIGHT}", f"--user-data-dir={place}/profile", frame.as_uri()]
        done = subprocess.run([browser, *FLAGS, "--dump-dom", *window], capture_output=True, text=True, timeout=60)
        shot = [browser, *FLAGS, f"--screenshot={target.resolve()}", *window]
        subprocess.run(shot, capture_output=True, timeout=60, check=True)
    with Image.open(target) as picture:
        picture.crop((0, 0, width, HEIGHT)).save(target)
    found = re.search(r"<title>(\d+)</title>", done.stdout)
    if found is None:
        raise SystemExit(f"{page} cannot be shown: {done.stderr[-300:]}")
    return int(found[1])


def main() -> int:
    """Take all pictures, and tell what is too wide."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="*", type=Path)
    parser.add_argument("--to", type=Path, default=Path("out/screenshots"))
    options = parser.parse_args()
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        print("no screenshots: there is no chromium on this machine")
        return 0
    found = list(pages(options.pages))
    if not found:
        print("no screenshots: there is no page; scripts/manual and parcontact report make some")
        return 0
    options.to.mkdir(parents=True, exist_ok=True)
    wide = 0
    for page in found:
        name = page.stem if page.stem != "report" else f"{page.parent.name}-report"
        for width in WIDTHS:
            content = take(browser, page, width, options.to / f"{name}-{width}.png")
            if content > width:
                print(f"{page}: {content} px wide on a screen of {width} px")
            wide += content > width
    print(f"{len(found)} pages at {' and '.join(map(str, WIDTHS))} px in {options.to}; {wide} pictures are too wide")
    return 1 if wide else 0


if __name__ == "__main__":
    sys.exit(main())
