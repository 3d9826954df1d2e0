"""The section about errors: what logs and tables estimate, part by part, and whether it is as little as asked for."""

from collections.abc import Mapping, Sequence

from ..summary.slide import ERRORS
from .log import Estimate
from .parts import Section, Table

NAMES = dict(zip(ERRORS, ("friction", "contact area"), strict=True))


def section(
    columns: Mapping[str, Sequence[float]], estimates: Sequence[Estimate], accuracy: float, of_curve: bool
) -> Section:
    """Return nothing for a table without errors, else those of the points of a friction curve, or of the means over a
    run and of its steps. The log has the parts: of a curve those of the worst point, if that misses the accuracy."""
    known = {what: [float(one) for one in columns.get(name, ()) if one == one] for name, what in NAMES.items()}
    known = {what: values for what, values in known.items() if values}
    if not known:
        return Section("Error budget")
    found = {one.name: one for one in estimates if one.of_curve == of_curve}
    said = []
    for name, values in known.items() if of_curve else ((name, [one.total / 100]) for name, one in found.items()):
        if not of_curve:
            said.append(f"{found[name].sentence}.")
        said.append(_judge(name, values, found.get(name), accuracy, of_curve))
    where, second = ("at the worst point", "smallest") if of_curve else ("means over the run", "in the end")
    rows = [(what, _percent(max(all_)), _percent(min(all_) if of_curve else all_[-1])) for what, all_ in known.items()]
    tables = [Table(("estimated error of", "largest", second), rows)]
    if found:
        parts = [
            (name, _percent(one.total / 100), *(f"{part:.3g} %" for part in one.parts.values()))
            for name, one in found.items()
        ]
        head = ("estimated error of", "in all", *next(iter(found.values())).parts)
        tables.insert(0, Table(head, parts, f"parts, {where}"))
    return Section("Error budget", said, tables)


def _judge(name: str, errors: Sequence[float], worst: Estimate | None, accuracy: float, of_curve: bool) -> str:
    """Say whether relative errors are as small as asked for, and what makes most of the worst."""
    asked = f"The accuracy of {100 * accuracy:g} % that was asked for {name} (numerics.accuracy)"
    missed = sum(error > accuracy for error in errors)
    if not missed:
        return f"{asked} is met{' at all points' * of_curve}."
    most = f"most of the error is made by the {worst.largest}" if worst else ""
    where = f" at {missed} of {len(errors)} points" if of_curve else ""
    return f"{asked} is missed{where}{'; ' * bool(most)}{'at the worst of them ' * bool(of_curve and most)}{most}."


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"
