"""The parts of a report: texts, tables, pictures, maps to browse and data, all of it inside the page."""

import base64
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from ..plotting import charts, style

NAME_HEIGHT = 0.19  # of a row of a legend [inch]
SIZE = (4.2, 2.9)  # of the picture of a chart [inch]: two beside each other on a laptop, one on a phone
RC = {**style.RC, "svg.fonttype": "path"}  # letters as shapes: a page looks the same on every machine

Picture = tuple[str, str]  # its data: URI, and what it shows
Browser = tuple[str, Sequence[Picture], int]  # a map by its name, its pictures, and which is shown first
Download = tuple[str, str, int]  # a file inside the page: its name, its data: URI and its bytes


@dataclass(frozen=True)
class ReportTable:
    """Rows of cells under the names of columns, both as texts."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""


@dataclass(frozen=True)
class ReportSection:
    """One heading of a report and all that is under it, in this order; `texts` are shown as they are."""

    title: str
    sentences: Sequence[str] = ()
    tables: Sequence[ReportTable] = ()
    pictures: Sequence[Picture] = ()
    browsers: Sequence[Browser] = ()
    texts: Sequence[tuple[str, str]] = ()
    downloads: Sequence[Download] = ()

    def __bool__(self) -> bool:
        """Whether there is anything to show."""
        return any((self.sentences, self.tables, self.pictures, self.browsers, self.texts, self.downloads))

    def without(self, places: Sequence[str]) -> "ReportSection":
        """Return the section without these directories in its sentences and tables: files are named alone."""

        def shorten(text: str) -> str:
            for place in places:
                text = text.replace(place, "")
            return text

        tables = [replace(one, rows=[[shorten(cell) for cell in row] for row in one.rows]) for one in self.tables]
        return replace(self, sentences=[shorten(text) for text in self.sentences], tables=tables)


@dataclass(frozen=True)
class Chapter:
    """All about one output directory; `headline` says its results in a sentence."""

    title: str
    directory: Path
    kind: str
    sections: Sequence[ReportSection]
    headline: str = ""


def draw_chart(chart: charts.Chart) -> Picture:
    return draw_panel(partial(charts.draw, chart), f"{chart.y.name} over {chart.x.name}".replace("\n", " "))


def draw_panel(panel: style.Panel, caption: str) -> Picture:
    """Return a picture of one panel, as SVG."""
    file = io.BytesIO()
    with style.drawing(RC):
        figure = Figure(figsize=SIZE, layout="constrained")
        axes = figure.subplots()
        panel(axes)
        names = len(axes.get_legend_handles_labels()[1])
        if names > charts.MANY_NAMES:  # the legend is below the panel, and takes no room from it
            figure.set_figheight(SIZE[1] + NAME_HEIGHT * math.ceil(names / charts.NAMES_BESIDE))
        figure.savefig(file, format="svg", dpi=style.DPI, metadata={"Date": None})
    return to_uri(file.getvalue(), "image/svg+xml"), caption


def embed_file(path: Path) -> Download:
    """Return a table to be downloaded from the page."""
    data = path.read_bytes()
    return path.name, to_uri(data, "text/csv"), len(data)


def to_uri(data: bytes, kind: str) -> str:
    """Return data as a URI: nothing has to be loaded from elsewhere."""
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"
