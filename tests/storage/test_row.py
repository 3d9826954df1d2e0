"""measures.csv: exact numbers, cut back without repeating or losing a row."""

import math
from pathlib import Path

import pytest

from parcontact.columns import MEASURES, choose_columns
from parcontact.physics.measures import Measures
from parcontact.storage import tables
from parcontact.storage.checkpoint import TableMark
from parcontact.storage.row import MeasuresFile, StepRow, cut_back_table


def row(step: int, lost: tuple[float, ...] = ()) -> StepRow:
    return StepRow(step, 0.1 * step, measures=Measures(pressure=1 / 3), dissipated=sum(lost), branch_dissipation=lost)


def written(path: Path, count: int, branches: int = 0) -> None:
    file = MeasuresFile(path, TableMark(), branches)
    for step in range(count):
        file.write(row(step, (0.1,) * branches))
    file.close()


def test_numbers_read_back(tmp_path: Path) -> None:
    path = tmp_path / "measures.csv"
    written(path, 3)
    found = tables.read(path)
    assert list(found) == [column.name for column in choose_columns(MEASURES)]
    assert found["step"] == [0, 1, 2]
    assert found["time"] == [0.0, 0.1, 0.2]
    assert found["pressure"] == [1 / 3] * 3
    assert all(math.isnan(value) for value in found["work"])


@pytest.mark.parametrize(
    ("forces", "signed"), [((-3.0, 0.0), 0.5), ((3.0, 0.0), -0.5), ((0.0, 2.0), 0.0), ((-3.0, 4.0), 0.3), ((0, 0), 0.0)]
)
def test_signed_friction(tmp_path: Path, forces: tuple[float, float], signed: float) -> None:
    """Over a normal force F the column is -force_x/F, exactly where the force is along x; friction is |force|/F."""
    friction = 0.5 if any(forces) else 0.0
    found = Measures(1.0, *forces, friction)
    assert found.friction_x == pytest.approx(signed, rel=2e-16, abs=0.0)
    assert math.copysign(1.0, found.friction_x) == (-1.0 if signed < 0.0 else 1.0)
    file = MeasuresFile(tmp_path / "measures.csv", TableMark(), 1)
    file.write(StepRow(1, measures=found, branch_dissipation=(0.1,)))
    file.close()
    table = tables.read(tmp_path / "measures.csv")
    assert list(table).index("friction_x") == list(table).index("dissipated_0") + 1
    assert table["friction_x"] == [found.friction_x]


def test_cut_back(tmp_path: Path) -> None:
    path = tmp_path / "measures.csv"
    written(path, 6)
    whole = path.read_text()
    with path.open("a") as file:
        file.write("6,0.6,0.")  # a row that was cut off
    assert cut_back_table(path, 3, TableMark(), 0)[1] == []
    assert path.read_text() == "".join(whole.splitlines(keepends=True)[:5])
    file_again = MeasuresFile(path, TableMark())
    for step in (4, 5):
        file_again.write(row(step))
    file_again.close()
    assert path.read_text() == whole


def test_what_is_lost_is_said(tmp_path: Path) -> None:
    path = tmp_path / "measures.csv"
    assert "is missing" in cut_back_table(path, 3, TableMark(), 0)[1][0]
    written(path, 3)
    assert "ends with step 2: the rows up to step 5 are lost" in cut_back_table(path, 5, TableMark(), 0)[1][0]


def test_other_columns(tmp_path: Path) -> None:
    """The dissipation of branches may be asked for later, or no longer."""
    path = tmp_path / "measures.csv"
    written(path, 3)
    assert cut_back_table(path, 2, TableMark(), 2)[1] == []
    assert list(tables.read(path)) == [column.name for column in choose_columns(MEASURES, 2)]
    assert math.isnan(tables.read(path)["dissipated_1"][2])
    assert cut_back_table(path, 2, TableMark(), 0)[1] == []
    assert list(tables.read(path)) == [column.name for column in choose_columns(MEASURES)]
    written(tmp_path / "split.csv", 2, branches=2)
    assert tables.read(tmp_path / "split.csv")["dissipated_1"] == [0.1, 0.1]
