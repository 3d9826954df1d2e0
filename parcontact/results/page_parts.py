"""Parts of a report: texts, tables, pictures, browsers of maps and data, all stored in the page."""

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from . import charts, style

SIZE = (4.2, 2.9)  # size of a chart, half the width of a laptop's screen [inch]
RC = {**style.RC, "svg.fonttype": "path"}  # letters as shapes, independent of fonts

Picture = tuple[str, str]  # data URI, and caption
Browser = tuple[str, Sequence[Picture], int]  # name of a map, its pictures, and the index of the first shown
Download = tuple[str, str, int]  # a file stored in the page: its name, data URI and size [bytes]


@dataclass(frozen=True)
class ReportTable:
    """A table: names of columns, and rows of texts."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""


@dataclass(frozen=True)
class ReportSection:
    """A section of a report: heading and contents, shown in the order of the fields; `texts` are shown verbatim."""

    title: str
    sentences: Sequence[str] = ()
    tables: Sequence[ReportTable] = ()
    pictures: Sequence[Picture] = ()
    browsers: Sequence[Browser] = ()
    texts: Sequence[tuple[str, str]] = ()
    downloads: Sequence[Download] = ()

    def __bool__(self) -> bool:
        """Return True if the section has contents."""
        return any((self.sentences, self.tables, self.pictures, self.browsers, self.texts, self.downloads))

    def without(self, places: Sequence[str]) -> "ReportSection":
        """Return the section with the directories `places` removed from paths in its sentences and tables."""

        def shorten(text: str) -> str:
            for place in places:
                text = text.replace(place, "")
            return text

        tables = [replace(one, rows=[[shorten(cell) for cell in row] for row in one.rows]) for one in self.tables]
        return replace(self, sentences=[shorten(text) for text in self.sentences], tables=tables)


@dataclass(frozen=True)
class Chapter:
    """A chapter on one output directory; `headline` is a sentence with its results."""

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
        (extra,) = style.place_legends([[axes]])
        style.set_height(figure, SIZE[1] + extra)
        figure.savefig(file, format="svg", dpi=style.DPI, metadata={"Date": None})
    return to_uri(file.getvalue(), "image/svg+xml"), caption


def embed_file(path: Path) -> Download:
    """Return a table as a download in the page."""
    data = path.read_bytes()
    return path.name, to_uri(data, "text/csv"), len(data)


def to_uri(data: bytes, kind: str) -> str:
    """Return data as a data URI."""
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"
