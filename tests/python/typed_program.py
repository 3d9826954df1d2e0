"""A program of a user, for type checkers alone: each line with a mistake must fail, else its comment is unused."""

import numpy as np

import parcontact as pc


def friction_of(run: pc.Simulation) -> list[tuple[int, float]]:
    found = [(row.step, row.friction) for row in run.steps()]
    row: pc.Row = run.row
    print(row.frictionn)  # type: ignore[attr-defined]
    found.append((row.friction, 1.0))  # type: ignore[arg-type]
    return found


def largest(job: str) -> float:
    curve: pc.Curve = pc.steady(job, velocities=[0.1, 1.0])
    print(curve.frictionn)  # type: ignore[attr-defined]
    gap = np.ones((4, 4))
    leak: pc.Leak = pc.leak(gap, (1e-3, 1e-3))
    flow: pc.Flow = leak.along_x
    print(flow.conductivty)  # type: ignore[attr-defined]
    rubber: pc.Material = pc.material({"include": "synthetic_tyre"})
    print(rubber.modulus)  # type: ignore[attr-defined]
    print(pc.Simulatoin)  # type: ignore[attr-defined]
    return float(curve.friction.max()) + leak.flow_x + flow.conductivity + rubber.poisson


def warn_of(warning: pc.ParcontactWarning) -> str:
    print(warning.kid)  # type: ignore[attr-defined]
    return f"{warning.kind} {warning.place}"
