"""Flows under a load of which the fluid carries its part: against closed forms of a wavy channel, and refusals."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from csv_rows import rows as table
from mpi4py import MPI
from numpy.typing import NDArray

from parcontact import __main__
from parcontact.effects.leakage import over_time
from parcontact.effects.leakage.flow import FLUIDS, PressureDrop
from parcontact.errors import InputError
from parcontact.results import info

LENGTH, MODULUS, CLOSING = 2.5e-4, 1.0e6, 1.0e5  # of the wave [m], G [Pa], pressure of full contact p* [Pa]
AMPLITUDE = CLOSING * LENGTH / (math.pi * 4 * MODULUS)  # Westergaard (1939): p* = pi E* A/lambda, E* = 4 G
LOW = 1.0e5  # pressure at the end of the channel [Pa]


def gap(load: float) -> NDArray[np.float64]:
    """Gaps [m] of a wave under a mean pressure, at equal distances from crest to trough (Westergaard)."""
    share = math.sqrt(load / CLOSING)
    x = np.sin(0.5 * math.pi * (np.arange(4000) + 0.5) / 4000)
    r = np.sqrt(np.maximum(x**2 - share**2, 0.0))
    shape = x * r - share**2 * np.log(np.maximum(x + r, share) / share)
    return np.where(x > share, 2.0 * AMPLITUDE * shape, 0.0)


def exact(conductance: Callable[[float, float], float], load: float, drop: float) -> float:
    """The mean over p, from LOW to LOW + drop, of a conductance at a load and at p: Gauss's rule of 20 points."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    over = 0.5 * drop * (nodes + 1.0)
    return 0.5 * sum(w * conductance(load - dp, LOW + dp) for w, dp in zip(weights, over, strict=True))


def channel(where: Path, loads: list[float], comm: MPI.Intracomm = MPI.COMM_SELF, **more: Any) -> Path:
    """A wave along x under these loads [Pa], with its gaps; channels run along y."""
    job = {
        "grid": {"points": [512, 4], "size": [LENGTH, LENGTH / 64]},
        "surface": {"shape": "wave", "amplitude": AMPLITUDE, "waves": [1, 0]},
        "material": {"model": "elastic", "shear_modulus": MODULUS},
        "history": [{"pressure": float(load)} for load in loads],
        "numerics": {"tolerance": 1e-8},  # near closure the gaps are small against the wave
        "output": {"directory": str(where / "out"), "fields": ["pressure", "gap"]},
    }
    if comm.rank == 0:
        (where / "job.yaml").write_text(yaml.safe_dump(job | more))
    comm.Barrier()
    assert __main__.main([str(where / "job.yaml"), "--quiet"]) == 0
    comm.Barrier()
    return where / "out"


def leak(out: Path, drop: float, *more: str, fluid: str = "0.1") -> int:
    return __main__.main(
        ["leak", str(out), "--fluid", fluid, "--pressures", f"{LOW + drop!r}:{LOW!r}", "--load", "total", *more]
    )


