"""Open reports in headless Chromium, at the widths of a laptop and a phone: python scripts/check_report.py FILE...

Says what each page would load, prints to its console, shows without an area or scrolls sideways, and leaves screenshots
beside it. Needs chromium (Debian: apt-get install chromium); exit code 1 where something is wrong.
"""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

WIDTHS = {"laptop": 1280, "phone": 390}
HEIGHT = 4000  # of a screenshot [pixels]
SECONDS = 120.0  # for one page
PROBE = """<script>addEventListener("load", () => {
  const pictures = [...document.images].filter(one => getComputedStyle(one).display !== "none");
  const bad = pictures.filter(one => !one.complete || !one.naturalWidth || !one.clientWidth || !one.clientHeight);
  const loaded = performance.getEntriesByType("resource").filter(one => !one.name.startsWith("data:"));
  const sliders = [...document.querySelectorAll(".browser input")];
  sliders.forEach(one => { one.value = 0; one.dispatchEvent(new Event("input")); });
  const stuck = sliders.filter(one => !one.parentNode.querySelector("img").classList.contains("shown"));
  const wide = document.documentElement.scrollWidth > document.documentElement.clientWidth;
  document.querySelectorAll("details").forEach(one => { one.open = true; });
  const sideways = [...document.querySelectorAll(".scroll, pre")].filter(one => one.scrollWidth > one.clientWidth);
  const found = `${pictures.length} ${bad.length} ${loaded.length} ${stuck.length} ${Number(wide)} ${sideways.length}`;
  document.documentElement.setAttribute("data-probe", found);
});</script>"""


def main() -> int:
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if not browser:
        print("no chromium is installed: apt-get install chromium")
        return 1
    outcomes = [_wrong(browser, Path(name), width) for name in sys.argv[1:] for width in WIDTHS]
    print(f"{sum(outcomes)} of {len(outcomes)} views are wrong")
    return int(any(outcomes))


def _wrong(browser: str, page: Path, width: str) -> bool:
    """Whether a page is wrong at a width; says what was found."""
    picture = page.with_name(f"{page.stem}-{width}.png")
    _start(browser, WIDTHS[width], f"--screenshot={picture}", page)
    with tempfile.TemporaryDirectory() as directory:
        probed = Path(directory) / "page.html"
        probed.write_text(page.read_text() + PROBE)
        done = _start(browser, WIDTHS[width], "--dump-dom", probed)
    counts = re.search(r'data-probe="(\d+) (\d+) (\d+) (\d+) (\d+) (\d+)"', done.stdout)
    told = [line for line in done.stderr.splitlines() if ":CONSOLE" in line]
    if not counts:
        print(f"{page}, {width}: did not load")
        return True
    pictures, bad, loaded, stuck, wide, sideways = map(int, counts.groups())
    print(
        f"{page}, {width}: {pictures} pictures, {bad} of them without an area, {loaded} loaded from elsewhere, {stuck} "
        f"sliders that do nothing, {len(told)} lines on the console, {sideways} tables or texts that scroll sideways"
        f"{', wider than the screen' * wide}; {picture}"
    )
    return bool(bad or loaded or stuck or wide or told or not pictures or (sideways and width == "phone"))


def _start(browser: str, width: int, what: str, page: Path) -> subprocess.CompletedProcess[str]:
    words = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--enable-logging=stderr"]
    words += ["--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update"]
    words += ["--disable-sync", f"--window-size={width},{HEIGHT}", "--virtual-time-budget=5000", what]
    with tempfile.TemporaryDirectory() as profile:
        words += [f"--user-data-dir={profile}", page.absolute().as_uri()]
        return subprocess.run(words, capture_output=True, text=True, timeout=SECONDS, check=False)


if __name__ == "__main__":
    sys.exit(main())
