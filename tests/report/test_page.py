"""`parcontact report`: one file that loads nothing from elsewhere and holds all that a directory tells."""

import base64
import csv
import io
import re
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from drawing import ELASTIC, LOADS, MAPS, SLIDE, SPHERE, WAVE, ZENER, ran
from PIL import Image

from parcontact import __main__, job
from parcontact.errors import InputError
from parcontact.files.stopping import Options
from parcontact.march import curve
from parcontact.parallel.slab import Slab
from parcontact.results import page, report_sections

pytestmark = pytest.mark.rendered

VOID = {"meta", "link", "img", "input", "br", "wbr"}
LOADS_FROM = {"src", "href", "srcset", "data", "poster", "action"}


class Page(HTMLParser):
    """Whether every element is closed in order, and what a page holds."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: Counter[str] = Counter()
        self.urls: list[tuple[str, str]] = []
        self.headings: list[str] = []
        self.downloads: dict[str, bytes] = {}
        self.text = text.replace("\N{NO-BREAK SPACE}", " ")
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen[tag] += 1
        found = {name: value or "" for name, value in attrs}
        self.urls += [(tag, value) for name, value in found.items() if name in LOADS_FROM]
        if "download" in found:
            self.downloads[found["download"]] = decoded(found["href"])
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "h2":
            self.headings.append(data)

    @property
    def pictures(self) -> list[bytes]:
        return [decoded(url) for tag, url in self.urls if tag == "img"]


def decoded(uri: str) -> bytes:
    assert uri.startswith("data:")
    return base64.b64decode(uri.partition(",")[2], validate=True)


def size(picture: bytes) -> tuple[float, float]:
    """Of an SVG [pt] or another picture [pixels]."""
    if picture.startswith(b"<?xml"):
        root = ElementTree.fromstring(picture)
        assert len(list(root.iter())) > 20
        return float(root.attrib["width"].removesuffix("pt")), float(root.attrib["height"].removesuffix("pt"))
    return Image.open(io.BytesIO(picture)).size


def check(found: Page) -> None:
    """Nothing is loaded from elsewhere, and every picture is one."""
    for tag, url in found.urls:
        assert url.startswith("data:" if tag != "a" else ("data:", "#")), url
    assert "@import" not in found.text
    assert "url(" not in found.text
    assert "fetch(" not in found.text
    assert all(min(size(picture)) > 100 for picture in found.pictures)


ASKED = ["Job", "Material", "Surface"]
COMMON = [*ASKED, "Error budget", "Cost", "Warnings", "Provenance", "References to cite", "Data"]


def test_run(tmp_path: Path) -> None:
    """Four charts, four panels of the surface, the moduli, and two maps of each of the saved instants."""
    out = ran(
        tmp_path, f"title: <b>Rubber</b> & road\n{WAVE}{ZENER}{SLIDE}output: {{fields: [pressure, gap], every: 8}}\n"
    )
    found = Page(page.write_report([out]).read_text())
    check(found)
    assert found.headings == ["Results of the run", *COMMON]
    assert "&lt;b&gt;Rubber&lt;/b&gt; &amp; road" in found.text
    saved = 3  # the initial state, and steps 8 and 16
    assert len(found.pictures) == 4 + 4 + 2 + 2 * saved
    assert found.seen["input"] == 2
    assert found.downloads == {"measures.csv": (out / "measures.csv").read_bytes()}
    for stated in ("relaxation_time: 1.0e-3", "<td>2 MPa</td>", "<td>1 ms</td>", "operator calls"):
        assert stated in found.text


def solved(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "curve.yaml"
    path.write_text(text)
    loaded = job.load(path, [f"output.directory={tmp_path / 'steady'}", "steady.pressures=[1.0e3]"])
    assert curve.run_curve(loaded, Slab.alone(*loaded.grid.points), curve.request(loaded), Options(quiet=True)) == 0
    return tmp_path / "steady"


WARM = ZENER.replace("}]}", "}], shift: {law: wlf, C1: 10.0, C2: 100.0, reference: 20.0}, band: [1.0, 2.0]}")
HEAT = "steady: {velocities: [0.1, 1.0], temperatures: [20.0, 40.0]}\noutput: {fields: pressure}\n"


def test_curve_and_run_together(tmp_path: Path) -> None:
    """Both in one page, without a comparison, for they have no axis in common; maps are browsed over velocity.

    Of the curve there are also the warnings of its log, its errors, and frequencies at each temperature: the wave of
    1.4 mm passes with 71 Hz at 0.1 m/s; at 40 C, with a_T = 10**(-10 20/120), moduli are those at 1.5 Hz at 20 C.
    """
    steady = solved(tmp_path, WAVE + WARM + HEAT)
    out = ran(tmp_path, WAVE + ZENER + SLIDE)
    found = Page(page.write_report([steady, out], tmp_path / "both.html").read_text())
    check(found)
    assert found.headings == ["Friction", "Friction curve", *COMMON, "Results of the run", *COMMON]
    assert "1 m/s, 1 kPa, 40 °C" in found.text
    assert "decades above the measured 1 to 2 Hz: moduli are an extrapolation there" in found.text
    for cell in ("at the worst point", "40 °C", "0.0215", "70.7 Hz to 707 Hz", "1.52 Hz to 15.2 Hz"):
        assert f">{cell}<" in found.text
    assert set(found.downloads) == {"steady.csv", "measures.csv"}


def test_the_errors_of_a_run_are_those_of_its_log_and_its_last_step(tmp_path: Path) -> None:
    """The last sentence of the log counts: a run that goes on says it again."""
    said = "estimated error of friction: {} % (solver 0.25 %, time 1 %, folded 0 %, mesh 4e-05 %), mean over time"
    lines = [f"2026-01-01 00:00:00,000 {said.format(number)}\n" for number in ("77", "1.25")]
    (tmp_path / "run.log").write_text("".join(lines))
    columns = {"error_friction": [16.0, 0.02, 0.03, np.nan], "error_area": [np.nan] * 4}  # the first one at rest
    (tmp_path / "job.yaml").write_text(WAVE + ZENER + SLIDE + "numerics: {accuracy: 0.01}\n")
    slide = job.load(tmp_path / "job.yaml")
    section = page.describe_errors(columns, page.read_logs(tmp_path), slide, of_curve=False)
    assert section.sentences == [f"{said.format('1.25')}."]
    assert section.tables[0].rows == [("friction", "3 %", "1 %")]


def test_the_area_in_a_free_box_has_a_unit(tmp_path: Path) -> None:
    """Hertz's area, corrected for its edges: a share of the box would depend on the choice of the box."""
    section = report_sections.describe_run(ran(tmp_path, SPHERE + ELASTIC + "history: [{force: 0.1}]\n"))
    (row,) = (row for row in section.tables[0].rows if row[0] == "contact area")
    area = np.pi * (3 * 0.1 * 1.0e-2 / (4 * 4.0e6)) ** (2 / 3)  # E* = 4 G of an incompressible body
    assert float(row[1]) == pytest.approx(area, rel=0.03)
    assert row[-1] == "m²"


