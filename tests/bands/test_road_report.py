"""What `check`, warnings and reports say of jobs in bands."""

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml

from parcontact import job as jobs
from parcontact.__main__ import main
from parcontact.bands.choice import cut_bands, doubts_of_bands, on_one_grid_of_all
from parcontact.bands.road_history import plan_bands
from parcontact.effects.heat.solver import Flash
from parcontact.effects.heat.steady import describe_hot, describe_unmeasured, flash_of_bands
from parcontact.job.meaning import excited_band
from parcontact.parallel.slab import Slab
from parcontact.results import band_charts, page

LONG = 4e-3
MEASURED = {
    **{"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 2e7, "relaxation_time": 1e-3}]},
    **{"shift": {"law": "wlf", "C1": 9.0, "C2": 120.0, "reference": 20.0}},
    **{"band": [0.1, 1e3], "temperatures": [-20.0, 60.0]},
}


def spectrum(path: Path, longest: float, shortest: float) -> str:
    """A table of a self-affine spectrum."""
    q = np.geomspace(2 * np.pi / longest, 2 * np.pi / shortest, 30)
    np.savetxt(path, np.c_[q, 1e-3 * q**-3.6], delimiter=",", header="q[1/m],C2D[m^4]", comments="")
    return str(path)


def road_map(path: Path, points: int, side: float) -> dict[str, Any]:
    x = np.arange(points) * side / points
    heights = 1e-4 * np.cos(2 * np.pi * 4 * x / side)[None, :] * np.cos(2 * np.pi * 3 * x / side)[:, None]
    np.save(path, heights)
    return {"shape": "topography", "path": str(path), "unit": "m", "size": [side, side]}


def job_of(surface: Any, **more: Any) -> dict[str, Any]:
    return {
        **{"surface": surface, "material": MEASURED, "bands": "auto", "numerics": {"accuracy": 0.3}},
        **{"steady": {"velocities": [0.01, 1.0], "pressures": [1e5], "temperatures": [10.0, 70.0]}},
        **more,
    }


def test_frequencies_are_of_all_waves(tmp_path: Path) -> None:
    """From the slowest over the longest wave, the map, to the fastest over the shortest one of the spectrum."""
    table = spectrum(tmp_path / "s.csv", LONG, LONG / 40)
    alone = jobs.load(job_of([{"shape": "rough", "spectrum": table, "seed": 1}]))
    low, high = excited_band(on_one_grid_of_all(alone)) or (0.0, 0.0)
    assert low == pytest.approx(0.01 / LONG, rel=1e-3)
    assert high == pytest.approx(1.0 / (LONG / 40), rel=0.02)  # whole cells
    first = road_map(tmp_path / "road.npy", 128, 4 * LONG)
    mapped = jobs.load(job_of([first, {"shape": "rough", "spectrum": table, "seed": 1}]))
    assert (excited_band(on_one_grid_of_all(mapped)) or (0.0,))[0] == pytest.approx(0.01 / (4 * LONG))


def test_check_knows_all_temperatures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Also those of the section `steady`, of which 70 C was not measured; and how high and steep the surface is."""
    surface = [{"shape": "rough", "spectrum": spectrum(tmp_path / "s.csv", LONG, LONG / 40), "seed": 1}]
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(job_of(surface)))
    assert main(["check", str(tmp_path / "job.yaml")]) == 0
    said = capsys.readouterr().out
    assert "70 C is outside of the measured -20 to 60 C" in said
    slope = cut_bands(jobs.load(tmp_path / "job.yaml")).rms_slope(1, 0)
    assert f"rms slope {slope:.4g}" in said


def test_a_spectrum_that_leaves_no_waves_to_the_map(tmp_path: Path) -> None:
    """Of a map only waves longer than those of the spectrum are taken: a warning says from where to take these."""
    first = road_map(tmp_path / "road.npy", 128, 4 * LONG)
    for longest, warns in ((2 * LONG, True), (LONG / 2, False)):
        fine = {"shape": "rough", "hurst": 0.8, "rms_slope": 0.2, "long_wavelength": longest, "short_wavelength": 2e-4}
        job = jobs.load(job_of([first, fine]))
        found = [text for text in doubts_of_bands(job, cut_bands(job)) if "hardly any" in str(text)]
        assert bool(found) == warns
    pixel = 4 * LONG / 128
    assert all(f"long_wavelength: {8 * pixel:.2g}" in str(text) for text in found)


def test_heat_beyond_the_measurement() -> None:
    """Rubber at 40 C that is 30 K warmer in the contact was not measured to 60 C; without feedback it stays at 40 C."""
    surface = {"shape": "rough", "hurst": 0.8, "rms_slope": 0.2, "long_wavelength": LONG, "short_wavelength": LONG / 8}
    for feedback in ("mean", "none"):
        job = jobs.load(job_of(surface, thermal={"conductivity": 0.2, "diffusivity": 1e-7, "feedback": feedback}))
        point: Any = SimpleNamespace(temperature=40.0, speed=1.0, effects={"thermal": Flash(30.0, 50.0)})
        found = list(map(str, describe_unmeasured([point], job)))
        assert [bool(re.search("beyond the -20 to 60 C .* at 1 of 1 points, up to 70 C", text)) for text in found] == (
            [True] * (feedback == "mean")
        )


def test_heat_of_the_hottest_band(tmp_path: Path) -> None:
    """Each band has its own temperature: at 40 C on average 2 K warmer, one band leaves the measurement by 10 K; and
    one decomposes where the mean does not."""
    surface = {"shape": "rough", "hurst": 0.8, "rms_slope": 0.2, "long_wavelength": LONG, "short_wavelength": LONG / 8}
    job = jobs.load(job_of(surface, thermal={"conductivity": 0.2, "diffusivity": 1e-7, "feedback": "mean"}))
    for hottest, words, find in (
        (30.0, "at 1 of 1 points, up to 70 C", lambda points: describe_unmeasured(points, job)),
        (400.0, "of 1 of 1 points are above 200 K, up to 400 K", describe_hot),
    ):
        flash = flash_of_bands([1.0, hottest], [1.0, 1.0 / hottest])
        assert flash.mean < 2.5
        point: Any = SimpleNamespace(temperature=40.0, speed=1.0, effects={"thermal": flash})
        assert [words in str(doubt) for doubt in find([point])] == [True]


def test_a_spectrum_that_is_cut_off_is_not_asked_to_be() -> None:
    """The usual cut-off is no advice to a job that has it, whatever the rounding of the cut."""
    for hurst in (0.6, 0.8, 0.9, 0.95):
        for slope in (1.7, 2.0, 5.0):
            rough = {"shape": "rough", "hurst": hurst, "rms_slope": slope, "long_wavelength": LONG}
            surface = {**rough, "short_wavelength": LONG / 4096}
            for bands, kind in (("auto", "steep waves, cut-off"), ({"cutoff_slope": 1.3}, "steep waves")):
                job = jobs.load(job_of(surface, bands=bands))
                found = [doubt.kind for doubt in doubts_of_bands(job, cut_bands(job)) if "steep waves" in doubt.kind]
                assert found == [kind]


def test_the_report_shows_bands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a spectrum alone, and of a map with one: waves, slopes, pictures, and the band that matters at each point."""
    monkeypatch.chdir(tmp_path)
    table = {"shape": "rough", "spectrum": spectrum(tmp_path / "s.csv", LONG, LONG / 16), "seed": 1}
    Path("job.yaml").write_text(yaml.safe_dump(job_of([table], bands={"count": 2, "points": 36, "samples": 1})))
    assert main(["steady", "job.yaml", "--velocities", "0.1", "--temperatures", "20", "--quiet"]) == 0
    assert main(["report", "out/job"]) == 0
    shown = re.sub("<[^>]+>", " ", Path("out/job/report.html").read_text())
    assert "cannot be computed again" not in shown
    assert "the band with most of the friction" in shown
    assert "with all longer waves" in shown
    mapped = jobs.load(job_of([road_map(tmp_path / "road.npy", 128, 4 * LONG), table]))
    section = page.road_section(mapped)
    assert len(section.tables[1].rows) == cut_bands(mapped).count
    assert len(section.pictures) == 4


def test_plan_says_bands_and_contacts(tmp_path: Path) -> None:
    """Points, the contacts of each (surfaces of each band by its rungs, and hard walls), and a time."""
    surface = {"shape": "rough", "hurst": 0.8, "rms_slope": 0.2, "long_wavelength": LONG, "short_wavelength": LONG / 16}
    job = jobs.load(job_of(surface, bands={"count": 2, "points": 32, "samples": 3}))
    lines = list(plan_bands(job, Slab.alone(1, 1)))
    assert "bands: 2 of 0.6 decades" in lines[0]
    said = re.search(r"parcontact steady: (\d+) steady states of (\d+) contacts or more", "\n".join(lines))
    assert said is not None
    assert int(said[1]) == 4  # two velocities at two temperatures
    assert int(said[2]) == 4 * (14 + 1)  # one rung under the mean pressure alone, 14 below
    assert re.fullmatch(r"on 1 rank: [0-9.e+]+ s or more in all", lines[-1])


def test_the_start_of_a_slide_is_no_slip(monkeypatch: pytest.MonkeyPatch) -> None:
    """Distances are sums, so that the slip of the first row may be a rounding error: it has no place on a logarithm."""
    stages = [SimpleNamespace(seconds=seconds, speed=0.1, slides=True, name="") for seconds in (1.0, 2.0, 1.0)]
    distance = np.array([0.1 * 1.0 + 0.1 * 2.0 + 1e-16, 0.31, 0.4])  # a sum of floats is not 0.3
    table = {"distance": distance, "band": np.zeros(3)}
    run = SimpleNamespace(
        job=SimpleNamespace(history=stages),
        rows_of_stages=[[], [], [1, 2]],
        columns={"distance": distance, "friction": distance, "contact_area_corrected": distance},
        has=lambda name: False,
        read=lambda name: type("Table", (), {"__contains__": lambda *_: True, "arrays": lambda *_: table})(),
    )
    seen: list[Any] = []
    monkeypatch.setattr(band_charts, "_stacked", lambda columns, *_: seen.append(columns["slip"]))
    monkeypatch.setattr(band_charts, "_steady_of", lambda *_: ())
    band_charts.panels_of_slips(run)  # type: ignore[arg-type]
    assert seen[0] == pytest.approx([0.01, 0.1])
