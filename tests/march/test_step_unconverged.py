"""Solves of a job that takes them unconverged."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from marching import begun
from restarting import ELASTIC, ROUGH

from parcontact.march.failure import StepError
from parcontact.march.loop import run
from parcontact.solve.contact import Contact, ContactSolver
from parcontact.solve.fallback import active_set

POINTS = 64


def test_what_a_retry_leaves_unconverged_is_not_accepted(monkeypatch: pytest.MonkeyPatch) -> None:
    """A job takes a solve as it ends. Where that is not finite, retries must solve it."""
    solve, made = ContactSolver.solve, list[Contact]()

    def refuse(solver: ContactSolver, *given: Any, **more: Any) -> Contact:
        contact = solve(solver, *given, **more)
        if solver.slab.nx < POINTS:
            return contact
        certificate = contact.certificate if made else replace(contact.certificate, penetration=np.nan)
        made.append(replace(contact, failure="is refused", certificate=certificate))
        return made[-1]

    data = {
        "grid": {"points": POINTS, "size": 1e-3},
        "surface": ROUGH,
        "material": ELASTIC,
        "history": [{"pressure": 1e4}],
    }
    march = begun(data | {"numerics": {"accept_unconverged": True}})
    monkeypatch.setattr(ContactSolver, "solve", refuse)
    monkeypatch.setattr(active_set, "solve", lambda *_: made[-1])
    with pytest.raises(StepError, match="is refused"):
        run(march, [])
