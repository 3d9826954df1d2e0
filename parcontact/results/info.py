"""Texts about results: `parcontact info`, headlines and citations.

* Descriptions of files of a run and of output directories, with checks for damage.
* Headlines, sentences with the main results and their errors, with which a report begins.
* Comparison of a run with Persson's theory, and the settings of the predictions (theory.yaml).
* References to cite for a run: this program, and the references for its job (`files.provenance`).
"""

import json
import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from .. import capabilities
from ..errors import InputError
from ..files import checkpoint, fields, files, hdf5, outputs
from ..files.hdf5 import PROGRAM, Link, read_budget, read_chain, references_of
from ..files.recorder import meshes_of, warnings_of
from ..job import Job, Stage, yaml_text
from ..job.listing import answers
from ..job.reading import CASES
from ..parallel.slab import Slab
from ..printed import quantity, with_error
from . import slide
from .results import PLACES, Results, describe_end, read_cases, swept_keys

LAST_ROW = {"pressure": "Pa", "friction": "", "contact_area": "", "contact_area_corrected": "", "approach": "m"}
SHOWN = 20  # tuning: most numbers of one name, or failed cases, that are shown
NOT_HDF5 = "file signature not found"  # message of HDF5 for files of another kind


def describe_path(path: Path) -> tuple[str, bool]:
    """Return a description of a checkpoint, a field file or an output directory, and True if it is undamaged. Only one
    rank may call this function."""
    if path.is_dir():
        return describe_files(path)
    try:
        if checkpoint.is_one(path):
            return _checkpoint(path)
        with h5py.File(path, "r") as file:
            if file.attrs.get("kind") == fields.KIND:
                return _fields(path, file)
    except FileNotFoundError:
        raise InputError(f"{path} does not exist") from None
    except hdf5.FAILURES as error:
        if NOT_HDF5 in str(error):
            raise InputError(f"{path} is neither a checkpoint nor a field file: it is not an HDF5 file") from None
        return f"{path} cannot be read: {files.reason(error)}", False
    raise InputError(f"{path} is neither a checkpoint nor a field file")


def describe_all(paths: Sequence[Path]) -> tuple[str, bool]:
    """Return descriptions of several paths, and True if all are undamaged; an error becomes part of the description."""
    found = []
    for path in paths:
        try:
            found.append(describe_path(path))
        except InputError as error:
            if len(paths) == 1:
                raise
            found.append((str(error), False))
    return "\n".join(text for text, _ in found), all(sound for _, sound in found)


def _checkpoint(path: Path) -> tuple[str, bool]:
    try:
        contents = checkpoint.inspect(path)
    except InputError as error:
        return str(error), False
    ny, nx = contents.shape
    problem = checkpoint.verify(contents, Slab.alone(nx, ny))
    lines = [f"{path}: checkpoint after step {contents.step}, t = {contents.time:g} s, {nx} x {ny} points"]
    lines += _runs(contents.chain)
    lines += [f"  map    {name} ({dtype.name})" for name, dtype in contents.maps.items()]
    lines += [f"  number {name} = {_short(value * contents.units[name])}" for name, value in contents.numbers.items()]
    lines.append(problem or "sound: every row matches its checksum")
    return "\n".join(lines), not problem


def _fields(path: Path, file: h5py.File) -> tuple[str, bool]:
    layout = fields.SavedMaps(file)
    saved = layout.saved
    lines = [f"{path}: {', '.join(layout.names)} on {len(file['x'])} x {len(file['y'])} points"]
    lines += _runs(read_chain(file))
    for name, parts in read_budget(file).items():
        if name != "accuracy":
            errors = (f"{part} {100 * value:.2g} %" for part, value in parts.items())
            lines.append(f"  error of {name}: {', '.join(errors)}")
    lines.append(f"  {len(saved)} of {len(layout.steps)} instants saved")
    if saved:
        first, last = saved[0], saved[-1]
        lines[-1] += f", t = {layout.times[first]:g} s (step {layout.steps[first]})"
        lines[-1] += f" to {layout.times[last]:g} s (step {layout.steps[last]})"
    maps = ((name, i) for name in layout.names for i in saved)
    bad = [f"{name} after step {layout.steps[i]}" for name, i in maps if not np.isfinite(file[name][i]).all()]
    lines.append(f"damaged: values are not finite in {', '.join(bad)}" if bad else "sound: all saved maps are finite")
    return "\n".join(lines), not bad