def test_a_seal(tmp_path: Path) -> None:
    """Where nothing slides no error of friction is stated; the table of leakage is in the data."""
    out = ran(tmp_path, WAVE + ELASTIC + LOADS + MAPS)
    resting, columns = job.load(out / "job.resolved.yaml"), {"error_friction": [16.0, 8.0], "error_area": [0.1, 0.2]}
    section = page.describe_errors(columns, page.read_logs(tmp_path), resting, of_curve=False)
    assert [row[0] for row in section.tables[0].rows] == ["contact area"]
    assert __main__.main(["leak", str(out)]) == 0
    found = Page(page.write_report([out]).read_text())
    check(found)
    assert found.downloads["leak.csv"] == (out / "leak.csv").read_bytes()


def test_two_curves_together(tmp_path: Path) -> None:
    """What they have in common, friction and contact area, is drawn above the chapter of each."""
    paths = []
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        text = (
            "velocity,pressure,friction,contact_area,seconds,operator_calls\n0.1,1e3,0.1,0.2,1,5\n1,1e3,0.2,0.1,1,5\n"
        )
        (tmp_path / name / "steady.csv").write_text(text)
        paths.append(tmp_path / name)
    found = Page(page.write_report(paths).read_text())
    check(found)
    assert found.headings == [
        "Together",
        *2 * ["Friction", "Friction curve", "Provenance", "References to cite", "Data"],
    ]
    assert len(found.pictures) == 2 + 2 * 2


