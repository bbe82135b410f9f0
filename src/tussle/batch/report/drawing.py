"""Style of all plots, and their conversion to SVG and PNG. The same batch gives the same bytes."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

from rich.cells import cell_len

from tussle.errors import MissingExtraError, visible
from tussle.palette import GRID, INK, MUTED, PAPER

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 4.4
"""Of a plot [inch]: its text stays legible where a telephone shows it 370 pixels wide."""

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")

STYLE: dict[str, Any] = {
    "font.family": ["DejaVu Sans"],
    "font.size": 8.5,
    "text.parse_math": False,  # a $ in a name is a dollar
    "axes.unicode_minus": True,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.labelsize": 8.5,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.6,
    "axes.facecolor": "none",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 6),
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 3,
    "ytick.major.size": 3,
    "lines.linewidth": 1.4,
    "lines.markersize": 4.5,
    "patch.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "legend.handlelength": 1.4,
    "figure.facecolor": PAPER,
    "figure.constrained_layout.use": True,
    "savefig.dpi": 200,
    "svg.fonttype": "none",
    "svg.hashsalt": "tussle",
}

UNDATED: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
"""What files of each kind are not told, so that the same plot is the same bytes."""


@dataclass(frozen=True)
class Picture:
    """A plot as SVG and PNG.

    Args:
        svg: A file of its own.
        inline: The same as part of a page: no address, no identifier that another picture has, the colours of the page.
        png: The same as pixels.
        missing: Letters that the font of the pixels lacks.
    """

    svg: str
    inline: str
    png: bytes
    missing: str


@contextmanager
def house_style(whose: str = "the report", extra: str = "batch") -> Iterator[None]:
    """Make and save plots inside this context; the user's matplotlibrc has no effect in it.

    Args:
        whose: Who draws, for the message.
        extra: Which extra brings Matplotlib to it.

    Raises:
        MissingExtraError: Matplotlib is not installed.
    """
    try:
        import matplotlib as mpl
    except ImportError as error:
        raise MissingExtraError(
            f"{whose} draws with matplotlib, which is not installed: pip install 'tussle[{extra}]' brings it"
        ) from error
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)  # type: ignore[arg-type]
        yield


def blank(height: float, n_rows: int = 1, n_columns: int = 1, **options: Any) -> tuple[Figure, Any]:
    """A figure of the house's width and some height [inch], and its axes as an array (n_rows, n_columns)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height))
    return figure, figure.subplots(n_rows, n_columns, squeeze=False, **options)


def marker_of(team: int) -> str:
    """Return the marker of a team, which does not depend on colour vision."""
    return MARKERS[(team - 1) % len(MARKERS)]


def rule_x(axes: Axes) -> None:
    """Helping lines for reading off x, for plots whose rows have names."""
    axes.grid(True, axis="x")
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)


def rule_y(axes: Axes) -> None:
    """Helping lines for reading off y."""
    axes.grid(True, axis="y")


def legend_above(figure: Figure, handles: Sequence[tuple[Any, str]]) -> None:
    """A legend over the axes, in as many columns as the names leave room for; none for one name. The figure grows by its rows."""
    if len(handles) < 2:
        return
    names = [shortened(name, 40) for _, name in handles]
    room = 56  # letters beside each other, of which each entry's sign takes 5
    n_columns = max(1, min(len(names), room // (max(map(cell_len, names)) + 5)))
    n_rows = -(-len(names) // n_columns)
    figure.set_figheight(figure.get_figheight() + 0.17 * (n_rows - 1))
    figure.legend(
        [h for h, _ in handles], names, loc="outside upper left", ncols=n_columns, borderaxespad=0.2
    )


def printable(text: str) -> str:
    """A text in one line, without characters that no XML file may hold."""
    return visible(" ".join(text.split()))


def shortened(text: str, most: int = 24) -> str:
    """A name that fits beside a plot, with the room of so many letters; of a longer one, its middle is left out."""
    text = printable(text)
    if cell_len(text) <= most:
        return text
    head, tail = "", ""
    while cell_len(head) < (most - 1) * 2 // 3:
        head += text[len(head)]
    while cell_len(tail) < most - 1 - cell_len(head):
        tail = text[-1 - len(tail)] + tail
    return f"{head}…{tail}"


def pictured(figure: Figure, name: str, title: str) -> Picture:
    """Return a finished figure as SVG and PNG.

    Args:
        figure: The figure.
        name: Begins all its identifiers.
        title: What it shows, for those who have it read to them.
    """
    svg, png = io.StringIO(), io.BytesIO()
    with lettering(figure) as missing:
        figure.savefig(svg, format="svg", metadata=UNDATED["svg"])
        figure.set_layout_engine("none")  # both have the same places, and finding them takes half of the time
        figure.savefig(png, format="png", metadata=UNDATED["png"])
    return Picture(
        svg.getvalue(), inlined(svg.getvalue(), name, title), png.getvalue(), "".join(sorted(missing))
    )


@contextmanager
def lettering(figure: Figure) -> Iterator[set[str]]:
    """Collects the letters that the font lacks while a figure is saved inside; other warnings are given on.

    What no picture may hold, or would turn the order of its letters, is written as an escape in all of its texts.
    """
    from matplotlib.text import Text

    missing: set[str] = set()
    for words in figure.findobj(Text):
        words.set_text(visible(words.get_text()))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        yield missing
    for warning in said:
        glyph = re.match(r"Glyph (\d+) ", str(warning.message))
        if glyph is None:
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
        else:
            missing.add(chr(int(glyph[1])))


def inlined(svg: str, name: str, title: str) -> str:
    """An SVG file of Matplotlib as an element of a page, with the colours of the page and identifiers that no other picture has.

    Args:
        svg: The file.
        name: Begins each identifier.
        title: What the picture shows.
    """
    body = re.sub(
        r"<metadata>.*?</metadata>|<style.*?</style>|<!--.*?-->|\n\s*",
        " ",
        svg[svg.index("<svg") :],
        flags=re.DOTALL,
    )
    view = re.search(r'viewBox="[^"]*"', body)
    assert view is not None
    body = re.sub(r"<[^>]+>", lambda tag: _on_page(tag[0], name), body[body.index(">") + 1 :])
    body = re.sub(r">\s+<", "><", body)
    return f'<svg {view[0]} role="img" aria-label="{escape(printable(title))}">{body.strip()}'


def _on_page(tag: str, name: str) -> str:
    """A tag of Matplotlib's, whose attributes hold no text from outside."""
    tag = re.sub(r'( id="|href="#|url\(#)', rf"\g<1>{name}-", tag).replace("xlink:href", "href")
    for colour, variable in _ON_PAGE.items():
        tag = tag.replace(colour, variable)
    return re.sub(r"\s+", " ", tag)


_ON_PAGE = {INK: "var(--ink)", MUTED: "var(--muted)", GRID: "var(--grid)", PAPER: "var(--paper)"}
