"""Contact law of a surface whose finer roughness is a law of its interface (`solve.interface_law`).

Under pressure the mean planes of the finer roughness approach by the closing c. With the modulus alpha of a step, in
which the pressure is `alpha p`,

    p >= 0,    w = A p + c(alpha p) - h - d >= 0,    p w = 0.

The gap `u - h - d` is measured to the highest points of the finer roughness, so that it is `-c` in contact. An
effect provides this law (`effects.effect.Effect.law`); it is solved by splitting (`solve.nonsymmetric.splitting`).
Energies of the run do not include the work on the finer roughness.
"""

from collections.abc import Callable

from ..effects.contact_protocol import PreviousContacts, SolvedContact
from ..errors import InputError
from ..history.timeline import Step
from ..physics.body import Trial
from ..physics.measures import Measures
from ..scene import Scene
from ..solve.constraint import NonNegative
from ..solve.contact import Contact
from ..solve.interface_law import InterfaceLaw
from ..solve.nonsymmetric.judge import Judge
from ..solve.nonsymmetric.splitting import Splitting
from ..solve.problem import Control, MeanPressure
from .dry_law import DryLaw
from .starts import make_start

SOFTER = 4.0  # tuning: most modulus of the last step over that of this one, for a start from its pressures
MOST_STEPS = 20000  # tuning: limit on the steps of the splitting for one contact


class ClosingLaw(DryLaw):
    """Law of a scene with the closing c [m] as a function of the pressure [Pa], at the end of each step. It has no
    memory of its own.

    Raises InputError for a body that moves in the mean, and for a hardness.
    """

    def __init__(self, scene: Scene, law: Callable[[Step], InterfaceLaw]) -> None:
        super().__init__(scene)
        body, setup = scene.setup.half_space, scene.setup
        if body.moves_in_the_mean or scene.job.material.hardness is not None:
            raise InputError("finer roughness as a law of the interface needs a periodic half space without a hardness")
        judge = Judge(scene.slab, setup.height / scene.units.height)
        self._law = law
        self._splitting = Splitting(
            judge, body.operator(setup.fft), body.inverse(setup.fft), scene.choices.numerics.tolerance, MOST_STEPS
        )

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
        scene, p = self.scene, past.spare
        if 0.0 < past.last.alpha <= SOFTER * trial.alpha:  # a contact is known, of about as many points
            make_start(scene, past.pressures, step, trial.alpha, p)
        else:
            p.fill(0.0)
        law = self._law(step).in_units(trial.alpha * scene.units.pressure, scene.units.height)
        found = self._splitting.solve(trial.effective, control, law, p, tolerance)
        contact = Contact(p, found.u, found.d, found.certificate, found.steps, found.failure)
        return SolvedContact(contact, None, NonNegative().touches(p))
