"""Results that were cut off, as a copy that breaks off leaves them: whatever reads them says so, with exit code 2."""

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import WORLD, Main
from drawing import ELASTIC, MAPS, WAVE, ZENER

from parcontact.__main__ import main

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="of files, which root reads alone")

ROUGH = """
grid: {points: 32, size: 2.0e-3}
surface: {shape: rough, hurst: 0.8, long_wavelength: 2.0e-3, short_wavelength: 2.5e-4, rms_slope: 0.01}
"""
PRESSES = "history: [{pressure: 1.0e3}, {pressure: 1.5e3}, {pressure: 2.0e3}]\n"
RUBBER = "steady: {velocities: [1.0e-2, 1.0e-1, 1.0], pressures: [1.0e3]}\noutput: {fields: [pressure]}\n"
SWEEP = "sweep: {surface.0.amplitude: [1.0e-6, 2.0e-6]}\n"
JOBS = {
    "run": ROUGH + ELASTIC + PRESSES + MAPS,
    "curve": WAVE + ZENER + RUBBER,
    "sweep": WAVE + ELASTIC + "history: [{pressure: 1.0e3}]\n" + SWEEP,
}
READ = {  # by which verbs, of which job
    ("run", "measures.csv"): ("info", "plot", "report", "leak", "run"),
    ("run", "fields.h5"): ("info", "plot", "report", "leak", "run"),
    ("run", "job.resolved.yaml"): ("info", "plot", "report", "leak"),
    ("run", ".parcontact"): ("plot", "report", "leak", "run"),
    ("run", "leak.csv"): ("info", "report"),
    ("run", "theory.csv"): ("info", "report"),
    ("run", "theory.yaml"): ("info",),
    ("run", "checkpoint/step-3.h5"): ("info", "run"),
    ("curve", "steady.csv"): ("info", "plot", "report"),
    ("curve", "steady.h5"): ("report",),
    ("curve", "steady.resolved.yaml"): ("plot", "report"),
    ("sweep", "sweep.csv"): ("info", "plot", "report"),
    ("sweep", "cases/000/.parcontact"): ("run",),
}
AT_ONCE = ("leak.csv", "theory.csv", "sweep.csv")  # of these a cut between two lines does not show


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Directories of all jobs, with all that the verbs leave in them."""
    place = tmp_path_factory.mktemp("whole")
    for name, text in JOBS.items():
        (place / f"{name}.yaml").write_text(text)
        assert main([str(place / f"{name}.yaml"), "--quiet", "--out", str(place / name)]) == 0
    assert main(["leak", str(place / "run")]) == 0
    assert main(["theory", str(place / "run.yaml"), "--quiet", "--out", str(place / "run")]) == 0
    return place


@pytest.mark.parametrize(("name", "file"), READ)
def test_files_that_were_cut_off(whole: Path, main: Main, name: str, file: str) -> None:
    """Each verb that reads it ends with 2 and a sentence that names it, wherever it was cut: within and after lines."""
    shutil.copytree(whole / name, name)
    path, data = Path(name) / file, (whole / name / file).read_bytes()
    lines = data.splitlines(keepends=True)
    cuts = {1, len(data) // 3, len(data) // 2, 4 * len(data) // 5}
    if file.endswith((".csv", ".yaml")) and file not in AT_ONCE:
        cuts |= {len(b"".join(lines[:number])) for number in (1, 2, len(lines) - 3, len(lines) - 1)}
    if file.endswith("resolved.yaml"):  # whose last section nothing reads
        cuts = {cut for cut in cuts if cut <= data.index(b"\ncheckpoint:") + 1}
    cuts |= {len(data) - 1} if not file.endswith(("resolved.yaml", ".parcontact")) else set()
    for cut in sorted(cuts):
        for verb in READ[name, file]:
            path.write_bytes(data[:cut])
            words = ["run", whole / f"{name}.yaml", "--out", name] if verb == "run" else [verb, name]
            code, said, errors = main(*words)
            text = said + errors
            assert code == 2, (verb, cut, text)
            assert str(path.name) in text, (verb, cut, text)
            assert "Traceback" not in text
            assert "sblock" not in text


@pytest.mark.parametrize("name", JOBS)
def test_files_that_are_whole(whole: Path, main: Main, name: str) -> None:
    """Nothing but the cut makes the verbs above end with 2."""
    verbs = {verb for (job, _), verbs in READ.items() if job == name for verb in verbs} - {"run"}
    assert {verb: main(verb, whole / name)[0] for verb in verbs} == dict.fromkeys(verbs, 0)


@pytest.mark.parametrize("name", ["step", "t", "x", "y", "pressure"])
@pytest.mark.parametrize("shape", [(0,), (1, 2)])
def test_maps_that_do_not_fit_their_coordinates(whole: Path, main: Main, name: str, shape: tuple[int, ...]) -> None:
    """A file of maps that another program has changed."""
    shutil.copytree(whole / "run", "run")
    with h5py.File("run/fields.h5", "r+") as file:
        del file[name]
        file[name] = np.zeros(shape)
    for words in (("plot", "run"), ("plot", "run", "--at", "2"), ("report", "run")):
        code, said, errors = main(*words)
        assert (code, "run/fields.h5 is damaged" in errors) == (2, True), (words, said + errors)