def test_sweep_and_study(tmp_path: Path) -> None:
    """Tables without maps: the words of their files are cells, and no key of a job is lost."""
    head = ("case", "history.0.velocity", "state", "mu_max", "mu_dyn", "contact_area")
    with (tmp_path / "sweep.csv").open("w", newline="") as file:
        csv.writer(file).writerows([head, (0, 0.1, "done", 0.25, 0.2, 0.5), (1, 1.0, "failed", "", "", "")])
    (tmp_path / "study.csv").write_text("case,mesh,integrator,mu_max\n0,64,exponential,0.123456789\n")
    (tmp_path / "study.txt").write_text("for 1 %: mesh 64\n")
    found = Page(page.write_report([tmp_path]).read_text())
    check(found)
    assert found.headings == ["Sweep", "Cost of accuracy", "Provenance", "References to cite", "Data"]
    for stated in (">failed</td>", ">0.12346</td>", ">exponential</td>", "for 1 %: mesh 64"):
        assert stated in found.text
    # a phone shows rows of wide tables as names, which may break at marks, and values
    named = re.findall(r'<td data-head="([^"]*)"', found.text.replace("&#8203;", ""))
    units = [name.replace("velocity", "velocity [m/s]") for name in head]
    assert named == [*units, *units, "case", "mesh", "integrator", "mu_max"]


