"""The parts of the error budget that `numerics.accuracy` governs."""

from ..job import Job
from ..job.sections.settings import BRANCH_SHARE, TOLERANCE_SHARE


def chosen_by_accuracy(job: Job) -> set[str]:
    """The parts of the budget behind which are settings that `numerics.accuracy` has chosen: a smaller one makes them
    smaller. Of time it is so where all stages of a slide choose their steps; without a slide, all that last."""
    numerics = job.numerics
    lasting = [stage for stage in job.history if stage.seconds > 0.0]
    stages = [stage for stage in lasting if stage.speed > 0.0] or lasting
    chosen = {
        "solver": numerics.tolerance == TOLERANCE_SHARE * numerics.accuracy,
        "time": bool(stages) and all(stage.chooses for stage in stages),
        "folded": numerics.branch_error == BRANCH_SHARE * numerics.accuracy,
    }
    return {name for name, by_accuracy in chosen.items() if by_accuracy}