@pytest.mark.parametrize(("load", "drop"), [(0.8, 0.3), (0.9, 0.4), (0.85, 0.5)])
def test_a_channel_with_six_loads(load: float, drop: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Within 5 % of the integral over the closed form; the flow under a net load is too small by the stated factor."""
    load, drop = load * CLOSING, drop * CLOSING
    out = channel(tmp_path, list(np.linspace(load - drop, load, 6)))
    capsys.readouterr()
    assert leak(out, drop) == 0
    printed, row = capsys.readouterr().out, table(out / "leak.csv")[-1]
    factor = 12 * 0.1 * (LENGTH / 64) / LENGTH / drop
    total, net = exact(lambda at, _: float(np.mean(gap(at) ** 3)), load, drop), np.mean(gap(load) ** 3)
    assert float(row["flow_rate_total"]) * factor == pytest.approx(total, rel=0.05)
    factors = re.findall(r"along y the pressure of the fluid opens the gap.* by a factor of ([^ ,]+),", printed)
    assert float(factors[0]) == pytest.approx(total / net, rel=0.1)
    assert "K is known" not in printed
    rate = float(row["flow_rate_total"]) / float(row["flow_rate"])
    assert f"m³/s leak if the fluid carries its part of the load, {rate:.3g} times" in info.find_headline(out)


def test_a_gas_slips_at_the_local_pressure() -> None:
    """The mass flow of nitrogen, over 12 eta R T L/M, is that of Gauss's rule for the integral of K p over the closed
    form, and K over the mean pressure, without a load on contact."""
    load, drop = 0.9 * CLOSING, 0.4 * CLOSING
    gas = PressureDrop(FLUIDS["nitrogen"], LOW + drop, LOW, total=True)
    path = FLUIDS["nitrogen"].mean_free_path(1.0)  # at 1 Pa

    def conductance(at: float, p: float) -> float:
        return float(np.mean(gap(at) ** 2 * (gap(at) * p + 6.0 * path)))

    loads = np.linspace(load - drop, load, 6)
    flows = [[np.mean(gas.conducting_gap(gap(at), p) ** 3) for p in gas.pressures] for at in loads]
    found = over_time.load_curve(loads, flows).conductivity(gas, load)
    assert found * gas.pressures[0] == pytest.approx(exact(conductance, load, drop), rel=0.01)  # six loads
    fixed = over_time.load_curve(loads, [flows[0]] * 6).conductivity(gas, load)  # K without the load: int K p dp
    whole = np.mean(gap(loads[0]) ** 2 * (gap(loads[0]) + 6.0 * path / gas.pressures[0]))
    assert fixed == pytest.approx(whole, rel=1e-9)


def test_equal_pressures_change_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A drop of a thousandth of the load: the flow changes by as little as K does, 1.6 % (seven times as steep)."""
    out = channel(tmp_path, [0.7e5, 0.8e5])
    capsys.readouterr()
    for fluid in ("0.1", "helium"):
        assert leak(out, 80.0, fluid=fluid) == 0
        printed, row = capsys.readouterr().out, table(out / "leak.csv")[-1]
        for name in ("flow_rate", "mass_flow"):
            if row[name]:
                assert float(row[f"{name}_total"]) == pytest.approx(float(row[name]), rel=0.016)
        assert "the pressure of the fluid changes the flow by" in printed


def test_an_ambient_pressure_shifts_the_loads(tmp_path: Path) -> None:
    """Over the high pressure as ambient one, contact carries the load at the high side, and more at the low side."""
    loads = list(np.linspace(0.5e5, 0.9e5, 9))
    out = channel(tmp_path, loads)
    assert leak(out, 2.0e4) == 0
    rows = {round(float(row["pressure"])): row["flow_rate_total"] for row in table(out / "leak.csv")}
    assert leak(out, 2.0e4, "--ambient", str(LOW + 2.0e4)) == 0
    shifted = {round(float(row["pressure"])): row["flow_rate_total"] for row in table(out / "leak.csv")}
    pairs = [(value, rows[key + 20000]) for key, value in shifted.items() if value]
    assert len(pairs) == 5
    assert all(float(one) == pytest.approx(float(other), rel=1e-9) for one, other in pairs)


def test_few_loads_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Three loads in the range; the two lower rows lack theirs. Unloading an elastic body changes no number."""
    out = channel(tmp_path, [0.4e5, 0.6e5, 0.8e5])
    capsys.readouterr()
    assert leak(out, 0.4e5) == 0
    printed, last = capsys.readouterr().out, table(out / "leak.csv")[-1]
    assert "K is known at 3 of the local loads between 40 and 80 kPa" in printed
    assert "save the gap under 40, 48, 56, 64, 72 and 80 kPa" in printed
    assert "flow_rate_total is left empty under 2 of 3 loads, under 1 of which the fluid lifts the seal off" in printed
    assert [bool(row["flow_rate_total"]) for row in table(out / "leak.csv")][-3:] == [False, False, True]
    (tmp_path / "back").mkdir()
    back = channel(tmp_path / "back", [0.4e5, 0.8e5, 0.6e5, 0.8e5])
    assert leak(back, 0.4e5) == 0
    assert float(table(back / "leak.csv")[-1]["flow_rate_total"]) == pytest.approx(
        float(last["flow_rate_total"]), rel=1e-4
    )


COARSE = {"points": [32, 4], "size": [LENGTH, LENGTH / 8]}
ZENER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1.0}]}


@pytest.mark.mpi(2)
def test_what_is_refused(comm: MPI.Intracomm, shared_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Loads outside the saved range, a seal that lifts off, one instant, no fluid: exit code 2 on all ranks, and no
    table."""
    out = channel(shared_path, [0.6e5, 0.8e5], comm)
    for drop, more, said in (
        (
            3.0e4,
            (),
            "needs K between 50 and 80 kPa, and the saved loads lie between 60 and 80 kPa: save the gap under 50,",
        ),
        (9.0e4, (), "lifts the seal off: the highest saved load is 80 kPa"),
        (1.0e4, ("--at", "1"), "--load total needs all saved loads: leave out --at"),
    ):
        capsys.readouterr()
        assert leak(out, drop, *more) == 2
        assert comm.rank > 0 or said in capsys.readouterr().err
        assert not (out / "leak.csv").exists()
    assert __main__.main(["leak", str(out), "--load", "total"]) == 2
    assert __main__.main(["leak", str(out), "--ambient", "1e5"]) == 2
    comm.Barrier()
    assert leak(out, 1.0e4) == 0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {
                "grid": COARSE,
                "material": ZENER,
                "history": [{"pressure": load, "duration": 1.0} for load in (4e4, 6e4, 4e4)],
            },
            "the body relaxes between the saved instants",
        ),
        ({"grid": COARSE, "adhesion": {"work": 1e-3, "range": 1e-6}}, "contact depends on its history"),
    ],
)
def test_rows_that_depend_on_more_than_the_load(
    changes: dict[str, Any], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = channel(tmp_path, [0.4e5, 0.6e5], **changes)
    capsys.readouterr()
    assert leak(out, 1.0e4) == 2
    assert f"needs K as a function of the load, but {said}" in capsys.readouterr().err


def test_loads_at_one_instant_of_a_viscoelastic_body(tmp_path: Path) -> None:
    """It is elastic then, of the modulus at once."""
    assert leak(channel(tmp_path, [0.4e5, 0.6e5], material=ZENER), 1.0e4) == 0


def test_k_that_rises_is_refused() -> None:
    """Two values at one load, or one that rises with the load."""
    for loads, flows in (([1.0, 2.0, 2.0], [3.0, 2.0, 1.5]), ([1.0, 3.0, 2.0], [3.0, 2.0, 1.5])):
        with pytest.raises(InputError, match="save the gap of one loading, without unloading"):
            over_time.load_curve(loads, [[flow] for flow in flows])


def test_the_net_flow_says_what_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Where the drop of pressure is above a tenth of the load."""
    out = channel(tmp_path, [0.6e5])
    for drop, stated in ((1.0e4, True), (1.0e3, False)):
        capsys.readouterr()
        assert __main__.main(["leak", str(out), "--fluid", "0.1", "--pressures", f"{LOW + drop}:{LOW}"]) == 0
        assert ("contact carries all of the load, 60 kPa" in capsys.readouterr().out) is stated