def _runs(chain: tuple[Link, ...]) -> list[str]:
    return [
        f"  {'run' if link.runs == 1 else f'{link.runs} runs'} from step {link.from_step} on {link.ranks} rank"
        f"{'s' if link.ranks > 1 else ''}, {link.program}, {link.started}"
        for link in chain
    ]


def _short(value: NDArray[Any]) -> str:
    return json.dumps(value.tolist()) if np.size(value) <= SHOWN else f"{np.size(value)} values"


def describe_files(directory: Path) -> tuple[str, bool]:
    """Return a description of an output directory, and True if all its files are readable. Raises InputError if it has
    no results."""
    try:
        claims = outputs.read_claims(directory)
    except (OSError, ValueError) as error:
        return f"{directory}: {files.reason(error)}", False
    if not claims and not any((directory / name).exists() for name in (outputs.RUN.table, outputs.SWEEP.table)):
        raise InputError(
            f"{directory} has no results yet: neither a file .parcontact, nor measures.csv or sweep.csv; a run "
            "writes them when it begins"
        )
    results = Results(directory)
    lines, problems = [f"{directory}: {results.title}"], list[str]()
    lines += dict.fromkeys(f"  {text}" for log in outputs.LOGS for text in meshes_of(directory / log))
    for name, part in PARTS.items():
        try:
            lines += part(results) if (directory / name).exists() else ()
        except InputError as error:
            problems.append(f"  {error}")
        except hdf5.FAILURES as error:
            problems.append(f"  {directory}: {files.reason(error)}")
    return "\n".join([*lines, *problems]), not problems


def _run(found: Results) -> Iterator[str]:
    run = Results(found.path, "run")
    columns, claim = run.table, run.claims.get("run")
    if not columns["step"]:
        yield "  run: no step yet"
        return
    step, time, job = int(columns["step"][-1]), quantity(columns["time"][-1], "s", 4), run.job
    ended = claim is not None and claim.finished is not None and claim.finished[0] == step
    if ended and run.detached:
        yield f"  {run.detached}"
    reached = f"step {step}, t = {time}" if ended or job is None else run.progress
    yield f"  run: {'finished' if ended else 'not finished'} after {reached}, {len(columns['step'])} rows"
    noise = {"friction"} if job is not None and not job.directions else set[str]()  # where nothing slides
    names = {name: unit for name, unit in LAST_ROW.items() if name in columns and name not in noise}
    values = {name: columns[name][-1] for name in names}
    values["pressure"] = float(slide.balanced(values["pressure"], columns["max_pressure"][-1]))
    last = [f"{name} {quantity(values[name], unit, 4)}" for name, unit in names.items()]
    yield f"  last row: {', '.join(last)}"
    spent = math.fsum(columns["seconds"])
    yield f"  wall time of its steps: {spent:.3g} s"
    if not ended and step and run.steps is not None and (more := len(run.steps) - step) > 0:
        least = "or more " * run.steps.chooses
        yield f"  {more} steps {least}to go: {quantity(more * spent / step, 's', 2)}, if they take as long"
    yield from (f"  {text}" for text in describe_run_in_words(run))


def describe_run_in_words(run: Results) -> Iterator[str]:
    """Yield sentences on the slide and the cycles of a run, and the sentences of the effects of its job."""
    if (job := run.job) is not None:
        yield from slide.describe_slide(job.history, job.initial, job.grid.dx, run.table, run.free_area)
        yield from slide.describe_cycles(job, slide.find_cycles(job, run.table))
    for sentences in answers("results", "sentences"):
        yield from sentences(run)


