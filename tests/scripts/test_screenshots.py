"""scripts/screenshots.py: pictures at two widths, and a page that is too wide for one of them."""

import shutil
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "screenshots.py"
PAGE = '<!doctype html><meta name="viewport" content="width=device-width"><p style="width: {}px">a</p>'


@pytest.mark.skipif(not shutil.which("chromium"), reason="there is no chromium on this machine")
def test_a_narrow_and_a_wide_page(tmp_path: Path) -> None:
    """Of 100 px and of 600 px, which a desk shows and a telephone of 390 px does not."""
    for name, width in (("narrow", 100), ("wide", 600)):
        (tmp_path / f"{name}.html").write_text(PAGE.format(width))
    command = [sys.executable, str(SCRIPT), str(tmp_path), "--to", str(tmp_path / "shots")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240)
    assert done.returncode == 1, done.stderr
    assert "wide.html: 608 px wide on a screen of 390 px\n" in done.stdout  # with a margin of 8 px to the left
    assert "narrow.html" not in done.stdout
    assert "; 1 pictures are too wide" in done.stdout
    assert matplotlib.image.imread(tmp_path / "shots" / "wide-1280.png").shape[1] == 1280
