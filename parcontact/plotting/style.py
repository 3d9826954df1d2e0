"""How all pictures look: readable when printed 8 cm wide, in colours that colour-blind readers can tell apart."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, BinaryIO

from ..storage import files

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")  # Okabe and Ito 2008, no yellow
DASHES = ("-", "--", "-.", ":")  # with the colours, for who prints in black and white
BLUE, RED, GREEN, *_ = COLORS
GREY = "0.4"
SEQUENCE = "viridis"  # of lines in an order, like instants
WIDTH, HEIGHT = 5.8, 2.25  # of a picture and of a row of panels [inch]: 10 points are 5.4 when printed 8 cm wide
COLUMNS = 2  # panels beside each other
DPI = 200
RC: dict[Any, Any] = {
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10,
    "axes.formatter.useoffset": False,
    "font.size": 10,
    "grid.alpha": 0.25,
    "legend.fontsize": 9,
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "lines.linewidth": 1.5,
    "lines.markersize": 4,
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}


BESIDE: dict[str, Any] = {  # where the legend of a panel is that leaves it no room
    "loc": "upper left",
    "bbox_to_anchor": (1.0, 1.0),
    "borderaxespad": 0.0,
    "handlelength": 1.2,
}


@contextmanager
def drawing(settings: Mapping[Any, Any] = RC) -> Iterator[None]:
    """Pictures look as these settings say, and otherwise as Matplotlib's own: a matplotlibrc of others has no say."""
    import matplotlib as mpl  # slow to import, and for pictures only

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(settings)
        yield


MARKED = {"png": "Software", "pdf": "Creator", "svg": "Creator"}  # where pictures say what has made them


def save(figure: Figure, file: BinaryIO, kind: str = "png", dpi: int = DPI) -> None:
    """Write a picture, a png, pdf or svg, that is known as one of this program."""
    figure.savefig(file, dpi=dpi, format=kind, metadata={MARKED[kind]: files.MARK})


def plain(text: str, most: int = 1000) -> str:
    """A text as it is, up to so many letters: between dollars, there would be a formula."""
    return (text if len(text) <= most else text[: most - 1] + "…").replace("$", r"\$")


def line(number: int) -> dict[str, Any]:
    """Colour and dashes of the line of this number, from 0."""
    return {"color": COLORS[number % len(COLORS)], "linestyle": DASHES[number % len(DASHES)]}