def _theory(found: Results) -> Iterator[str]:
    run = Results(found.path, "run")
    count = f"  Persson's theory: {len(run.read(outputs.THEORY.table)['time'])} rows, "
    try:
        settings = read_settings(run.path)
    except InputError:
        yield count + "of unknown settings"
        raise
    yield count + (settings.sentence if settings else "of unknown settings")
    if job := run.job:
        yield from (f"  {text}" for text in describe_theory(run.path, job.history, job.grid.dx))


def _curve(found: Results) -> Iterator[str]:
    curve = Results(found.path, "steady")
    columns, claims = curve.table, curve.claims
    if speeds := columns["velocity"]:
        best = curve.highest()
        yield f"  friction curve: {len(speeds)} points from {min(speeds):.4g} to {max(speeds):.4g} m/s"
        yield f"  largest friction of the curve: {columns['friction'][best]:.4g} {curve.describe_place(best)}"
        errors = {name: max(known, default=math.nan) for name, known in curve.errors.items()}
        if errors:
            parts = ", ".join(f"{name.removeprefix('error_')} {100 * value:.3g} %" for name, value in errors.items())
            numerics, requested = claims["steady"].job.get("numerics", {}) if "steady" in claims else {}, ""
            if (asked := numerics.get("accuracy")) is not None:
                wanted = asked if isinstance(asked, dict) else {"": asked}
                each = (f"{name} {100 * value:.3g} %".lstrip() for name, value in wanted.items())
                requested = f"; requested: {', '.join(each)}"
            yield f"  largest estimated errors of the curve: {parts}{requested}"
        yield from (f"  warning: {text}" for text in warnings_of(curve.path / outputs.STEADY.log))
    if curve.lost:
        yield f"  the curve has {curve.lost}"
    yield from (f"  {text}" for text in curve.unfinished if text != curve.lost)


def _saved_states(found: Results) -> Iterator[str]:
    for _, path in reversed(outputs.find_checkpoints(found.path)):
        contents = checkpoint.inspect(path)
        yield f"  checkpoint after step {contents.step}, t = {quantity(contents.time, 's', 4)}"


def _marches(found: Results) -> Iterator[str]:
    with (found.path / outputs.MARCHES).open("rb") as file:
        count = sum(1 for _ in file) - 1  # the first line names the program
    yield f"  run in bands: not finished; finished marches: {count}"


def _saved_maps(found: Results) -> Iterator[str]:
    with found.open_maps() as file:
        layout = fields.SavedMaps(file)
    yield f"  fields: {', '.join(layout.names)} at {len(layout.saved)} of {layout.times.size} instants"


def _sweep(found: Results) -> Iterator[str]:
    rows = found.cases
    states = Counter(str(row["state"]) for row in rows)
    counts = ", ".join(f"{number} {'not begun' if state == '-' else state}" for state, number in states.items())
    yield f"  sweep of {states.total()} cases: {counts}"
    open_cases = [int(row["case"]) for row in rows if row["state"] in ("-", "begun")]
    for number in open_cases:
        if progress := Results(found.path / CASES / f"{number:03d}").progress:
            yield f"  case {number}: {progress}"
    known = [row["seconds"] for row in rows if row["state"] == "done" and row.get("seconds", math.nan) > 0.0]
    if open_cases and known:
        left = quantity(len(open_cases) * sum(known) / len(known), "s", 2)
        yield f"  {len(open_cases)} cases to go: {left}, one after the other, if they take as long"
    yield from (f"  {text}" for text in found.failed_cases(SHOWN))
    done = [int(row["case"]) for row in rows if row["state"] == "done"]
    for number in done[:SHOWN]:
        if text := find_headline(found.path / CASES / f"{number:03d}"):
            yield f"  case {number}: {text}"
    if len(done) > SHOWN:
        yield f"  and {len(done) - SHOWN} more"


