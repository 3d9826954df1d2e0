"""Pull-offs from made-up rows: of pulls by approach and by load, of several, of a contact that holds."""

from parcontact.summary.pull_off import Columns, PullOff, describe, find


def table(*rows: tuple[float, float, float]) -> Columns:
    """Pressure, approach and area, a row a second."""
    pressure, approach, area = (list(column) for column in zip(*rows, strict=True))
    highest = [abs(each) + 1.0 for each in pressure]
    found = {"pressure": pressure, "approach": approach, "contact_area": area, "max_pressure": highest}
    return {"time": [float(row) for row in range(len(rows))], **found}


NEAR = [
    (0.0, -5e-6, 0.0),
    (-9.0, -1e-6, 0.0),
    (-1.0, 0.0, 0.1),
    (2.0, 1e-6, 0.3),
]  # they pull hardest before they touch
PULL = [(-3.0, -1e-6, 0.2), (-2.5, -2e-6, 0.1)]
OFF = [(-0.5, -3e-6, 0.0), (-0.1, -5e-6, 0.0)]


def test_by_approach() -> None:
    rows = table(*NEAR, *PULL, *OFF)
    assert find(rows) == [PullOff(4, 5.0, 6)]
    where = "pull-off: 1.5 N (3 Pa), at t = 4 s, approach -1 µm; the steps beside it differ by 2.5 N"
    assert list(describe(rows, 0.5)) == [f"{where}, and contact was lost by t = 6 s"]


def test_surfaces_that_pull_hardest_when_they_have_come_off() -> None:
    """A stiff sphere pulls so: its lowest load is behind the end of contact, but not on the way back."""
    rows = table(*NEAR, *PULL, (-4.0, -3e-6, 0.0), (-2.0, -4e-6, 0.0), (-6.0, -3e-6, 0.0))
    assert find(rows) == [PullOff(6, 2.0, 6)]


def test_a_contact_under_tension_throughout() -> None:
    """Its load is highest at the end of the pull, where little still holds."""
    under_tension = [(-1.0, -1e-6, 0.1), (-2.0, 0.0, 0.3), *PULL, (-0.5, -3e-6, 0.05)]
    assert find(table(*under_tension, *OFF)) == [PullOff(2, 1.0, 5)]
    assert find(table(*under_tension)) == [PullOff(2, 1.0, None)]


def test_under_a_load() -> None:
    """What is beside the last load that held is the one before: open surfaces carry none."""
    rows = table(*NEAR, *PULL, (0.0, -5e-6, 0.0), (0.0, -5e-6, 0.0))
    assert find(rows) == [PullOff(4, 5.0, 6)]
    assert find(table(*NEAR[:-1], (-2.0, 0.0, 0.1), (-2.5, 0.0, 0.1), (0.0, -5e-6, 0.0))) == [PullOff(4, 0.5, 5)]


def test_flat_surfaces_are_pulled_at_no_approach() -> None:
    (text,) = describe(table((0.0, 0.0, 1.0), (-2.0, -0.0, 1.0)), 1.0)
    assert "approach 0 m" in text


def test_two_pulls() -> None:
    rows = table(*NEAR, *PULL, *OFF, *NEAR, (-2.0, 0.0, 0.1), *OFF)
    first, second = find(rows)
    assert (first, second) == (PullOff(4, 5.0, 6), PullOff(12, 4.0, 13))
    assert [text.split(":")[0] for text in describe(rows, 1.0)] == ["pull-off 1", "pull-off 2"]


def test_a_pull_that_was_held_is_no_pull_off() -> None:
    """Rubber holds a fast pull, and comes off slowly under less."""
    again = [(-8.0, -1e-6, 0.2), (1.0, 0.0, 0.2), *PULL]
    assert find(table(*NEAR, *again, *OFF)) == [PullOff(6, 4.0, 8)]
    assert find(table(*NEAR, *again)) == [PullOff(4, 10.0, None)]


def test_a_contact_that_holds_has_none() -> None:
    (held,) = describe(table(*NEAR, *PULL), 0.5)
    assert held == "largest pull so far: 1.5 N (3 Pa), at t = 4 s, approach -1 µm; contact holds"


def test_a_run_that_ended_with_its_contact_has_one() -> None:
    """The load after the last row was held by nothing."""
    assert find(table(*NEAR, *PULL), detached=True) == [PullOff(4, 5.0, 6)]
    (told,) = describe(table(*NEAR, *PULL), 1.0, detached=True)
    assert told.endswith("the steps beside it differ by 5 N, and nothing held the next load")


def test_nothing_is_said_without_a_pull() -> None:
    assert find(table((0.0, 0.0, 0.0), (2.0, 1e-6, 0.1), (0.0, 0.0, 0.0))) == []
    assert find(table(*NEAR[:2])) == []
    assert find(table((0.0, 0.0, 0.0), (-1e-12, 0.0, 0.1), (-2e-12, 0.0, 0.1))) == []  # rounding of no load
