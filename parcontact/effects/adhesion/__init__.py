"""Adhesion: surfaces that attract each other. Columns of tables and panels for jobs with adhesion
are stated here."""

from ...capabilities import Axis, Column, ColumnPanel, Table

SECTION, EFFECT = "adhesion", "AdhesionColumns"
USES = ("shear",)  # see `capabilities`
CHANGES_STEPS = ("adhesion.work", "adhesion.range", "adhesion.law")  # see `capabilities`


MEASURES: Table = (
    Column(
        *("tensile_area", ""),
        "share of all points with a tension above 1 % of the largest attraction (with `adhesion`)",
        when="adhesion",
    ),
    Column("adhesive_force", "N", "sum of all tension (with `adhesion`)", when="adhesion"),
    Column(
        *("surface_energy", "J"),
        "energy of adhesion: 0 for separated surfaces, negative for attracting ones (with `adhesion` and "
        "`output.energy`)",
        when="adhesion",
    ),
    Column(
        *("snap_loss", "J"),
        "energy lost in snaps since the start (with `adhesion` and `output.energy`)",
        when="adhesion",
    ),
)
RESULTS: Table = (  # results of a sweep
    Column(
        *("pull_off", "N"),
        "with adhesion: force of the last pull-off; empty if contact is never lost ({doc}`adhesion`)",
        when="adhesion",
    ),
    Column(*("pull_off_error", "N"), "error of `pull_off` by steps, solves and mesh", when="adhesion"),
    Column("pull_off_approach", "m", "approach at the last pull-off", when="adhesion"),
)
SWEEP_PANELS = (ColumnPanel("pull-off", Axis("pull-off force", "N"), {"pull-off": "pull_off"}),)