Describe = Callable[[Results], Iterator[str]]
PARTS: dict[str, Describe] = {  # descriptions of the parts of an output directory, by their file
    outputs.RUN.table: _run,
    outputs.THEORY.table: _theory,
    outputs.STEADY.table: _curve,
    outputs.RUN.checkpoints: _saved_states,
    outputs.MARCHES: _marches,
    outputs.RUN.maps: _saved_maps,
    **{name: part for parts in capabilities.offers("results", "PARTS") for name, part in parts.items()},
    outputs.SWEEP.table: _sweep,
    outputs.STUDY_TEXT: lambda _: iter([f"  study: errors and costs of settings are in {outputs.STUDY_TEXT}"]),
}


SWEPT = (  # results of a sweep, after those of capabilities: column, words, unit, column of the error
    ("mu_dyn", "the mean friction", "", "mu_dyn_error"),
    ("loss", "the loss of the last cycle", "J", "error_loss"),
    ("friction", "friction", "", slide.ERRORS[0]),
    (slide.CORRECTED, "the contact area over the nominal area", "", slide.ERRORS[1]),
)

SLIGHT = 1e-6  # rounding: relative difference below which loads count as constant
Columns = Mapping[str, Sequence[float]]


def find_headline(directory: Path) -> str:
    """Return the headline of an output directory: a sentence for each run, friction curve, sweep and study in it."""
    kinds = Results(directory).kinds
    said = {kind: sentence(directory) for kind, sentence in HEADLINES.items() if kind in kinds}
    if said.get("study"):  # its limit, not the range of its cases
        said.pop("sweep", None)
    return " ".join(filter(None, said.values()))


def _headline_of_run(directory: Path) -> str:
    """Return friction, results of capabilities and contact area of a run, as far as its job determines them."""
    run = Results(directory, "run")
    job, columns = run.job, run.table
    if job is None or not columns["time"]:
        return ""
    parts = [f"{text}{_describe_conditions(run)}" for text in _friction(job, columns)]
    for headline in answers("results", "headline"):
        parts += headline(run)
    if last := slide.measure_last(job, columns):
        parts.append(f"the last cycle loses {slide.loss_with_error(last['loss'], last['error_loss'])}")
    return _to_sentence([*parts, _area(job, run)])


def _describe_conditions(run: Results) -> str:
    """Return the load of a slide, if it is constant, and the temperature of the rubber, if it is known."""
    pairs = zip(run.table["pressure"], run.table["distance"], strict=True)
    loads = [pressure for pressure, slid in pairs if slid > 0.0]
    constant = run.job is not None and max(loads) - min(loads) <= SLIGHT * max(loads)
    load = f" under {_load(run.job, loads[-1])}" if run.job is not None and constant else ""
    return load + ("" if math.isnan(run.temperature) else f" at {run.temperature:g} °C")


def _friction(job: Job, columns: Columns) -> Iterator[str]:
    """Yield the friction of the slide, if it is defined."""
    found, errors = slide.measure_slide(job.history, columns), slide.absolute_errors(job.history, columns, job.grid.dx)
    if found is None or math.isnan(found.mu_dyn):
        return
    mean, peak = (with_error(getattr(found, name), errors.get(name, math.nan)) for name in ("mu_dyn", "mu_max"))
    yield f"the mean friction is {mean} and the highest {peak}"


def _area(job: Job, run: Results) -> str:
    """Return the mean contact area of the slide; without a slide the area in the telling row."""
    columns = run.table
    if (found := slide.measure_slide(job.history, columns)) is not None:
        if math.isnan(found.contact_area):
            return "the box cuts the contact off in the whole slide"
        error = slide.absolute_errors(job.history, columns, job.grid.dx).get("contact_area", math.nan)
        return f"the mean contact area is {_size(job, found.contact_area_corrected, error)}"
    row = run.telling_row
    area, when = columns[slide.CORRECTED][row], ""
    if len(columns["time"]) > 1:
        time = f"t = {quantity(columns['time'][row], 's', 4)}" if columns["time"][-1] else ""
        when = f" at {time or _load(job, columns['pressure'][row])}"
    return f"the contact area is {_size(job, area, area * _error(columns, slide.ERRORS[1], row))}{when}"


