"""Files that each verb writes into an output directory: what it claims, copies, continues, and is recognised by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Outputs:
    """Files of one verb by name; '' and () for files that the verb does not have.

    `words` call the results in messages. The `table` shows that there are results. Further files are tables, `maps`
    (HDF5), a `log` and `others`. `copies` are the job as given, and with every default. A verb that saves `checkpoints`
    continues from the newest, others from their table. `complete` is a sentence on a finished table, with its last step
    or its number of points.
    """

    words: str
    table: str
    tables: tuple[str, ...] = ()
    maps: str = ""
    log: str = ""
    others: tuple[str, ...] = ()
    copies: tuple[str, ...] = ()
    checkpoints: str = ""
    complete: str = ""

    @property
    def written(self) -> tuple[str, ...]:
        """Names of all results, which a new start removes."""
        return tuple(filter(None, (self.table, *self.tables, self.maps, self.log, *self.others)))

    @property
    def resolved(self) -> str:
        """Name of the job with every default."""
        return self.copies[-1]


STOP = "stop"  # name of the stop file of a run or a sweep
MARCHES = "checkpoint/marches.json"  # finished marches of bands
BANDS, WAVES, CYCLES = "bands.csv", "steady_waves.csv", "cycles.csv"
LOST = "steady.lost.json"  # points of a friction curve without a solution
SWEPT_CURVES = "sweep_curves.csv"  # the points of all friction curves of a sweep
STUDY_TEXT, STUDY_PICTURE = "study.txt", "convergence.png"
STEADY_THEORY, BANDS_THEORY = "steady_theory.csv", "bands_theory.csv"

RUN = Outputs(
    "a run",
    "measures.csv",
    tables=(CYCLES, BANDS),
    maps="fields.h5",
    log="run.log",
    others=("fields.xdmf", MARCHES),
    copies=("job.yaml", "job.resolved.yaml"),
    checkpoints="checkpoint",
    complete="its run has finished with step {}",
)
STEADY = Outputs(
    "a friction curve",
    "steady.csv",
    tables=(WAVES, BANDS, STEADY_THEORY, BANDS_THEORY),
    maps="steady.h5",
    log="steady.log",
    others=(LOST,),
    copies=("steady.job.yaml", "steady.resolved.yaml"),
    complete="its curve has {} points",
)
SWEEP = Outputs("a sweep", "sweep.csv", tables=(SWEPT_CURVES, "sweep_mean.csv", "sweep_curves_mean.csv"))
STUDY = Outputs(
    "a study", "study.csv", others=(STUDY_TEXT, STUDY_PICTURE), copies=("study.job.yaml", "study.resolved.yaml")
)
THEORY = Outputs("a theory", "theory.csv", tables=(STEADY_THEORY, BANDS_THEORY), others=("theory.yaml",))
BY_VERB = {"run": RUN, "steady": STEADY, "sweep": SWEEP, "study": STUDY, "theory": THEORY}
LOGS, MAPS = (RUN.log, STEADY.log), (RUN.maps, STEADY.maps)
