"""Results in an output directory: job, tables with units, maps, errors, cases, and what is unfinished.

Pictures, texts, tables of sweeps and `parcontact.open` read results through this module only.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import h5py
import numpy as np

from ..columns import MEASURES, PER_BRANCH, SWEEP, TABLES, names_of
from ..errors import InputError
from ..files import fields, files, hdf5, outputs, tables
from ..files.outputs import Claim
from ..files.tables import Columns
from ..job import Job, Zener, yaml_text
from ..job.history import Timeline
from ..job.listing import answers
from ..job.reading import CASES, shown_job
from ..parallel.slab import Array
from ..printed import quantity
from .slide import ERRORS

if TYPE_CHECKING:
    import xarray

JOBS = [each.resolved for each in outputs.BY_VERB.values() if each.copies]
PLACES = ("velocity", "pressure", "temperature")  # coordinates of a point of a curve
SAMPLES = "seed", "centre"  # last words of keys that choose samples of one surface, over which means are taken
CURVE_RESULTS = ("friction", "contact_area", "contact_area_corrected")
CURVE_COLUMNS = ("state", *PLACES, *CURVE_RESULTS, *ERRORS, "residual")
NUMBERS = {*names_of(SWEEP), *CURVE_COLUMNS} - {"state"}  # columns of numbers in tables of a sweep
FAILURE = ".failure"  # file with the reason why a case failed
SAME_LOAD = 1e-9  # rounding: relative difference below which loads are the same
NO_XARRAY = "parcontact.open needs xarray, which is not installed: pip install xarray (see parcontact manual install)"
MEND = "run the sweep again, which writes the table again"

Rows = list[dict[str, Any]]


class ResultTable(Columns):
    """A table of results, as lists of values by the names of the columns. Reading a missing column raises
    InputError."""

    @property
    def units(self) -> dict[str, str]:
        """SI units of the columns, '' if dimensionless or not known."""
        known = {column.name: column.unit for column in TABLES.get(self.path.name, MEASURES)}
        return {name: known.get(PER_BRANCH if name.startswith("dissipated_") else name, "") for name in self}

    def arrays(self, needed: Sequence[str] = ()) -> dict[str, Array]:
        """Return the columns as arrays; raises InputError if a needed column is missing."""
        if missing := [name for name in needed if name not in self]:
            raise InputError(f"{self.path} has no column {', '.join(missing)}")
        return {name: np.array(values, dtype=float) for name, values in self.items()}


class Results:
    """Results in a directory. `kind` is run, steady, sweep, study or theory; by default it is the first of these that
    exists.

    A `job` that is given replaces the stored job. A text `detached` on how the surfaces detached replaces the stored
    text. Tables, maps and job are read when they are used, and raise InputError if they are damaged.
    """

    def __init__(self, path: str | Path, kind: str = "", job: Job | None = None, detached: str = "") -> None:
        self.path, self._job, self._detached = Path(path), job, detached
        self.kinds = tuple(kind for kind, each in outputs.BY_VERB.items() if self.has(each.table))
        self.kind = kind or next(iter(self.kinds), "")

    def has(self, name: str) -> bool:
        """Return True if the directory has a file of this name."""
        return (self.path / name).is_file()

    def read(self, name: str) -> ResultTable:
        """Return a table by the name of its file; an empty table if the file does not exist."""
        found = tables.read_results(self.path / name) if self.has(name) else {}
        return ResultTable(self.path / name, found.items())

    @cached_property
    def table(self) -> ResultTable:
        """Table of the results of this kind, with units. For a sweep, it has only the columns of numbers."""
        if self.kind != "sweep":
            return self.read(outputs.BY_VERB[self.kind].table)
        rows = self.cases
        numbers = [name for name in (rows[0] if rows else ()) if all(isinstance(row[name], float) for row in rows)]
        return ResultTable(self.path / outputs.SWEEP.table, ((name, [row[name] for row in rows]) for name in numbers))

    @cached_property
    def job(self) -> Job | None:
        """Job of the results, with flat shapes in place of files; None if no job is stored."""
        if self._job is not None:
            return self._job
        own = outputs.BY_VERB.get(self.kind, outputs.RUN)
        names = self._jobs_of_cases if self.kind == "sweep" else (*own.copies[1:], outputs.RUN.resolved)
        return next((shown_job(self.path / name) for name in names if self.has(name)), None)

    @property
    def _jobs_of_cases(self) -> tuple[str, ...]:
        found = (path for name in JOBS[:2] for path in sorted(self.path.glob(f"{CASES}/*/{name}")))
        return tuple(str(path.relative_to(self.path)) for path in found)

    @property
    def job_file(self) -> Path | None:
        """Path of the stored job with all defaults; of a sweep, the job of the first case; None if there is none."""
        return next((self.path / name for name in (*JOBS, *self._jobs_of_cases) if self.has(name)), None)

    @property
    def title(self) -> str:
        """Title of the job; "without a job" or "without a title" if there is none."""
        if (path := self.job_file) is None:
            return "without a job"
        found = re.search(r"^title: (.+)$", path.read_text(errors="replace"), re.MULTILINE)
        return (found and found.group(1).strip("'\"")) or "without a title"

    def plain_job(self) -> dict[str, Any]:
        """Return the stored job of a run or a curve as plain data; raises InputError if there is none."""
        found = next((self.path / name for name in JOBS[:2] if self.has(name)), None)
        if found is None:
            raise InputError(f"{self.path} has no run: it has neither {' nor '.join(JOBS[:2])}")
        return dict(yaml_text.read_source(found, str(found)).data)

    @property
    def temperature(self) -> float:
        """Temperature of the rubber [deg C] from the job, or its shift's reference temperature; NaN without a shift."""
        body = self.job.material.fitted if self.job else None
        if not isinstance(body, Zener) or body.shift is None:
            return math.nan
        return body.shift.made.reference if body.temperature is None else body.temperature

    @property
    def free_area(self) -> float:
        """Area [m^2] of a free box; 0 for other boxes, and without a job."""
        job = self.job
        return job.grid.lx * job.grid.ly if job and job.grid.boundary == "free" else 0.0

    @property
    def claims(self) -> dict[str, Claim]:
        """Records of the commands that wrote the directory (`files.outputs.Claim`), by verb."""
        return outputs.sound_claims(self.path)

    @cached_property
    def detached(self) -> str:
        """Text on how the surfaces of a run detached without a way back; '' if they did not."""
        return self._detached or outputs.detached(self.path)

    @property
    def telling_row(self) -> int:
        """Row that shows the contact of a run best. It is the last row, unless contact is lost there. Then an effect
        may name a row, for instance the row of the pull-off; otherwise it is the last row of the largest load."""
        pressure, area = (np.asarray(self.table[name], float) for name in ("pressure", "contact_area"))
        if area[-1] > 0.0 and not self.detached:
            return len(area) - 1
        named = (row for telling in answers("results", "telling_row") for row in telling(self))
        return next(named, int(np.flatnonzero(pressure >= (1.0 - SAME_LOAD) * pressure.max())[-1]))

    @property
    def errors(self) -> dict[str, list[float]]:
        """Known relative errors of friction and contact area, by the names of their columns."""
        return {name: [error for error in self.table[name] if error == error] for name in ERRORS if name in self.table}

    @cached_property
    def cases(self) -> Rows:
        """Rows of the cases of a sweep."""
        return read_cases(self.path / outputs.SWEEP.table) if self.has(outputs.SWEEP.table) else []

    @property
    def points(self) -> Path:
        """Path of the table that has the results of a sweep: sweep.csv with a row for each case, or for friction curves
        sweep_curves.csv with a row for each point."""
        known = any(math.isfinite(row.get("residual", math.nan)) for row in self.cases)
        curves = self.has(outputs.SWEPT_CURVES) and not known
        return self.path / (outputs.SWEPT_CURVES if curves else outputs.SWEEP.table)

    @property
    def study_rows(self) -> Rows:
        """Rows of a study, without fingerprints."""
        path = self.path / outputs.STUDY.table
        tables.refuse_cut(path)
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file))
        return [{name: _number(text) for name, text in row.items() if name != "fingerprint"} for row in rows]

    @property
    def sentences_of_study(self) -> list[str]:
        """Sentences on the results of `parcontact study`; empty before the study is finished."""
        if not self.has(outputs.STUDY_TEXT):
            return []
        tables.refuse_cut(self.path / outputs.STUDY_TEXT)
        return (self.path / outputs.STUDY_TEXT).read_text(errors="replace").splitlines()

    @property
    def unfinished(self) -> list[str]:
        """Sentences on missing results with reasons: points of a curve, cases of a sweep, steps of a run."""
        if self.kind == "sweep":
            count = sum(row["state"] in ("-", "begun") for row in self.cases)
            return self.failed_cases() + [f"{count} of {len(self.cases)} cases are not finished"] * (count > 0)
        if self.kind == "run":
            claim = self.claims.get("run")
            return ["the run is not finished"] * (claim is None or claim.finished is None)
        return list(self._lost_points()) if self.kind == "steady" else []

    def _lost_points(self) -> Iterator[str]:
        if lost := tables.name_lost(self.path):
            yield lost
        section = self.job.steady if self.job else None
        if section and section.velocities and section.pressures and self.has(outputs.STEADY.table):
            asked = tables.requested_points(section.velocities, section.pressures, section.temperatures or ())
            there = [*tables.of_table(self.table), *(one.at for one in tables.read(self.path))]
            if count := len(tables.lacking_points(asked, there)):
                yield f"{count} of {len(asked)} points are not solved yet"

    def failed_cases(self, most: int = 10**9) -> list[str]:
        """Return sentences on the failed cases of a sweep, at most `most`, and a sentence on the number of further
        failed cases."""
        failed = [int(row["case"]) for row in self.cases if row["state"] == "failed"]
        found = [": ".join(filter(None, (f"case {one} failed", self._why_failed(one)))) for one in failed[:most]]
        return found + [f"and {len(failed) - most} more"] * (len(failed) > most)

    def _why_failed(self, number: int) -> str:
        """Return the lost points of a case, or the first sentence of the reason for its failure; '' if unknown."""
        case = self.path / CASES / f"{number:03d}"
        with suppress(OSError, InputError):
            return tables.name_lost(case) or (case / FAILURE).read_text(encoding="utf-8").strip().split("; ")[0]
        return ""

    @property
    def lost(self) -> str:
        """Text on the points of a curve that could not be solved; '' if there are none."""
        return tables.name_lost(self.path)

    def open_maps(self, name: str = outputs.RUN.maps) -> h5py.File:
        """Open a file of maps; raises FileNotFoundError, and InputError if it is damaged."""
        return hdf5.open_results(self.path / name)

    @property
    def program(self) -> str:
        """Version of the program in the saved maps; '' without maps."""
        for name in outputs.MAPS:
            with suppress(*hdf5.FAILURES, InputError), self.open_maps(name) as file:
                return str(file.attrs["program"])
        return ""

    @property
    def maps(self) -> xarray.Dataset:
        """Saved maps of a run, read when they are used: `pressure_map`, ..., of shape (t, y, x), with the coordinates
        `t` [s], `map_step`, `y` and `x` [m]. Raises ImportError without xarray."""
        try:
            import xarray
        except ImportError as error:
            raise ImportError(NO_XARRAY) from error
        return xarray.Dataset(*self._maps()) if self.has(outputs.RUN.maps) else xarray.Dataset()

    def _maps(self) -> tuple[dict[str, Any], dict[str, Any]]:
        from xarray.core.indexing import LazilyIndexedArray

        from .saved_map import SavedMap

        path = self.path / outputs.RUN.maps
        try:
            with h5py.File(path, "r") as file:
                layout = fields.SavedMaps(file)
                saved = np.array(layout.saved, dtype=int)
                places = {name: (name, file[name][...], {"units": "m"}) for name in ("y", "x")}
                steps = ("t", file["step"][...][saved], {"units": "1"})
                found = {name: LazilyIndexedArray(SavedMap(file[name], saved)) for name in layout.names}
        except hdf5.FAILURES as error:
            raise InputError(f"{path} cannot be read: {files.reason(error)}") from None
        along = ("t", "y", "x")
        drawn = {f"{name}_map": (along, rows, {"units": fields.UNITS[name]}) for name, rows in found.items()}
        return drawn, {"t": ("t", layout.times[saved], {"units": "s"}), "map_step": steps, **places}

    @property
    def dataset(self) -> xarray.Dataset:
        """Return the columns of a run as arrays over the coordinate `step`, with `time` [s] as a further coordinate,
        and the saved maps."""
        maps, known = self.maps, {column.name for column in MEASURES}
        given = self.table.units.items()
        units = {name: {"units": unit or "1"} if unit or name in known else {} for name, unit in given}
        columns = {name: ("step", values, units[name]) for name, values in self.table.items()}
        steps = "step", np.array(self.table["step"], dtype=int), units["step"]
        rows = {name: value for name, value in columns.items() if name not in ("step", "time")}
        return maps.assign_coords(step=steps, time=columns["time"]).assign(rows)

    @cached_property
    def steps(self) -> Timeline | None:
        """The steps of a run. The number of steps to come is an estimate. None for a job without steps."""
        if self.job is None or self.job.bands is not None:
            return None
        ends = zip(map(int, self.table["step"]), self.table["time"], strict=True)
        return Timeline.from_job(self.job).follow(dict(ends))

    @property
    def progress(self) -> str:
        """The progress of a run or a curve, as text; '' before its first row."""
        job = self.job
        if self.kind == "run" and job is not None and self.table["time"]:
            whole, last = sum(stage.seconds for stage in job.history), int(self.table["step"][-1])
            end = f" of {quantity(whole, 's', 4)}" if whole else ""
            count = "" if self.steps is None else f" of {'at least ' * self.steps.chooses}{len(self.steps)}"
            return f"step {last}{count}, t = {quantity(self.table['time'][-1], 's', 4)}{end}"
        if self.kind == "steady":
            return "; ".join([f"{len(self.table['velocity'])} points", *self.unfinished])
        return ""

    def highest(self) -> int:
        """Return the row of the highest friction of a curve that has points."""
        return max(range(len(self.table["friction"])), key=self.table["friction"].__getitem__)

    def describe_place(self, row: int) -> str:
        """Return a text with speed, pressure and known temperature of a point of a curve, and with a remark if the
        curve still rises there at the end of its velocities."""
        columns = self.table
        names = [name for name in PLACES if name in columns]
        places = [dict(zip(names, place, strict=True)) for place in zip(*(columns[n] for n in names), strict=True)]
        at = places[row]
        degrees = at.get("temperature", math.nan)
        degrees = self.temperature if math.isnan(degrees) else degrees
        warm = "" if math.isnan(degrees) else f", {degrees:g} °C"
        others = [name for name in names if name != "velocity"]
        same = [one for one in places if all(np.isclose(one[n], at[n], 1e-6, 0.0, equal_nan=True) for n in others)]
        end = describe_end(at, same, ["velocity"])
        return f"at {quantity(at['velocity'], 'm/s')} and {quantity(at['pressure'], 'Pa')}{warm}{end}"