def _load(job: Job, pressure: float) -> str:
    """Return the force on the box of a free scene, else the mean pressure, as text."""
    free = job.grid.boundary == "free"
    return quantity(pressure * job.grid.lx * job.grid.ly, "N", 4) if free else quantity(pressure, "Pa", 4)


def _size(job: Job, share: float, error: float) -> str:
    """Return a contact area and its error as text: in m² in a free scene, else in per cent of the nominal area."""
    if job.grid.boundary != "free":
        return f"{with_error(100.0 * share, 100.0 * error)} % of the nominal area"
    box = job.grid.lx * job.grid.ly
    return with_error(share * box, error * box, "m²")


def _headline_of_curve(directory: Path) -> str:
    """Return a sentence on the highest friction of a friction curve; '' without a point."""
    curve = Results(directory, "steady")
    if not curve.table["velocity"]:
        return ""
    best = curve.highest()
    friction = curve.table["friction"][best]
    highest = with_error(friction, friction * _error(curve.table, slide.ERRORS[0], best))
    return _to_sentence([f"the highest friction of the curve is {highest}, {curve.describe_place(best)}"])


def _headline_of_sweep(directory: Path) -> str:
    """Return a sentence on the range of the first of the results that the cases have; '' without any."""
    rows = read_cases(Results(directory, "sweep").points)
    for name, words, unit, error in (*(one for some in answers("results", "SWEPT") for one in some), *SWEPT):
        known = sorted((row for row in rows if math.isfinite(row.get(name, math.nan))), key=itemgetter(name))
        if known and known[-1][name]:
            ends = [f"{_with_unit(row, name, unit, error)} (case {row['case']:g})" for row in (known[0], known[-1])]
            keys = [*swept_keys(rows), *(place for place in PLACES if place in rows[0])]
            end = describe_end(known[-1], known, keys) if "friction" in words else ""
            return _to_sentence([f"{words} of the cases is from {ends[0]} to {ends[1]}{end}"])
    return ""


def _headline_of_study(directory: Path) -> str:
    """Return the limit of the mean friction by a study, or of the area if nothing slides; '' before its end."""
    lines = Results(directory, "study").sentences_of_study
    limits = [text for text in lines if " ± " in text]
    best = [text for text in limits if text.startswith("mu_dyn")] or limits
    return "".join(f"The study finds {text}." for text in best[:1])


HEADLINES: dict[str, Callable[[Path], str]] = {
    "run": _headline_of_run,
    "steady": _headline_of_curve,
    "sweep": _headline_of_sweep,
    "study": _headline_of_study,
}


def _with_unit(row: Mapping[str, Any], name: str, unit: str, error: str) -> str:
    value, within = row[name], row.get(error, math.nan)
    within = abs(value) * within if error in (*slide.ERRORS, "error_loss") else within
    return with_error(value, within, unit)


def _error(columns: Columns, name: str, row: int) -> float:
    """Return an error of a row, NaN if the table has none."""
    return columns[name][row] if name in columns else math.nan


def _to_sentence(parts: Sequence[str]) -> str:
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}."


def describe_citations(directory: Path) -> str:
    """Return the references to cite for the run in a directory. Raises InputError without a run, or if its job is
    damaged."""
    found = Results(directory)
    job, theory = found.plain_job(), ["theory"] * any(map(found.has, ("theory.csv", "steady_theory.csv")))
    try:
        cited = references_of(job, theory)
    except (AttributeError, KeyError, TypeError) as error:
        damaged = f"the job in {directory} is damaged: it lacks sections of a resolved job; run it again"
        raise InputError(damaged) from error
    lines = [f"{directory}: please cite", "", f"* {found.program or PROGRAM}", "    this program (CITATION.cff)"]
    return "\n".join([*lines, *(line for reference, what in cited for line in (f"* {reference}", f"    {what}"))])


(FILE,) = outputs.THEORY.others  # settings of the predictions in theory.csv
OF_WAVES = {"continuum": "the spectrum of the surface", "lattice": "the waves of the surface in its box"}