def test_a_report_of_a_sweep_says_what_differs_between_cases(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No directory of this machine is in the page: who gets it has others."""
    monkeypatch.chdir(tmp_path)
    np.save(tmp_path / "road.npy", 1e-7 * np.random.default_rng(1).normal(size=(16, 16)))
    text = "grid: {points: 16, size: 1.0e-3}\nsurface: {shape: file, path: road.npy}\n"
    text += f"{ELASTIC}history: [{{pressure: 1.0e+4}}]\nsweep: [{{surface.scale: [1.0, 2.0]}}]\n"
    (tmp_path / "job.yaml").write_text(text)
    assert __main__.main(["job.yaml", "--quiet"]) == 0
    found = Page(page.write_report([tmp_path / "out" / "job", tmp_path / "out" / "job" / "cases" / "000"]).read_text())
    of_first = [f"{name} of the first case" for name in ASKED]
    assert found.headings[:4] == ["Sweep", *of_first]
    assert found.headings.count("Job") == 1  # of the case itself, in the second chapter
    assert "The sweep has 2 cases, with surface.scale (1.0, 2.0)." in found.text
    assert "road.npy" in found.text
    assert str(tmp_path) not in found.text


def test_a_report_of_a_sweep_has_the_warnings_of_its_cases(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each once, with its cases; and errors beyond the accuracy, about which the run of the sweep warns at its end."""
    monkeypatch.chdir(tmp_path)
    slide = "history: [{pressure: 1.0e+3, velocity: 0.1, distance: 2.5e-4, cells_per_step: 1}]\n"
    text = f"{WAVE}{ZENER}{slide}sweep: [{{numerics.accuracy: [1.0e-3, 1.0e-2, 0.9]}}]\n"
    Path("job.yaml").write_text(text)
    assert __main__.main(["job.yaml", "--quiet"]) == 0
    (out := Path("out/job/cases/001/run.log")).write_text(out.read_text() + "warning: hot\n")
    found = Page(page.write_report([Path("out/job")]).read_text())
    assert "There was no warning" not in found.text
    assert "the estimated error of friction exceeds numerics.accuracy (cases 0-1)" in found.text
    assert "hot (case 1)" in found.text


def test_long_words_break_after_their_parts_alone(tmp_path: Path) -> None:
    """On a phone and on paper: names of columns, keys and paths. A number stays whole, and with its unit."""
    head = ("case", "surface.0.short_wavelength", "state", "contact_area_corrected")
    with (tmp_path / "sweep.csv").open("w", newline="") as file:
        csv.writer(file).writerows([head, (0, 1e-5, "done", 0.25)])
    text = page.render([tmp_path])
    assert '<th scope="col">contact_<wbr>area_<wbr>corrected</th>' in text
    assert 'data-head="surface.&#8203;0.&#8203;short_&#8203;wavelength [m]"' in text
    assert '<span class="n">1e-05</span></td>' in text
    assert page.breakable("a <b> of /home/somebody/runs") == "a &lt;b&gt; of /<wbr>home/<wbr>somebody/<wbr>runs"
    said = page.whole_numbers("friction is 0.2 ± 0.1 %, at t = 3 s under 1.2 MPa, in 12 steps")
    assert said.split(" ") == [
        "friction",
        "is",
        "0.2\xa0±\xa00.1\xa0%,",
        "at",
        "t",
        "=\xa03\xa0s",
        "under",
        "1.2\xa0MPa,",
        "in",
        "12",
        "steps",
    ]


def test_a_sweep_of_curves_says_what_was_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As a sweep of runs: title, job, rubber, surface and references of its first case. The table of cases has no
    column without a number."""
    monkeypatch.chdir(tmp_path)
    curve = "steady: {velocities: [0.1, 1.0], pressures: [1.0e+4]}\nsweep: [{steady.pressures: [1.0e+3, 2.0e+3]}]\n"
    Path("job.yaml").write_text(
        f"title: Two loads\ngrid: {{points: 16, size: 1.0e-3}}\n{WAVE[WAVE.index('surface') :]}{ZENER}{curve}"
    )
    assert __main__.main(["steady", "job.yaml", "--quiet"]) == 0
    found = Page(page.write_report([Path("out/job")]).read_text())
    of_first = [f"{name} of the first case" for name in ASKED]
    assert found.headings[:4] == ["Sweep", *of_first]
    assert "<h1>Two loads</h1>" in found.text
    assert "Polonsky" in found.text
    assert Path("out/job/sweep.csv").read_text().splitlines()[0] == "case,steady.pressures,state"


def test_heights_that_are_gone(tmp_path: Path) -> None:
    """A report tells what there is: the surface cannot be made anew, all else is there."""
    np.save(tmp_path / "road.npy", np.random.default_rng(1).normal(size=(32, 32)))
    surface = WAVE.replace(
        "{shape: wave, amplitude: 1.0e-6, waves: [1, 1]}", "{shape: file, path: road.npy, scale: 1.0e-7}"
    )
    out = ran(tmp_path, surface + ELASTIC + LOADS)
    (tmp_path / "road.npy").unlink()
    assert Page(page.write_report([out]).read_text()).headings == ["Results of the run", *COMMON]


@pytest.mark.parametrize(
    ("name", "out", "stated"),
    [
        ("nowhere", None, "is not a directory"),
        (".", None, "has no results"),
        (".", "report.pdf", r"must end in \.html"),
    ],
)
def test_nothing_to_report(tmp_path: Path, name: str, out: str | None, stated: str) -> None:
    with pytest.raises(InputError, match=stated):
        page.write_report([tmp_path / name], tmp_path / out if out else None)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["theory.csv", "checkpoint/step-9.h5"])
def test_links_are_refused(tmp_path: Path, name: str) -> None:
    """They could lead to what only who makes the report may read."""
    (tmp_path / "checkpoint").mkdir()
    (tmp_path / name).symlink_to(tmp_path / "secret")
    with pytest.raises(InputError, match=rf"{name} is a symbolic link, which a report does not read"):
        page.write_report([tmp_path])
