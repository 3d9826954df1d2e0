"""The state of a run: a checkpoint restores all of it, and a step that fails leaves it alone."""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marched_jobs import begun, marched

from parcontact.errors import InputError
from parcontact.files import checkpoint
from parcontact.files.checkpoint import Facts
from parcontact.files.hdf5 import Link, Provenance
from parcontact.job.history import Timeline
from parcontact.job.listing import plain_data
from parcontact.march.loop import March, run_steps
from parcontact.march.state import parts_of
from parcontact.physics.records import Units

FIELDS = ("pressure", "displacement", "gap", "height")
ROUGH = {"shape": "rough", "hurst": 0.8, "long_wavelength": 5e-4, "short_wavelength": 1e-4, "rms_slope": 0.02}
SPHERE = {"shape": "sphere", "radius": 1e-2}
ELASTIC = {"model": "elastic", "shear_modulus": 1e6}
RUBBER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 2e6, "relaxation_time": 1e-3}]}
STANDS = [{"pressure": 5e3}, {"pressure": 1e4}]
SLIDES = [{"pressure": 1e4, "velocity": 0.1, "distance": 1e-4, "cells_per_step": 1}]
OBLIQUE = [{"pressure": 1e4, "velocity": [0.1, 0.07], "distance": 1e-4, "cells_per_step": 1}]
CHOSEN = [{"pressure": 1e4, "velocity": 0.1, "distance": 1e-4}]  # keeps pressures of some steps ago
STEADY = {"initial": {"state": "steady", "velocity": 0.1, "pressure": 1e4}, "output": {}}


def job(material: dict[str, Any], history: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    grid = {"points": 32, "size": 1e-3}
    data = {"grid": grid, "surface": ROUGH, "material": material, "history": history, "output": {"energy": True}}
    return data | more


CASES = [
    *(job(material, history) for material in (ELASTIC, RUBBER) for history in (STANDS, SLIDES, OBLIQUE)),
    job(RUBBER, SLIDES, numerics={"kernel": "love"}),
    job(RUBBER, CHOSEN),
    *(job(material, SLIDES, **STEADY) for material in (ELASTIC, RUBBER)),
]


def written(march: March, path: Path) -> Path:
    """A checkpoint of a march."""
    march.save(path, Facts(plain_data(march.scene.job), Provenance((Link("", 1),))))
    return path


@pytest.mark.parametrize("data", CASES)
def test_all_of_it_is_there_right_after_it_is_restored(tmp_path: Path, data: dict[str, Any]) -> None:
    """Every field, energy and entry, to the last bit; also where nothing has been made by the new run yet."""
    old, _ = marched(data)
    new = begun(data)
    new.restore(checkpoint.inspect(written(old, tmp_path / "step.h5")))
    for name in FIELDS:
        assert np.array_equal(new.field(name), old.field(name)), name
    for name in ("step", "time", "distance", "work", "stored", "dissipated", "branch_dissipation"):
        np.testing.assert_equal(getattr(new.row, name), getattr(old.row, name), name)
    entries = new.entries()
    assert entries.keys() == old.entries().keys()
    assert all(np.array_equal(entries[name].value, entry.value) for name, entry in old.entries().items())


@pytest.mark.parametrize(("off", "refused"), [(1e-9, True), (1e-14, False)])
def test_a_checkpoint_of_another_material_is_refused(tmp_path: Path, off: float, refused: bool) -> None:
    """A modulus that differs by 2 mPa of 2 MPa is another one, by its rounding it is not."""
    old, _ = marched(job(RUBBER, SLIDES))
    contents = checkpoint.inspect(written(old, tmp_path / "step.h5"))
    branch = RUBBER["branches"][0]  # type: ignore[index]
    new = begun(job({**RUBBER, "branches": [{**branch, "modulus": branch["modulus"] * (1.0 + off)}]}, SLIDES))
    with pytest.raises(InputError, match="is of another job: material/moduli was") if refused else nullcontext():
        new.restore(contents)


def test_further_pressures_are_named_by_their_age() -> None:
    """As the manual has them, of slides that choose their steps."""
    march = begun(job(RUBBER, CHOSEN))
    further = [name for name in march.entries() if name.startswith("contact/earlier pressure")]
    assert further == [f"contact/earlier pressure {ago}" for ago in (1, 2, 3)]


def test_a_checkpoint_may_lack_all_pressures_but_the_last() -> None:
    """Pressures that a checkpoint lacks are unknown: they have a modulus of 0, and no position."""
    march = begun(job(RUBBER, CHOSEN))
    part, contact = parts_of(march.scene)["contact"], march.state.contact
    entries = part.entries(contact, march.scene.units)
    needed = {name: entry for name, entry in entries.items() if not entry.optional}
    assert needed.keys() == {"approach", "pressure", "modulus", "position"}
    saved = {name: np.asarray(entry.value) for name, entry in needed.items()}
    saved |= {"modulus": np.array(2.0), "position": np.array([3.0, 4.0])}
    last, *others = part.restored(contact, saved).pressures
    assert last[1:] == (2.0, (3.0, 4.0))
    assert [past[1:] for past in others] == [(0.0, (0.0, 0.0))] * 3


def test_ways_in_a_checkpoint_are_in_metres(tmp_path: Path) -> None:
    """Where the surface was after the last steps of a slide along x, the latest first."""
    march, rows = marched(job(RUBBER, CHOSEN))
    contents = checkpoint.inspect(written(march, tmp_path / "step.h5"))
    names = ("contact/position", *(f"contact/earlier position {ago}" for ago in (1, 2, 3)))
    found = np.concatenate([contents.numbers[name] * contents.units[name] for name in names]).reshape(-1, 2)
    expected = [row.distance for row in rows[: -len(found) - 1 : -1]]
    np.testing.assert_allclose(found[:, 0], expected, rtol=1e-12)
    assert not found[:, 1].any()
    assert contents.numbers["row/distance"] * contents.units["row/distance"] == expected[0]


def in_si(march: March) -> dict[str, Any]:
    """All entries of a checkpoint, in SI units."""
    return {name: np.asarray(entry.value) * entry.unit for name, entry in march.entries().items()}


FREE = {"grid": {"points": 32, "size": 1e-3, "boundary": "free"}, "surface": SPHERE}
STICKS = {"coefficient": 0.3, "stick": True}
ADDED = [
    *({}, FREE, {"thermal": {"conductivity": 0.3, "diffusivity": 1e-7}}, {"interface": STICKS}),
    {**FREE, "adhesion": {"work": 1e-3, "range": 1e-7}},
]


@pytest.mark.parametrize(("material", "added"), [(ELASTIC, {}), *((RUBBER, added) for added in ADDED)])
def test_units_change_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, material: dict[str, Any], added: dict[str, Any]
) -> None:
    """A run in units that are powers of two times the usual ones, and a checkpoint restored in them: to the last bit,
    in SI units."""
    data = job(material, SLIDES, **added)
    old, _ = marched(data)
    own = old.scene.units
    other = replace(own, height=2.0 * own.height, length=8.0 * own.length, modulus=4.0 * own.modulus)
    monkeypatch.setattr(Units, "near", lambda *_: other)
    (march, _), restored = marched(data), begun(data)
    restored.restore(checkpoint.inspect(written(old, tmp_path / "step.h5")))
    for new in (march, restored):
        assert new.scene.units == other
        np.testing.assert_equal(in_si(new), in_si(old))
        for name in FIELDS:
            assert np.array_equal(new.field(name), old.field(name)), name
        for name in ("distance", "work", "stored", "dissipated", "branch_dissipation"):
            np.testing.assert_equal(getattr(new.row, name), getattr(old.row, name), name)