class TheorySettings(NamedTuple):
    """Settings of a prediction: factor that corrects friction in partial contact, and kind of waves, continuum or
    lattice."""

    gamma: float
    waves: str

    @property
    def sentence(self) -> str:
        """Return the settings as text."""
        return f"gamma {self.gamma:g}, for {OF_WAVES.get(self.waves, self.waves)}"


def read_settings(directory: Path) -> TheorySettings | None:
    """Return the settings of the theory table in a directory, or None if it has no such table; raises InputError for a
    damaged file."""
    path = directory / FILE
    try:
        text = path.read_bytes()
        data = yaml_text.parse(text, FILE).data
        if not text.endswith(b"\n") or "program" not in data:
            raise KeyError(FILE)
        return TheorySettings(float(data["gamma"]), str(data["waves"]))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from error
    except (InputError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path} is damaged: it does not say gamma and waves") from error


def shared(directories: Iterable[Path]) -> TheorySettings | None:
    """Return the settings that the theory tables in these directories share, or None. Raises as `read_settings`."""
    found = {read_settings(directory) for directory in directories if (directory / outputs.THEORY.table).is_file()}
    return found.pop() if len(found) == 1 else None


def describe_settings(directory: Path) -> str:
    """Return a sentence on the settings of Persson's theory in a directory, or in the cases of a sweep there; '' if
    there is no theory."""
    try:
        settings = shared([directory, *directory.glob("cases/*")])
    except InputError as error:
        return f"theory of unknown settings: {error}"
    return f"Persson's theory: {settings.sentence}" if settings else ""


class ComparedResult(NamedTuple):
    """A result of the theory, the same result of the run, and the error of the run's result. All are ratios [-]. `run`
    is None without a run, `error` is NaN if it is unknown."""

    name: str
    theory: float
    run: float | None
    error: float = math.nan


def compare_with_theory(directory: Path, history: Sequence[Stage], cell: float) -> list[ComparedResult]:
    """Return results of theory.csv and of measures.csv in a directory; an empty list without theory.csv. `cell` is the
    spacing of the grid along x [m].

    Results are mu_max, mu_dyn and the mean contact area of the slide (`slide.measure_slide`), with the corrected area
    for the run. Without a slide, there is one result, the contact area of the last instant. Raises InputError for
    damaged tables.
    """
    predicted, found = (_results(directory / name, history, cell) for name in (outputs.THEORY.table, outputs.RUN.table))
    nothing = None, math.nan
    return [ComparedResult(name, value, *found.get(name, nothing)) for name, (value, _) in predicted.items()]


def _results(path: Path, history: Sequence[Stage], cell: float) -> dict[str, tuple[float, float]]:
    """Return results and their errors by name."""
    columns = Results(path.parent).read(path.name)
    if not columns.get("time"):
        return {}
    columns.setdefault(slide.CORRECTED, columns["contact_area"])
    found = slide.measure_slide(history, columns)
    if found is None:
        area = columns[slide.CORRECTED][-1]
        return {"contact area": (area, columns.get(slide.ERRORS[1], [math.nan])[-1] * area)}
    within = slide.absolute_errors(history, columns, cell)
    values = {"mu_max": found.mu_max, "mu_dyn": found.mu_dyn, "contact area": found.contact_area_corrected}
    defined = {name: value for name, value in values.items() if value == value}
    return {name: (value, within.get(name.replace(" ", "_"), math.nan)) for name, value in defined.items()}


def describe_theory(directory: Path, history: Sequence[Stage], cell: float) -> Iterator[str]:
    """Yield a sentence on the predictions, if there is a theory.csv. Raises InputError for damaged tables."""
    results = compare_with_theory(directory, history, cell)
    if results:
        known = ("" if one.run is None else f" (run: {with_error(one.run, one.error)})" for one in results)
        pairs = (f"{one.name} {one.theory:.3g}{run}" for one, run in zip(results, known, strict=True))
        yield f"Persson's theory predicts {', '.join(pairs)}"
