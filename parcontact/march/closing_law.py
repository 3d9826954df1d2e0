"""Contact law of a surface whose finer roughness is a law of its interface (`solve.interface_law`).

Under pressure the mean planes of the finer roughness approach by the closing c. With the modulus alpha of a step, in
which the pressure is `alpha p`,

    p >= 0,    w = A p + c(alpha p) - h - d >= 0,    p w = 0.

The gap `u - h - d` is measured to the highest points of the finer roughness, so that it is `-c` in contact. An
effect provides this law (`effects.effect.Effect.law`); it is solved by splitting (`solve.nonsymmetric.splitting`).
Energies of the run do not include the work on the finer roughness.
"""

import math

import numpy as np

from ..effects.contact_protocol import PreviousContacts, SolvedContact
from ..errors import InputError
from ..history.timeline import Step
from ..parallel.slab import Array
from ..physics.body import Trial
from ..physics.convolution import Convolution
from ..physics.measures import Measures
from ..scene import Scene
from ..solve.constraint import NonNegative
from ..solve.contact import Contact
from ..solve.interface_law import InterfaceLaw
from ..solve.nonsymmetric.splitting import Splitting, step_for
from ..solve.problem import Control, MeanPressure
from .dry_law import DryLaw
from .starts import make_start

MOST_STEPS = 20000  # tuning: limit on the steps of the splitting for one contact


class ClosingLaw(DryLaw):
    """Law of a scene with the closing c [m] as a function of the pressure [Pa]. It has no memory of its own.

    Raises InputError for a body that moves in the mean, and for a hardness.
    """

    def __init__(self, scene: Scene, law: InterfaceLaw) -> None:
        super().__init__(scene)
        body, setup = scene.setup.half_space, scene.setup
        if body.moves_in_the_mean or scene.job.material.hardness is not None:
            raise InputError("finer roughness as a law of the interface needs a periodic half space without a hardness")
        self._law, self._operator, self._inverse = law, body.operator(setup.fft), body.inverse(setup.fft)
        shortest = math.hypot(*(np.pi * n / length for n, length in zip(setup.grid.points, setup.size, strict=True)))
        self._range = float(body.compliance(np.array(shortest))), body.largest_compliance

    def solve(
        self,
        trial: Trial,
        step: Step,
        control: Control,
        memory: None,
        past: PreviousContacts,
        before: Measures,
        tolerance: float | None,
    ) -> SolvedContact[None]:
        """Solve a step; see `effects.contact_protocol.ContactLaw.solve`."""
        if isinstance(control, MeanPressure) and control.value == 0.0:
            return super().solve(trial, step, control, memory, past, before, tolerance)
        scene, h, p, start = self.scene, trial.effective, past.spare, None
        if past.last.alpha > 0.0:  # a contact is known
            make_start(scene, past.pressures, step, trial.alpha, p)
            start = p, past.approach
        law = self._law.in_units(trial.alpha * scene.units.pressure, scene.units.height)
        height = scene.setup.height / scene.units.height
        limits = height, tolerance or scene.choices.numerics.tolerance, MOST_STEPS
        splitting = Splitting(scene.slab, self._operator, self._resolvent, *limits)
        found = splitting.solve(h, control, law, self._step_for(control, h, before, trial.alpha), start)
        p[...] = found.p
        contact = Contact(p, found.u, found.d, found.certificate, found.steps, found.failure)
        return SolvedContact(contact, None, NonNegative().touches(p))

    def _resolvent(self, gamma: float) -> Convolution:
        return self._operator.mapped(lambda symbol: 1.0 / (1.0 + gamma * symbol), np.float64)

    def _step_for(self, control: Control, h: Array, before: Measures, alpha: float) -> float:
        """Return the step gamma of the splitting from the given or last mean pressure over the rms pressure of full
        contact; collective."""
        slab = self.scene.slab
        (total,) = slab.sum(float(h.sum(dtype=np.float64)))
        full = self._inverse.apply(h - total / slab.points, slab.empty())
        rms = math.sqrt(slab.sum(float(np.sum(full**2)))[0] / slab.points)
        last = before.pressure / (alpha * self.scene.units.pressure)
        mean = control.value if isinstance(control, MeanPressure) else last
        return step_for(*self._range, mean / rms if rms > 0.0 else 1.0)
