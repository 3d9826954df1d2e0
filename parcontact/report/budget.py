"""The section about errors: what logs and tables estimate, part by part, and whether it is as little as asked for."""

from collections.abc import Callable, Mapping, Sequence

from ..summary.slide import ERRORS
from .log import Estimate
from .parts import Section, Table

NAMES = dict(zip(ERRORS, ("friction", "contact area"), strict=True))
Columns = Mapping[str, Sequence[float]]


def of_run(columns: Columns, estimates: Sequence[Estimate], accuracy: float) -> Section:
    """Of the means over a run, which the log tells, and of its steps."""
    means = [one for one in estimates if not one.of_curve]
    said = [text for one in means for text in (f"{one.sentence}.", _judge_mean(one, accuracy))]
    return _section(columns, said, means, "means over the run", ("in the end", lambda values: values[-1]))


def of_curve(columns: Columns, estimates: Sequence[Estimate], accuracy: float) -> Section:
    """Of the points of a friction curve; the log has the parts of the worst if that misses the accuracy."""
    worst = {one.name: one for one in estimates if one.of_curve}
    said = [_judge_points(name, values, worst.get(name), accuracy) for name, values in _known(columns).items()]
    return _section(columns, said, list(worst.values()), "at the worst point", ("smallest", min))


def _section(
    columns: Columns,
    said: Sequence[str],
    estimates: Sequence[Estimate],
    where: str,
    second: tuple[str, Callable[[Sequence[float]], float]],
) -> Section:
    """Nothing for a table without errors."""
    if not (known := _known(columns)):
        return Section("Error budget")
    name, take = second
    rows = [(what, _percent(100 * max(values)), _percent(100 * take(values))) for what, values in known.items()]
    tables = [Table(("estimated error of", "largest", name), rows)]
    if estimates:
        parts = [(one.name, _percent(one.total), *map(_percent, one.parts.values())) for one in estimates]
        tables.insert(0, Table(("estimated error of", "in all", *estimates[0].parts), parts, f"parts, {where}"))
    return Section("Error budget", said, tables)


def _known(columns: Columns) -> dict[str, list[float]]:
    """The errors of friction and area that a table has numbers of."""
    found = {name: [float(value) for value in columns.get(key, ()) if value == value] for key, name in NAMES.items()}
    return {name: values for name, values in found.items() if values}


def _judge_mean(one: Estimate, accuracy: float) -> str:
    if one.total <= 100 * accuracy:
        return f"{_asked(one.name, accuracy)} is met."
    return f"{_asked(one.name, accuracy)} is missed; most of the error is made by the {one.largest}."


def _judge_points(name: str, values: Sequence[float], worst: Estimate | None, accuracy: float) -> str:
    missed = sum(value > accuracy for value in values)
    if not missed:
        return f"{_asked(name, accuracy)} is met at all points."
    most = f"; at the worst of them most of the error is made by the {worst.largest}" if worst else ""
    return f"{_asked(name, accuracy)} is missed at {missed} of {len(values)} points{most}."


def _asked(name: str, accuracy: float) -> str:
    return f"The accuracy of {100 * accuracy:g} % that was asked for {name} (numerics.accuracy)"


def _percent(value: float) -> str:
    return f"{value:.3g} %"
