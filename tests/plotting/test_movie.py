"""Movies: a GIF always, and an MP4 where ffmpeg is, of which a script takes the place here."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from drawing import ELASTIC, KINDS, SPHERE, asked, ran
from PIL import Image

from parcontact.files import files

LOADS = KINDS["loads"][0]  # two instants
FAKE = """#!/bin/sh
for last; do :; done
echo "$@" > arguments
cat > frames
printf 'a movie %s' "{mark}" > "${{last#file:}}"
{end}
"""


@pytest.fixture
def out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A run, and a path on which nothing is but the shell."""
    found = ran(tmp_path, LOADS)
    (tmp_path / "bin").mkdir()
    for name in ("sh", "cat"):
        os.symlink(str(shutil.which(name)), tmp_path / "bin" / name)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.chdir(tmp_path)
    return found


def put_ffmpeg(end: str = "") -> None:
    script = Path("bin/ffmpeg")
    script.write_text(FAKE.format(mark=files.MARK, end=end))
    script.chmod(0o755)


@pytest.mark.rendered
def test_an_mp4_where_ffmpeg_is(out: Path) -> None:
    """It gets the points of all frames in three bytes, and its file is ours: it is replaced without a word."""
    put_ffmpeg()
    for _ in range(2):
        assert asked(out, "--movie", "pressure") == 0
    assert sorted(path.name for path in out.glob("pressure.*")) == ["pressure.gif", "pressure.mp4"]
    with Image.open(out / "pressure.gif") as movie:
        width, height = (2 * (side // 2) for side in movie.size)
    words = Path("arguments").read_text().split()
    assert words[words.index("-s") + 1] == f"{width}x{height}"
    assert words[words.index("-r") + 1] == "2"  # slow enough to see two frames
    assert Path("frames").stat().st_size == 2 * 3 * width * height
    assert files.is_marked(out / "pressure.mp4")


@pytest.mark.rendered
def test_movies_of_slip(tmp_path: Path) -> None:
    """Tractions and slip are drawn from both saved components, a frame for each instant."""
    stick = "interface: {coefficient: 0.5, stick: true}\noutput: {fields: [pressure, traction]}\n"
    shear = "history:\n  - {force: 1.0e-3}\n  - {force: 1.0e-3, velocity: 1.0e-7, duration: 2, time_step: 1}\n"
    found = ran(tmp_path, SPHERE + ELASTIC + stick + shear)
    for name in ("traction", "slip"):
        assert asked(found, "--movie", name, "--out", f"{tmp_path}/{name}.gif") == 0
        with Image.open(tmp_path / f"{name}.gif") as movie:
            assert movie.n_frames == 3  # type: ignore[attr-defined]


@pytest.mark.rendered
def test_a_gif_alone_without_ffmpeg(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert asked(out, "--movie", "pressure") == 0
    assert [path.name for path in out.glob("pressure.*")] == ["pressure.gif"]
    assert asked(out, "--movie", "pressure", "--out", "one.mp4") == 2
    assert "an MP4 needs the program ffmpeg on the path; give an --out that ends in .gif" in capsys.readouterr().err


@pytest.mark.rendered
def test_an_ffmpeg_that_fails(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    put_ffmpeg("echo 'frames were read' >&2; echo 'no codec' >&2; exit 3")
    assert asked(out, "--movie", "gap") == 2
    assert f"ffmpeg cannot write {out / 'gap.mp4'}: no codec" in capsys.readouterr().err
    assert [path.name for path in out.glob("gap.*")] == ["gap.gif"]


@pytest.mark.rendered
@pytest.mark.skipif(not shutil.which("ffmpeg"), reason="ffmpeg is not installed")
def test_a_true_mp4(tmp_path: Path) -> None:
    """ffmpeg reads back two frames of its own movie."""
    found = ran(tmp_path, LOADS)
    assert asked(found, "--movie", "pressure") == 0
    command = ["ffmpeg", "-i", str(found / "pressure.mp4"), "-f", "null", "-"]
    stated = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    assert "frame=    2" in stated
    assert files.is_marked(found / "pressure.mp4")
