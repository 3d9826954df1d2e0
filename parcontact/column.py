"""A column of a table: its name, unit, meaning, and value in a row."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any


@dataclass(frozen=True)
class Column:
    """A column of a table: its name, SI unit (`""` if dimensionless), and meaning as printed in the manual.

    `of` returns the value from a row (default: the attribute `name`); `when` is the section or option it requires.
    """

    name: str
    unit: str
    meaning: str
    of: Callable[[Any], Any] | None = None
    when: str = ""

    def value(self, row: Any) -> Any:
        """Return the value of this column for a row."""
        return (self.of or attrgetter(self.name))(row)


Table = Sequence[Column]
COUNTED = "number of points in contact over the number of all points"  # meaning of `contact_area`
