"""`parcontact leak`: the flow through the saved gaps of a run, as leak.csv and a picture.

The load p0 is measured above the ambient pressure p_a. If the fluid, at the local pressure p, carries a part of the
load, contact carries the rest, the local load p0 - (p - p_a). In a long seal the conductivity K at a place depends on
the local load at this place. K is known for the loads that a run has saved. With the length L of the seal, the flow per
width is

    liquid     1/(12 eta L) int K(p0 + p_a - p) dp,
    gas        M/(12 eta R T L) int K(p0 + p_a - p) p dp    [kg/(m s)],

integrated from the low to the high pressure; the other symbols are those of `flow`. K of a gas includes the slip at the
pressure p. In this module K of a gas is multiplied by p and divided by the mean pressure, so that both integrals have
the same form. Between loads the logarithm of K is interpolated without new extrema (F. N. Fritsch and R. E. Carlson,
SIAM J. Numer. Anal. 17 (1980) 238). Between pressures K is interpolated by a parabola, as it is almost linear in p.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from ...columns import choose_columns, names_of, to_csv, values_of
from ...errors import InputError
from ...files import files, hdf5, outputs
from ...job import reading
from ...job.reading import shown_job
from ...march import scene
from ...parallel.root import on_root
from ...parallel.slab import MPI, Slab
from ...printed import per_cent, prefixed, quantity, span, stated_error
from ...results.plotted_run import Fields, PlottedRun
from ...results.results import Results
from ..effect import touching_of
from . import LEAK, pictures, results
from .flow import FloatMap, Flow, Leak, PressureDrop, flow_mesh_error, leak, least_section, solve_flow

Array = NDArray[np.float64]
LOADS = 6  # accuracy: loads in the integral; in a wavy channel three leave errors of 1 to 20 %, six less than 1 %
POINTS = 2001  # accuracy: of the integral; errors of 1e-6
SAME = 1e-3  # accuracy: relative difference below which loads count as the same
RISE = 0.01  # accuracy: relative rise of K over the load above which K depends on more than the load
NOTABLE = 1.1  # ratio of both flows above which a sentence tells them apart


@dataclass(frozen=True)
class LoadCurve:
    """Conductivities of a gap as a function of the load.

    `loads` [Pa] rise, shape (n,). `flows` [m^3], shape (n, m), are the conductivities at these loads and at the m
    pressures `PressureDrop.pressures` of a fluid; they are 0 where contact closes the gap.
    """

    loads: Array
    flows: Array

    def covers(self, least: float, most: float) -> bool:
        """Return True if the saved loads cover the range from `least` to `most` [Pa]."""
        slack = SAME * most
        return bool(least > 0.0 and self.loads[0] <= least + slack and most <= self.loads[-1] + slack)

    def inside(self, least: float, most: float) -> int:
        """Return the number of saved loads between `least` and `most` [Pa]."""
        return int(np.count_nonzero((self.loads >= least - SAME * most) & (self.loads <= most + SAME * most)))

    def conductivity(self, drop: PressureDrop, load: float) -> float:
        """Return the mean conductivity [m^3] of a seal under a `load` [Pa] of which the fluid carries a part; the flow
        follows from this conductivity by `PressureDrop.flow_rate`. Return NaN if the saved loads do not cover all local
        loads."""
        least, most = drop.local_loads(load)
        if not self.covers(least, most):
            return np.nan
        share = np.linspace(0.0, 1.0, POINTS)
        at = self._at(np.clip(most - share * (most - least), self.loads[0], self.loads[-1]))
        ends = (4.0 * share * (1.0 - share), (1.0 - share) * (1.0 - 2.0 * share), share * (2.0 * share - 1.0))
        local = sum(part * k for part, k in zip(ends, at.T, strict=True)) if at.shape[1] > 1 else at[:, 0]
        return float(np.trapezoid(local, share))

    def _at(self, loads: Array) -> Array:
        """Return the conductivities at local loads; 0 above the last load that leaves the gap open."""
        opened = int(np.count_nonzero(self.flows[:, 0]))
        if opened < 2:
            return np.where(loads[:, None] <= self.loads[0], self.flows[0], 0.0)
        last = self.loads[opened - 1]
        logs = PchipInterpolator(self.loads[:opened], np.log(self.flows[:opened]))(np.minimum(loads, last))
        return np.where(loads[:, None] <= last, np.exp(logs), 0.0)


def load_curve(loads: ArrayLike, flows: ArrayLike) -> LoadCurve:
    """Return the curve through conductivities [m^3], shape (n, m), at the saved loads [Pa], shape (n,). Only loads
    above 0 are used. Raises InputError if no load is above 0, or if K does not fall as the load rises."""
    given = np.asarray(loads, dtype=float)
    kept = np.flatnonzero(given > 0.0)
    order = kept[np.argsort(given[kept], kind="stable")]
    load, flow = given[order], np.asarray(flows, dtype=float)[order]
    if not load.size:
        raise InputError("--load total needs the gap at loads above 0, and none is saved")
    same, change = np.diff(load) <= SAME * load[1:], np.diff(flow[:, 0])
    wrong = np.where(same, np.abs(change), change) > RISE * np.maximum(flow[1:, 0], flow[:-1, 0])
    if wrong.any():
        at = int(np.argmax(wrong))
        between = span(float(load[at]), float(load[at + 1]), "Pa")
        raise InputError(
            f"--load total needs K as a function of the load, and K does not fall between {between}: save the gap of "
            "one loading, without unloading"
        )
    last = np.append(~same, True)
    return LoadCurve(load[last], flow[last])


def refuse_uncovered(curve: LoadCurve, drop: PressureDrop, loads: Sequence[float]) -> None:
    """Raise InputError if for each of the `loads` [Pa] some local loads are outside the range of the saved loads."""
    if not any(curve.covers(*drop.local_loads(load)) for load in loads):
        highest = float(curve.loads[-1])
        least, most = drop.local_loads(highest)
        if least <= 0.0:
            raise InputError(
                f"the fluid's pressure, {quantity(drop.high - drop.outside, 'Pa')} over the ambient one, lifts the "
                f"seal off: the highest saved load is {quantity(highest, 'Pa')}; save higher loads"
            )
        raise InputError(
            f"--load total under {quantity(highest, 'Pa')} needs K between {span(least, most, 'Pa')}, and the saved "
            f"loads lie between {span(float(curve.loads[0]), highest, 'Pa')}: {_advice(least, most)}"
        )


def describe_cover(curve: LoadCurve, drop: PressureDrop, loads: Sequence[float], shown: float) -> Iterator[str]:
    """Yield a sentence if the flow is unknown for some of the `loads` [Pa], as some of their local loads are outside
    the range of the saved loads. Rows of leak.csv for these loads lack the flow. Yield another sentence if too few
    saved loads lie within the local loads of the load `shown` [Pa]."""
    ends = [drop.local_loads(load) for load in loads if load > 0.0]
    empty = [end for end in ends if not curve.covers(*end)]
    if empty:
        lifted = sum(least <= 0.0 for least, _ in empty)
        off = f", under {lifted} of which the fluid lifts the seal off" if lifted else ""
        needed = span(max(0.0, min(least for least, _ in empty)), max(most for _, most in empty), "Pa")
        saved = span(float(curve.loads[0]), float(curve.loads[-1]), "Pa")
        yield (
            f"flow_rate_total is left empty under {len(empty)} of {len(ends)} loads{off}: it needs K at loads between "
            f"{needed}, and those saved lie between {saved}"
        )
    least, most = drop.local_loads(shown)
    if (count := curve.inside(least, most)) < LOADS:
        there = f"K is known at {count} of the local loads between {span(least, most, 'Pa')}"
        yield f"{there}, and three leave errors of up to 20 %: {_advice(least, most)}"


def _advice(least: float, most: float) -> str:
    """Return the advice to save six loads in a range [Pa]."""
    unit, size = prefixed("Pa", most)
    values = [f"{load / size:.4g}" for load in np.linspace(least, most, LOADS)]
    return f"save the gap under {', '.join(values[:-1])} and {values[-1]} {unit}, as stages of the history"


def describe_part(axis: str, net: float, total: float) -> str:
    """Return a sentence on how the pressure of the fluid changes the flow along an axis. `net` is the conductivity
    [m^3] if contact carries all of the load, and `total` the conductivity if the fluid carries a part of it."""
    if not total:
        return f"along {axis} contact closes the gap, also if the fluid carries its part of the load"
    if not net:
        return (
            f"along {axis} contact closes the gap if it carries all of the load, and the pressure of the fluid opens it"
        )
    ratio = total / net
    if 1.0 / NOTABLE <= ratio <= NOTABLE:
        return f"along {axis} the pressure of the fluid changes the flow by {per_cent(abs(ratio - 1.0))}"
    does, wrong, factor = ("opens", "small", ratio) if ratio > 1.0 else ("closes", "large", 1.0 / ratio)
    return (
        f"along {axis} the pressure of the fluid {does} the gap: flow_rate_total holds if the fluid carries its part "
        f"of the load, and flow_rate, too {wrong} then by a factor of {factor:.3g}, only if the load of the job is net "
        "of it"
    )


NEEDS = "leakage needs the gap and where contact is: output: {fields: [pressure, gap]} saves both"
UNEQUAL = 0.1  # accuracy: pressure drop over the load, above which the part of the load that a fluid carries matters
MOST_CELLS = 4e6  # tuning: largest map of which every rank solves one; 2048 x 2048 takes 1.4 GB


class LeakInstant(NamedTuple):
    """One row of leak.csv, the flow at one saved instant.

    `flow_x` and `flow_y` are the conductivities K [m^3] along x and y. `share_x` and `share_y` are their ratios to K of
    the undeformed surface that just touches, NaN if unknown. `constriction` [m] is the larger of the critical
    constrictions `constriction_x` and `constriction_y`. `error_x` and `error_y` are the relative changes of K if the
    mesh is halved (`flow.flow_mesh_error`).

    `flow_rate` [m^3/s] and `mass_flow` [kg/s] are the flow of a fluid in the direction with the larger constriction, if
    contact carries all of the load. `flow_rate_total` and `mass_flow_total` are this flow if the fluid carries a part
    of the load. Flows that were not asked for are NaN. `parts` has a pair of conductivities for the fluid [m^3] along
    x, and a pair along y. The first conductivity of a pair is for a contact that carries all of the load, the second
    for a fluid that carries a part of the load. `parts` is empty if the second conductivities were not asked for.
    """

    time: float
    pressure: float
    contact_area: float
    flow_x: float
    flow_y: float
    percolates_x: int
    percolates_y: int
    constriction: float
    share_x: float
    share_y: float
    constriction_x: float
    constriction_y: float
    error_x: float
    error_y: float
    flow_rate: float = np.nan
    mass_flow: float = np.nan
    flow_rate_total: float = np.nan
    mass_flow_total: float = np.nan
    parts: tuple[tuple[float, float], ...] = ()


class SolvedLeak(NamedTuple):
    """The flow at an instant, without maps. `errors`, `of_fluid` and `sections` are pairs, for x and y. `errors` are
    the relative mesh errors of K. `of_fluid` has the conductivities [m^3] for a fluid with slip, at each of
    `PressureDrop.pressures`. `sections` are the smallest open sections [m^2]."""

    leak: Leak
    errors: tuple[float, float]
    of_fluid: tuple[tuple[float, ...], tuple[float, ...]]
    sections: tuple[float, float]


class Gaps:
    """The saved gaps of a run in `directory`: at the instant `at`, or at all instants if `at` is ''. `drop` is the
    pressure drop of a fluid. Raises InputError if no gap is saved."""

    def __init__(self, directory: Path, at: str = "", drop: PressureDrop | None = None) -> None:
        self.drop = drop
        if not (directory / outputs.RUN.table).is_file():
            sweep = "output directory of a run; those of a sweep are in its cases/"
            raise InputError(f"{directory} is no {sweep if directory.is_dir() else 'directory'}")
        job = self.job = shown_job(directory / outputs.RUN.resolved)
        self.directory, self.results = directory, Results(directory, "run", job)
        self.size, self.periodic = job.grid.size, job.grid.cyclic
        self.cells = job.grid.nx * job.grid.ny
        self.columns = self.results.table
        try:
            with self.results.open_maps() as file:
                if not {"gap", "pressure"} <= set(file):
                    raise InputError(f"{directory / outputs.RUN.maps}: {NEEDS}")
                self.fields = Fields(file, at)
                self.shown = self.fields.shown
        except hdf5.FAILURES as error:
            raise InputError(f"{directory / outputs.RUN.maps} cannot be read: {files.reason(error)}; {NEEDS}") from None
        if not self.shown:
            raise InputError(f"{directory}: no map is saved yet")

    def read(self, index: int) -> FloatMap:
        """Return the map of the gap [m], shape (ny, nx), at a saved instant; the gap is 0 in contact. Raises InputError
        if the saved maps are incomplete."""
        with self.results.open_maps() as file:
            gap, pressure = file["gap"][index], file["pressure"][index]
        if gap.shape != pressure.shape or not (np.isfinite(gap).all() and np.isfinite(pressure).all()):
            step = self.fields.steps[index]
            raise InputError(
                f"{self.directory / outputs.RUN.maps}: the maps after step {step} are incomplete or not finite"
            )
        return np.where(touching_of(self.job, pressure, gap), 0.0, np.maximum(gap, 0.0))

    def bare(self) -> FloatMap:
        """Return the map of the gap [m] under the undeformed surface that just touches, shape (ny, nx). Raises
        InputError if the heights of the surface cannot be made."""
        job = reading.load(self.directory / outputs.RUN.resolved)
        setup = scene.set_up(job, Slab.alone(*job.grid.points))
        heights = setup.surface.heights((0.0, 0.0), setup.slab.empty()) * setup.units.height
        return np.asarray(heights.max() - heights, dtype=float)

    def solve(self, index: int) -> tuple[SolvedLeak, list[FloatMap]]:
        """Return the flow at a saved instant, and maps of the local flow along x and along y for pictures."""
        gap, flows, errors, shown = self.read(index), list[Flow](), list[float](), list[FloatMap]()
        of_fluid, sections = list[tuple[float, ...]](), list[float]()
        for axis in ("x", "y"):
            flow = solve_flow(gap, self.size, axis, self._sides(axis))
            shown.append(pictures.flux(gap, flow.pressure, self.size))
            sections.append(least_section(gap, flow, self.size, axis))
            flows.append(replace(flow, pressure=np.empty((0, 0))))
            of_fluid.append(self._conductivities(gap, flow, axis))
            errors.append(flow_mesh_error(gap, flow, self.size, axis, self._sides(axis)))
        slipping = of_fluid[0], of_fluid[1]
        return SolvedLeak(Leak(*flows), (errors[0], errors[1]), slipping, (sections[0], sections[1])), shown

    def _sides(self, axis: str) -> bool:
        """Return True if the sides along a flow in the direction `axis` are periodic."""
        return self.periodic["yx".index(axis)]

    def _conductivities(self, gap: FloatMap, flow: Flow, axis: str) -> tuple[float, ...]:
        """Return the conductivities [m^3] for the fluid along an axis, one for each of its pressures; NaN without a
        fluid."""
        if self.drop is None or not self.drop.mean_free_path:
            return (np.nan if self.drop is None else flow.conductivity,)
        gaps = (self.drop.conducting_gap(gap, pressure) for pressure in self.drop.pressures)
        return tuple(solve_flow(slipping, self.size, axis, self._sides(axis)).conductivity for slipping in gaps)

    def refuse_memory(self, at: str) -> None:
        """Raise InputError if K is not a function of the load alone. This is the case if the contact has a memory, or
        if the fluid of the run already carries a part of the load. Raise InputError also if `at` selects a single
        instant."""
        if (section := self.job.section("leakage")) is not None and section.total:
            raise InputError(
                "--load total is for runs whose contact carries all of the load: the fluid of "
                f"{self.directory} carries its part already, and measures.csv has flow_x and flow_rate"
            )
        if at:
            raise InputError("--load total needs all saved loads: leave out --at")
        body = self.job.material.fitted.remembers
        if body and len({float(self.fields.times[index]) for index in self.shown if self.load(index) > 0.0}) < 2:
            body = False  # all loads at one instant
        if body or any(asked(self.job) for asked in self.job.asked("remembers")):
            why = "the body relaxes between the saved instants" if body else "contact depends on its history"
            raise InputError(
                f"--load total needs K as a function of the load, but {why}: run an elastic body, of the modulus at "
                "the time in question, without adhesion or stick"
            )

    def _measured(self, index: int, name: str) -> float:
        """Return a value of measures.csv at a saved instant, NaN if it has none."""
        rows = np.flatnonzero(np.asarray(self.columns["step"]) == self.fields.steps[index])
        return float(self.columns[name][rows[-1]]) if rows.size else np.nan

    def load(self, index: int) -> float:
        """Return the mean pressure [Pa] at a saved instant."""
        return self._measured(index, "pressure")

    def row(self, index: int, solved: SolvedLeak, bare: Leak | None, curves: Sequence[LoadCurve] = ()) -> LeakInstant:
        """Return the row of leak.csv for an instant. `bare` is the flow under the undeformed surface, None if it is
        unknown. If the fluid carries a part of the load, `curves` are the conductivities over the load along x and
        along y."""
        found, row = solved.leak, {name: self._measured(index, name) for name in LeakInstant._fields[1:3]}
        totals = [curve.conductivity(self.drop, row["pressure"]) for curve in curves if self.drop]
        along = list(zip((found.along_x.constriction, found.along_y.constriction), totals or (0.0, 0.0), strict=True))
        wider = int(along[1] > along[0])  # where contact closes both, the direction that the fluid opens more
        flows = self._flows(solved.of_fluid[wider][0], wider) if self.drop else (np.nan, np.nan)
        parts = tuple(zip((through[0] for through in solved.of_fluid), totals, strict=True)) if totals else ()
        return LeakInstant(
            float(self.fields.times[index]),
            row["pressure"],
            row["contact_area"],
            found.flow_x,
            found.flow_y,
            int(found.along_x.percolates),
            int(found.along_y.percolates),
            found.constriction,
            found.flow_x / bare.flow_x if bare and bare.flow_x else np.nan,
            found.flow_y / bare.flow_y if bare and bare.flow_y else np.nan,
            found.along_x.constriction,
            found.along_y.constriction,
            *solved.errors,
            *flows,
            *(self._flows(totals[wider], wider) if totals else (np.nan, np.nan)),
            parts,
        )

    def _flows(self, conductivity: float, axis: int) -> tuple[float, float]:
        """Return the volume flow [m^3/s] and the mass flow [kg/s] through a conductivity [m^3] along x (`axis` 0) or y
        (1)."""
        assert self.drop is not None
        through = conductivity, *self.size[:: -1 if axis else 1]
        return self.drop.flow_rate(*through), self.drop.mass_flow(*through)


def write_leakage(
    directory: Path, at: str, over: str, comm: MPI.Intracomm, drop: PressureDrop | None = None
) -> Iterator[str]:
    """Solve for the flow at the saved instants and write leak.csv and leak.png, or leak.STEP.csv and leak.STEP.png if
    `at` selects one instant; collective. Ranks share the instants.

    `over` is the axis on which K is drawn: pressure, time, or "" for an automatic choice. `drop` adds the flow of a
    fluid. Root yields sentences on the results. Raises InputError if the directory has no saved gaps. If the fluid
    carries a part of the load, raises InputError also if K is no function of the load, or if the flow is unknown in
    every row.
    """
    gaps = Gaps(directory, at, drop)
    total = drop is not None and drop.total
    if total:
        gaps.refuse_memory(at)
    gaps.shown = comm.bcast(gaps.shown)  # a run may save more while ranks read
    leaks, drawn, maps = _solve_all(gaps, comm)
    curves: Sequence[LoadCurve] = on_root(comm, lambda: _load_curves(gaps, leaks)) if total else ()
    if comm.rank > 0:
        return
    bare, missing = _bare_flow(gaps)
    rows = [gaps.row(index, leaks[index], bare, curves) for index in gaps.shown]
    name = f"leak.{gaps.fields.steps[gaps.shown[0]]}" if at else "leak"
    table, picture = (directory / f"{name}.{kind}" for kind in ("csv", "png"))
    columns = choose_columns(LEAK, when={"--fluid"} | ({"--load total"} if total else set()) if drop else ())
    files.replace_file(table, to_csv(names_of(columns), (values_of(columns, row) for row in rows)))
    instant = PlottedRun(directory).instant(*gaps.fields.when(drawn))
    flows = leaks[drawn].leak.along_x, leaks[drawn].leak.along_y
    pictures.draw_leakage(picture, gaps.size, gaps.read(drawn), flows, maps, instant, rows, over)
    yield f"leakage at {len(rows)} {'instant' if len(rows) == 1 else 'instants'}: {table}"
    yield from (text for axis in "xy" for text in _describe(rows, axis))
    chosen = max(range(len(rows)), key=lambda k: _tells(rows[k], k))
    yield from _describe_fluid(gaps, drop, rows[chosen], leaks[gaps.shown[chosen]]) if drop else ()
    if drop and total:
        yield from describe_cover(curves[0], drop, [row.pressure for row in rows], rows[chosen].pressure)
    yield from _describe_missing(gaps, at)
    if missing:
        yield f"share_x and share_y are left empty, as the undeformed surface cannot be made: {missing}"
    yield f"picture: {picture}"


def _tells(row: LeakInstant, number: int) -> tuple[int, ...]:
    """Return a key that is largest for the row whose flow is described. Rows with known flows come before others, then
    rows with an open gap, then rows whose gap the fluid opens, and then later rows."""
    totals = [total for _, total in row.parts]
    return not any(map(math.isnan, totals)), bool(row.percolates_x + row.percolates_y), any(totals), number


def _solve_all(gaps: Gaps, comm: MPI.Intracomm) -> tuple[dict[int, SolvedLeak], int, list[FloatMap]]:
    """Return, on root, the flow at all instants, the instant to draw, and the maps of this instant; collective. Drawn
    is the last instant with a flow in both directions, else the last one with a flow in one direction."""
    mine, drawn, maps, problem = dict[int, SolvedLeak](), (-1, -1), list[FloatMap](), ""
    working = max(1, int(comm.size * min(1.0, MOST_CELLS / gaps.cells)))
    try:
        for index in gaps.shown[comm.rank :: working] if comm.rank < working else []:
            mine[index], found = gaps.solve(index)
            directions = mine[index].leak.along_x.percolates + mine[index].leak.along_y.percolates
            if (directions, index) > drawn:
                drawn, maps = (directions, index), found
    except (InputError, *hdf5.FAILURES) as error:
        problem = str(error)
    if problems := [text for text in comm.allgather(problem) if text]:
        raise InputError(problems[0])
    chosen = max(comm.allgather(drawn))
    parts = comm.gather((mine, maps if drawn == chosen else [])) or []
    leaks = {index: one for part, _ in parts for index, one in part.items()}
    return leaks, chosen[1], next((found for _, found in parts if found), [])


def _load_curves(gaps: Gaps, leaks: Mapping[int, SolvedLeak]) -> tuple[LoadCurve, LoadCurve]:
    """Return K as a function of the load, along x and along y. Raises InputError if the saved loads cover the local
    loads of no row."""
    drop, loads = gaps.drop, [gaps.load(index) for index in gaps.shown]
    assert drop is not None
    along_x = load_curve(loads, [leaks[index].of_fluid[0] for index in gaps.shown])
    along_y = load_curve(loads, [leaks[index].of_fluid[1] for index in gaps.shown])
    refuse_uncovered(along_x, drop, loads)
    return along_x, along_y


def _bare_flow(gaps: Gaps) -> tuple[Leak | None, str]:
    """Return the flow of the undeformed surface that just touches, or None and the reason."""
    try:
        return leak(gaps.bare(), gaps.size, gaps.periodic), ""
    except (InputError, OSError) as error:
        return None, " ".join(str(error).split())


def _describe(rows: Sequence[LeakInstant], axis: str) -> Iterator[str]:
    """Yield sentences on when contact closes the gap along an axis, on the mesh error of K, and where K has
    no meaning."""
    yield _describe_closure(rows, axis)
    errors = [error for row in rows if (error := getattr(row, f"error_{axis}")) == error]
    if errors:
        much = stated_error(median(errors))
        if len(errors) > 1:
            much += f" in the median of the instants, at worst {stated_error(max(errors))}"
        yield f"along {axis} the error of K by the mesh, from every second point of the gap: {much}"
    thin = [row for row in rows if pictures.is_thin(getattr(row, f"constriction_{axis}"))]
    if thin:
        where = f"{len(thin)} of {len(rows)} instants, first at t = {quantity(thin[0].time, 's')}"
        yield f"along {axis} the constriction is below 10 nm at {where}: K means little, as no fluid is a continuum"


def _describe_fluid(gaps: Gaps, drop: PressureDrop, last: LeakInstant, solved: SolvedLeak) -> Iterator[str]:
    """Yield sentences on the flow of the fluid in the row `last`, and on gaps that are too narrow for a continuum."""
    pressures = f"from {quantity(drop.high, 'Pa')} to {quantity(drop.low, 'Pa')}"
    sizes, parts = (gaps.size, gaps.size[::-1]), last.parts or [(flows[0], flows[0]) for flows in solved.of_fluid]
    if not drop.total and drop.high - drop.low > UNEQUAL * last.pressure:
        yield (
            f"contact carries all of the load, {quantity(last.pressure, 'Pa')}: right if it is net of the fluid's "
            "pressure, else the flow is too small, and --load total calculates it"
        )
    for axis, (net, through), size, section in zip("xy", parts, sizes, solved.sections, strict=True):
        box = f"a length of {quantity(size[0], 'm')} and a width of {quantity(size[1], 'm')}"
        yield from [describe_part(axis, net, through)] * drop.total
        flows = f"along {axis} {drop.describe_rate(through, *size)}, over {box}"
        yield f"{drop.fluid.name} {pressures} at t = {quantity(last.time, 's')}: {flows}"
        warning = drop.describe_inertia(axis, drop.mass_flow(through, *size), drop.inertial_bound(section))
        yield from [f"warning: {warning}; leak.csv holds the viscous flow"] * bool(warning)
        narrow, path = getattr(last, f"constriction_{axis}"), drop.mean_free_path
        if 0.0 < narrow < path:
            yield (
                f"along {axis} the constriction, {quantity(narrow, 'm')}, is below the mean free path of "
                f"{drop.fluid.name}, {quantity(path, 'm')}: the flow is stated for a gas that slips, and is larger"
            )


def _describe_missing(gaps: Gaps, at: str) -> Iterator[str]:
    """Yield a sentence on stages at whose end no gap is saved."""
    run = PlottedRun(gaps.directory)
    saved = {gaps.fields.steps[index] for index in gaps.shown}
    ends = {index: int(run.columns["step"][rows[-1]]) for index, rows in run.rows_of_stages.items()}
    names = [run.job.history[index].name for index, step in ends.items() if step not in saved]
    if names and not at:
        yield f"no gap is saved at the end of {', '.join(names)}: output: {{every: 1}} saves those of all steps"


def _describe_closure(rows: Sequence[LeakInstant], axis: str) -> str:
    """Return a sentence on where leakage along an axis stops, and at how many instants contact closes the gap."""
    names = (f"flow_{axis}", "pressure", "time")
    stop = results.describe_axis({name: [getattr(row, name) for row in rows] for name in names}, axis)
    closed = [row for row in rows if not getattr(row, f"percolates_{axis}")]
    found = [f"along {axis} leakage {stop}"] if stop else []
    if closed and len(rows) > 1:
        under = f", at the first with {per_cent(closed[0].contact_area)} of the area in contact" if stop else ""
        found.append(f"along {axis} contact closes the gap at {len(closed)} of {len(rows)} instants{under}")
    return "; ".join(found) or f"along {axis} contact leaves the gap open"
