"""References of a job: the method, and the work of others behind what it has used; they are in `references.txt`."""

from collections.abc import Collection
from pathlib import Path
from typing import Any

TABLE = Path(__file__).with_name("references.txt")


def lines(job: dict[str, Any]) -> tuple[str, ...]:
    """Return the references of a job, as plain data, with what they stand for, one a line."""
    return tuple(f"{reference} ({what})" for reference, what in of(job))


def of(job: dict[str, Any], features: Collection[str] = ()) -> list[tuple[str, str]]:
    """Return references of a resolved job, as plain data, and what they stand for; with those of further `features`.

    Raises KeyError or TypeError for what is no whole job.
    """
    material, numerics = job["material"], job["numerics"]
    shift = material.get("shift", "")
    used = {
        *("", *features),
        f"kernel {numerics['kernel']}",
        f"boundary {job['grid']['boundary']}",
        f"shift {shift['law'] if isinstance(shift, dict) else shift}",
        *(f"shape {shape['shape']}" for shape in job["surface"]),
        *(f"interface {key}" for key in job.get("interface") or {}),
    }
    if material["model"] != "elastic":
        used |= {"viscoelastic", f"integrator {numerics['integrator']}" if job.get("history") else ""}
    lines = TABLE.read_text(encoding="utf-8").splitlines()[1:]
    table = ([cell.strip() for cell in line.split("|")] for line in lines)
    return [(reference, what) for feature, reference, what in table if feature in used]
