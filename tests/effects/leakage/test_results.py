"""Between which loads leakage stops, in the sentences of `leak`, `info`, report and headline."""

import math
from pathlib import Path

import pytest
import yaml

from parcontact import __main__
from parcontact.effects.leakage import results
from parcontact.printed import span
from parcontact.results import info, page
from parcontact.results.results import Results

LENGTH, MODULUS, CLOSING = 2.5e-4, 1.0e6, 1.0e5  # of the wave [m], G [Pa], pressure of full contact [Pa]
AMPLITUDE = CLOSING * LENGTH / (math.pi * 4 * MODULUS)  # Westergaard (1939): p* = pi E* A/lambda, E* = 4 G


def press(directory: Path, shares: list[float], **more: object) -> Path:
    """Waves along x under these shares of the pressure that closes them, with the flow at each instant."""
    job = {
        "grid": {"points": [64, 4], "size": [4 * LENGTH, LENGTH / 4]},
        "surface": {"shape": "wave", "amplitude": AMPLITUDE, "waves": [4, 0]},
        "material": {"model": "elastic", "shear_modulus": MODULUS},
        "history": [{"pressure": share * CLOSING} for share in shares],
        "output": {"directory": str(directory / "out"), "fields": ["pressure", "gap"]},
    }
    (directory / "job.yaml").write_text(yaml.safe_dump(job | more))
    assert __main__.main([str(directory / "job.yaml"), "--quiet"]) == 0
    return directory / "out"


ALONG_Y = "leakage along y stops between 95 and 105 kPa"  # the pressures next to that of full contact


def test_waves_close_at_the_pressure_of_full_contact(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Along the grooves at p*, across them from the first contact on; from the run's own table, and from `leak`."""
    out = press(tmp_path, [0.5, 0.95, 1.05, 1.5], leakage={"every": 1})
    across = "leakage along x has already stopped at the first instant, under 50 kPa"
    assert results.describe_leak_stop(Results(out, "run")) == [across, ALONG_Y]
    assert __main__.main(["leak", str(out)]) == 0
    assert results.describe_leak_stop(Results(out, "run")) == [across, ALONG_Y]
    printed = capsys.readouterr().out
    half = "along y leakage stops between 95 and 105 kPa; along y contact closes the gap at 2 of 4 instants, "
    assert f"{half}at the first with 100 % of the area in contact" in printed
    assert f"; {ALONG_Y}" in info.find_headline(out)
    assert f"<p>{page.whole_numbers(ALONG_Y)}</p>" in page.render([out])
    assert __main__.main(["info", str(out)]) == 0
    assert f"  {ALONG_Y}\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("flows", "pressures", "said"),
    [
        ([3e-18, 0.0], [1.05e6, 1.1e6], "stops between 1.05 and 1.10 MPa"),
        ([3e-18, 0.0], [1e6, 1e6], "stops between 1 and 2 h, under 1 MPa"),
        ([math.nan, 3e-18, math.nan, 0.0], [1.0e6, 1.04e6, 1.05e6, 1.1e6], "stops between 1.04 and 1.10 MPa"),
        ([3e-18, 0.0, 2e-18, 0.0], [1e6, 2e6, 1e6, 3e6], "stops between 1 and 2 MPa"),
        (
            [3e-18, 0.0, 0.0, 2e-18],
            [1e6, 2e6, 3e5, 2e5],
            "stops between 1 and 2 MPa, and begins again between 200 and 300 kPa",
        ),
        (
            [0.0, 2e-18],
            [1e6, 1e6],
            "has already stopped at the first instant, under 1 MPa, and begins again between 1 and 2 h, under 1 MPa",
        ),
        ([0.0, 0.0], [1e6, 2e6], "has already stopped at the first instant, under 1 MPa"),
        ([3e-18, 1e-18], [2e6, 1e6], "does not stop up to 2 MPa"),
        ([math.nan, math.nan], [1e6, 2e6], ""),
    ],
)
def test_where_leakage_stops(flows: list[float], pressures: list[float], said: str) -> None:
    times = [3600.0 * (1 + row) for row in range(len(flows))]
    assert results.describe_axis({"flow_x": flows, "pressure": pressures, "time": times}, "x") == said


OPENED = "the seal opens between 1 and 2 MPa of the fluid, under 3 MPa"


@pytest.mark.parametrize(
    ("flows", "lows", "rates", "said"),
    [
        ([0.0, 2e-18], [0.0, 0.0], [math.nan] * 2, [OPENED, "7e-09 kg/s leak through the box between 0 Pa and 2 MPa"]),
        ([0.0, 2e-18], [1e6, 2e6], [0.0, 0.0], [OPENED]),
        ([0.0, 0.0], [0.0, 0.0], [math.nan] * 2, ["contact closes the seal in all steps"]),
    ],
    ids=["into a vacuum", "without a drop of pressure", "closed"],
)
def test_a_seal_without_a_flow_rate(
    flows: list[float], lows: list[float], rates: list[float], said: list[str], tmp_path: Path
) -> None:
    """A gas into a vacuum has a mass flow alone; a seal may open while both pressures are equal."""
    head = "time,pressure,high_pressure,low_pressure,flow_x,flow_rate,mass_flow,error_x,error_rounds,error_leak"
    rows = zip(lows, flows, rates, strict=True)
    text = [f"{k},3e6,{k + 1}e6,{low},{flow},{rate},7e-9,0.1,,0.1" for k, (low, flow, rate) in enumerate(rows)]
    (tmp_path / "measures.csv").write_text("\n".join([head, *text, ""]))
    found = list(results.said_at_end(Results(tmp_path, "run")))
    assert [sentence.split(", at t")[0] for sentence in found] == said


def test_directions_that_agree_share_a_sentence(tmp_path: Path) -> None:
    text = "time,pressure,flow_x,flow_y\n0,1.05e6,1e-18,2e-18\n1,1.1e6,0,0\n"
    (tmp_path / "leak.csv").write_text(text)
    assert results.describe_leak_stop(Results(tmp_path, "run")) == [
        "leakage along x and y stops between 1.05 and 1.10 MPa"
    ]
    assert results.describe_leak_stop(Results(tmp_path / "nowhere", "run")) == []


@pytest.mark.parametrize(
    ("low", "high", "unit", "said"),
    [
        (1.05e6, 1.1e6, "Pa", "1.05 and 1.10 MPa"),
        (1.0501e6, 1.0502e6, "Pa", "1.0501 and 1.0502 MPa"),
        (9e5, 1.1e6, "Pa", "0.9 and 1.1 MPa"),
        (1e7, 1.2e8, "Pa", "10 and 120 MPa"),
        (1e3, 1e6, "Pa", "1 kPa and 1 MPa"),
        (2e5, 3e7, "Pa", "200 kPa and 30 MPa"),
        (0.0, 1e6, "Pa", "0 Pa and 1 MPa"),
        (-2e6, -1e6, "Pa", "-2 and -1 MPa"),
        (3600.0, 7200.0, "s", "1 and 2 h"),
    ],
)
def test_two_numbers_in_one_unit(low: float, high: float, unit: str, said: str) -> None:
    assert span(low, high, unit) == said
