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
"""Width of a plot [inch]; its text is legible at a width of 370 pixels, on a telephone."""

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
"""Metadata that is left out of files of each kind, so that the same plot gives the same bytes."""


@dataclass(frozen=True)
class Picture:
    """A plot as SVG and PNG.

    Args:
        svg: Text of the SVG file.
        inline: SVG element for the page: no addresses, unique identifiers, the colours of the page.
        png: Bytes of the PNG file.
        missing: Characters that the font of the PNG file lacks.
    """

    svg: str
    inline: str
    png: bytes
    missing: str


@contextmanager
def house_style(whose: str = "the report", extra: str = "batch") -> Iterator[None]:
    """Make and save plots inside this context; the user's matplotlibrc has no effect in it.

    Args:
        whose: What draws, for the message.
        extra: The extra that installs Matplotlib.

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
    """Return a figure of the standard width and a given height [inch], and its axes as an array (n_rows, n_columns)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height))
    return figure, figure.subplots(n_rows, n_columns, squeeze=False, **options)


def marker_of(team: int) -> str:
    """Return the marker of a team, which does not depend on colour vision."""
    return MARKERS[(team - 1) % len(MARKERS)]


def rule_x(axes: Axes) -> None:
    """Draw vertical grid lines, for plots whose rows have names."""
    axes.grid(True, axis="x")
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)


def rule_y(axes: Axes) -> None:
    """Draw horizontal grid lines."""
    axes.grid(True, axis="y")


def legend_above(figure: Figure, handles: Sequence[tuple[Any, str]]) -> None:
    """Add a legend above the axes with as many columns as fit, if there are several names. The figure grows by its rows."""
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
    """Return a text on one line, without characters that are not allowed in XML."""
    return visible(" ".join(text.split()))


def shortened(text: str, most: int = 24) -> str:
    """Return a name of at most `most` character widths; the middle of a longer one is left out."""
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
        name: Prefix of all its identifiers.
        title: Description for screen readers.
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
    """Collect the characters that the font lacks while a figure is saved inside; other warnings are passed on.

    Control characters, and characters that change the direction of text, are written as escapes.
    """
    from matplotlib.text import Text

    missing: set[str] = set()
    for words in figure.findobj(Text):
        words.set_text(visible(words.get_text()))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield missing
    for warning in caught:
        glyph = re.match(r"Glyph (\d+) ", str(warning.message))
        if glyph is None:
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
        else:
            missing.add(chr(int(glyph[1])))


def inlined(svg: str, name: str, title: str) -> str:
    """Return an SVG file of Matplotlib as an element of a page, with the colours of the page and unique identifiers.

    Args:
        svg: The file.
        name: Prefix of each identifier.
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
    """Rewrite a tag of Matplotlib; its attributes contain no text from outside."""
    tag = re.sub(r'( id="|href="#|url\(#)', rf"\g<1>{name}-", tag).replace("xlink:href", "href")
    for colour, variable in _ON_PAGE.items():
        tag = tag.replace(colour, variable)
    return re.sub(r"\s+", " ", tag)


_ON_PAGE = {INK: "var(--ink)", MUTED: "var(--muted)", GRID: "var(--grid)", PAPER: "var(--paper)"}
