"""Pictures of softening: factors of the moduli against strain, with the strains along a friction curve marked."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...parallel.slab import Array
from ...results import style
from ...results.panels import Axis, Line, Panel

POINTS = 200  # number of points of a line
NAMES = ("G' storage", "G'' loss")


def curve_panels(job: Any, columns: Mapping[str, Array]) -> Iterator[Panel]:
    """Yield the panel of the factors of both moduli against strain, with marks at the strains of a friction curve
    (`columns`)."""
    table, found = job.section("softening").made, columns["strain_amplitude"]
    marked = np.sort(found[np.isfinite(found)])
    strain = np.geomspace(min(table.strain[0], *marked), max(table.strain[-1], *marked), POINTS)
    series = []
    for number, (name, line, marks) in enumerate(zip(NAMES, table.factors(strain), table.factors(marked), strict=True)):
        look = style.line(number)
        series.append(Line(name, strain, line, look))
        series.append(Line("", marked, marks, look | {"marker": "o", "linestyle": "none"}))
    yield Panel("steady softening", Axis("strain amplitude"), Axis("modulus /\nunsoftened"), series, log_x=True)