def describe_end(best: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], keys: Sequence[str]) -> str:
    """Return a text which says that friction still rises at the end of the range of some `keys`, else ''. A key is
    named if at least three of its values occur in `rows`, and the row `best` with the highest friction has the lowest
    or the highest of these values."""
    found = dict[str, None]()
    for key in keys:
        values = sorted({row[key] for row in rows if isinstance(row[key], float) and row[key] == row[key]})
        if len(values) > 2 and best[key] in (values[0], values[-1]):
            end = "highest" if best[key] == values[-1] else "lowest"
            found[f"the {end} {key.split('.')[-1].replace('_', ' ')}"] = None
    return f"; it still rises at {' and '.join(found)}" if found else ""


def read_cases(path: Path) -> Rows:
    """Read the rows of a table of a sweep, empty cells as NaN; raises InputError for a damaged table."""
    try:
        text = path.read_text(encoding="utf-8")
        names, *lines = list(csv.reader(StringIO(text, newline=""))) or [[]]
        if names[:1] != ["case"] or "state" not in names or not text.endswith("\n"):
            raise ValueError("it must begin with the names of columns, case and state first, and end with a whole line")
        rows = [dict(zip(names, line, strict=True)) for line in lines]
        begun = [int(one.name) for one in path.parent.glob(f"{CASES}/*") if one.name.isdecimal()]
        last = max((int(row["case"]) for row in rows), default=-1)
        if path.name == outputs.SWEEP.table and max(begun, default=-1) > last:
            raise ValueError(f"it lacks rows: case {max(begun)} has begun")
        return [
            {name: float(cell or "nan") if name in NUMBERS else _number(cell) for name, cell in row.items()}
            for row in rows
        ]
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"{path} cannot be read: {error}; {MEND}") from error


def _number(text: str) -> Any:
    with suppress(ValueError):
        return float(text or "nan")
    return text


def swept_keys(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the swept keys in the rows of a table of a sweep."""
    names = list(rows[0]) if rows else ["case", "state"]
    return names[1 : names.index("state")]


class ExportedTable(NamedTuple):
    """A table for other programs: stem of its file name, columns with units, rows, and sentences on what the table
    lacks."""

    name: str
    head: Sequence[str]
    rows: Sequence[Sequence[float]]
    sentences: Sequence[str] = ()
