"""Leakage through the gap of a contact, its columns in tables, and its panels."""

from ...capabilities import COUNTED, Axis, Column, ColumnPanel, Table

SECTION, EFFECT = "leakage", "LeakageColumns"
STAGE_KEYS = ("fluid_pressures",)
CHANGES_STEPS = tuple(f"leakage.{key}" for key in ("load", "pressures", "ambient", "fluid"))  # see `capabilities`


MEASURES: Table = (
    Column("flow_x", "m³", "conductivity of the gap along x (with `leakage`, {doc}`seals`)", when="leakage"),
    Column("flow_y", "m³", "conductivity of the gap along y (with `leakage`)", when="leakage"),
    Column(
        *("constriction", "m"),
        "smallest gap on the widest path, in the direction that leaks more (with `leakage`)",
        when="leakage",
    ),
    *(
        Column(name, unit, meaning, when="leakage.load")
        for name, unit, meaning in (
            ("high_pressure", "Pa", "of the fluid, at the low end of x (`load: total`)"),
            ("low_pressure", "Pa", "of the fluid, at the high end of x"),
            ("fluid_pressure", "Pa", "mean over the box of the fluid's pressure over the ambient one (`load: total`)"),
            ("flow_rate", "m³/s", "flow of the fluid along x at the low pressure, through the box (`load: total`)"),
            ("mass_flow", "kg/s", "the same flow as a mass, empty where no density is known"),
            ("error_x", "", "relative change of K along x if only every second point of the gap counts"),
            ("error_leak", "", "relative part of K by the small leak through contact; empty where it closes the gap"),
            ("error_rounds", "", "estimated relative error of K by the last round of the step"),
            ("rounds", "", "contacts and flows solved in the step (`load: total`)"),
        )
    ),
)
FIELDS: Table = (
    Column("fluid_pressure", "Pa", "of the fluid over the ambient pressure, continued into contact (`load: total`)"),
)
FIELDS_NEED = {"fluid_pressure": "leakage: {load: total}"}  # what the map needs
LAST: Table = (  # columns of a sweep: the last values of a run
    Column("flow_x", "m³", "with `leakage`: last calculated K along x", when="leakage"),
    Column("flow_y", "m³", "the same along y", when="leakage"),
    Column("constriction", "m", "the critical constriction at the same step", when="leakage"),
)
SHOWN = ("flow_x", "flow_y", "constriction")  # columns of a run whose ends a report shows

LEAK: Table = (
    Column("time", "s", "of the instant"),
    Column("pressure", "Pa", "mean pressure"),
    Column("contact_area", "", COUNTED),
    Column("flow_x", "m³", "conductivity K of the gap along x ({doc}`seals`)"),
    Column("flow_y", "m³", "conductivity K of the gap along y"),
    Column("percolates_x", "", "1 where a path leads from end to end along x, else 0"),
    Column("percolates_y", "", "the same along y"),
    Column("constriction", "m", "smallest gap on the widest path, in the direction that leaks more"),
    Column(
        *("share_x", ""),
        "K along x over K of the undeformed surface that just touches; empty if its file of heights no longer exists",
    ),
    Column("share_y", "", "the same along y"),
    Column("constriction_x", "m", "smallest gap on the widest path along x, 0 where contact closes"),
    Column("constriction_y", "m", "the same along y"),
    Column(
        *("error_x", ""),
        "relative change of K along x if only every second point of the gap is used; empty where contact closes",
    ),
    Column("error_y", "", "the same along y"),
    Column(
        *("flow_rate", "m³/s", "flow of the `--fluid` at the low pressure, in the direction that leaks more"),
        when="--fluid",
    ),
    Column(*("mass_flow", "kg/s", "the same flow as a mass, empty where no density is known"), when="--fluid"),
    Column(
        *(
            "flow_rate_total",
            "m³/s",
            "`flow_rate` if the fluid carries its part of the load; empty where K is not known",
        ),
        when="--load total",
    ),
    Column(*("mass_flow_total", "kg/s", "the same flow as a mass"), when="--load total"),
)
TABLES = {"leak.csv": LEAK}

FLOWS = {"flow_x": "along x", "flow_y": "along y"}  # columns of a run
SWEEP_PANELS = (ColumnPanel("leakage", Axis("conductivity", "m³"), {label: name for name, label in FLOWS.items()}),)