@pytest.mark.parametrize("integrator", ["exponential", "backward-euler"])
@pytest.mark.parametrize("precision", ["mixed", "double"])
def test_to_save_a_run_does_not_change_it(tmp_path: Path, precision: str, integrator: str) -> None:
    """A checkpoint after every step, of one branch and of three: what comes is what would come, to the last bit."""
    branches = [{"modulus": 9e6 / 4**k, "relaxation_time": 1e-3 / 4**k} for k in range(3)]
    history = [{"pressure": 1e4, "duration": 1e-3, "time_step": 1e-4}, {**SLIDES[0], "distance": 2e-4}]
    wave = {"shape": "wave", "amplitude": 1e-6, "waves": [2, 1]}
    numerics = {"precision": precision, "integrator": integrator}
    for count in (1, 3):
        material = {"model": "zener", "modulus_inf": 1e6, "branches": branches[:count]}
        whole, saved = (begun(job(material, history, surface=wave, numerics=numerics)) for _ in range(2))
        for step in Timeline.from_job(whole.scene.job):
            whole.advance(step)
            saved.advance(step)
            written(saved, tmp_path / "step.h5")
            assert saved.row.measures == whole.row.measures, step.number
        assert all(np.array_equal(whole.field(name), saved.field(name)) for name in FIELDS)


@pytest.mark.parametrize("material", [ELASTIC, RUBBER])
def test_a_start_from_steady_sliding_is_a_state_like_any_other(material: dict[str, Any]) -> None:
    """The gap is closed where there is pressure, and nowhere less, to the tolerance."""
    march = begun(job(material, SLIDES, **STEADY))
    gap, pressed = march.field("gap"), march.field("pressure") > 0.0
    limit = march.scene.job.numerics.tolerance * march.scene.setup.height
    assert 0.0 < np.mean(pressed) < 1.0
    assert gap.min() > -limit
    assert np.mean(np.abs(gap[pressed])) < 2.0 * limit


@pytest.mark.parametrize(("boundary", "surface"), [("periodic", ROUGH), ("free", ROUGH), ("free", SPHERE)])
def test_without_load_the_surface_just_touches(boundary: str, surface: dict[str, Any]) -> None:
    """Before the first step as after one that takes the load away: no gap is negative, the smallest is 0. The mean of
    a rough surface is 0, that of a sphere is not.

    To the rounding of heights in double precision.
    """
    unloads = [{"pressure": 5e3}, {"pressure": 0.0}]
    grid = {"points": 32, "size": 1e-3, "boundary": boundary}
    march = begun(job(ELASTIC, unloads, grid=grid, surface=surface, output={}))
    before, gaps, height = march.row.measures, march.field("gap"), np.ptp(march.field("height"))
    assert abs(gaps.min()) <= 1e-12 * height
    assert before.mean_gap == pytest.approx(gaps.mean(), rel=1e-12)
    run_steps(march, ())
    after = march.row.measures
    assert np.allclose(march.field("gap"), gaps, rtol=0.0, atol=1e-9 * height)
    assert not march.field("pressure").any()
    assert not march.field("displacement").any()
    assert after.friction == 0.0
    assert (before.approach, before.mean_gap) == pytest.approx((after.approach, after.mean_gap), rel=1e-9)
