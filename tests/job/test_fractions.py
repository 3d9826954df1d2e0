"""Prony series as fractions of the modulus at a sudden strain, as finite-element programs write them."""

import math
from typing import Any

import pytest

from parcontact.effects.relaxation import relaxation_of
from parcontact.errors import JobError
from parcontact.job import load

FRACTIONS = [{"g": 0.5, "tau": 1e-3}, {"g": 0.25, "tau": 1.0}]


def job_with(**material: Any) -> Any:
    data = {"grid": {"points": 4, "size": 1e-3}, "surface": {"shape": "flat"}, "history": [{"pressure": 1e5}]}
    return load({**data, "material": {"model": "zener", **material}})


@pytest.mark.parametrize("time", [0.0, 1e-3, 0.5, 1e3])
def test_relaxation_is_that_of_the_series(time: float) -> None:
    """G(t) = G_0 (1 - sum g (1 - exp(-t/tau))), to rounding."""
    body = relaxation_of(job_with(modulus_0=4e6, branches=FRACTIONS).material)
    found = body.modulus_inf + float(sum(body.moduli * [math.exp(-time / tau) for tau in body.relaxation_times]))
    exact = 4e6 * (1.0 - sum(term["g"] * -math.expm1(-time / term["tau"]) for term in FRACTIONS))
    assert found == pytest.approx(exact, rel=1e-14)


def test_fractions_that_add_up_to_1_are_a_liquid() -> None:
    thirds = [{"g": share, "tau": 10.0**k} for k, share in enumerate((0.1, 0.2, 0.3, 0.4))]
    assert job_with(modulus_0=1e6, branches=thirds).material.modulus_inf == 0.0


@pytest.mark.parametrize(
    ("material", "said"),
    [
        ({"branches": FRACTIONS}, "material.modulus_0 is missing"),
        (
            {"modulus_0": 1e6, "modulus_inf": 1e5, "branches": FRACTIONS},
            "material.modulus_inf does not go with modulus_0",
        ),
        ({"modulus_0": 1e6, "branches": [*FRACTIONS, {"g": 0.26, "tau": 1.0}]}, "fractions g that add up to 1.01"),
        (
            {"modulus_0": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1.0}]},
            "needs branches of the form g, tau",
        ),
        ({"modulus_0": 1e6, "branches": [{"g": 0.5, "tau": 1.0, "modulus": 1e6}]}, "mixes forms of a branch"),
        ({"modulus_0": 1e6, "branches": [{"g": 1.5, "tau": 1.0}]}, "a fraction of modulus_0 .* from 0 to 1, got 1.5"),
    ],
)
def test_mistakes(material: dict[str, Any], said: str) -> None:
    with pytest.raises(JobError, match=said):
        job_with(**material)
