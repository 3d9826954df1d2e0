"""Chart of the conductivity of a gap over pressure or time, with marks where contact closes, or where the constriction
is too narrow for continuum flow."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from ...parallel.slab import Array
from ...results import style
from ...results.charts import Axis, Chart, ChartLine

CONTINUUM = 1e-8  # physics: gap of about thirty molecules of water, the least for continuum flow [m]
THIN = "constriction\nunder 10 nm"
THIN_LOOK: dict[str, Any] = {"color": style.GREY, "linestyle": "none", "marker": "o", "mfc": "none", "ms": 8}


def is_thin(constriction: Any) -> Any:
    """Return True if a constriction [m] (or each of several) is open but too narrow for continuum flow."""
    return (constriction > 0.0) & (constriction < CONTINUUM)


def chart(
    over: Axis,
    at: Array,
    flows: Mapping[str, Array],
    constrictions: Mapping[str, Array],
    log_x: bool = False,
    dotted: Mapping[str, Array] = MappingProxyType({}),
) -> Chart:
    """Draw conductivities K [m^3], by their names, over an axis, all of shape (n,), with their critical constrictions
    [m]; K is 0 where contact closes, and NaN where it is not known. Others are `dotted`, in the same colours."""
    lines, thin = list[ChartLine](), list[ChartLine]()
    for number, (name, flow) in enumerate(flows.items()):
        known = np.isfinite(flow)
        lines.append(ChartLine(name, at[known], flow[known], style.line(number) | {"marker": "."}))
        narrow = known & (flow > 0.0) & is_thin(constrictions[name])
        if narrow.any():
            thin.append(ChartLine(THIN * (not thin), at[narrow], flow[narrow], THIN_LOOK))
    looks = [style.line(number) | {"linestyle": ":"} for number in range(len(dotted))]
    lines += [
        ChartLine(name, at[flow > 0.0], flow[flow > 0.0], look)
        for (name, flow), look in zip(dotted.items(), looks, strict=True)
    ]
    return Chart("leakage", over, Axis("conductivity K", "m³"), lines + thin, log_x=log_x, zeros="closed")
