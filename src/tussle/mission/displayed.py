"""How missions and blocks show themselves in a terminal and in a notebook."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

from tussle.declare.displays import counted, line, listing, page, shortened, table
from tussle.palette import team_colours

SIZE, MARGIN = 220.0, 14.0
"""Side of the picture, and the free space along it [pixels]."""
MAX_DRAWN = 100
"""Blocks in the picture."""
MIN_EXTENT = 10.0
"""Smallest side of the region that is drawn [m]."""


def block_line(block: Any) -> str:
    """Return the `repr` of a block."""
    return line(
        "Block",
        repr(block.name),
        f"team {block.team}",
        counted(block.count, "entity", "entities"),
        _plugins(block.plugins),
    )


def mission_line(mission: Any) -> str:
    """Return the `repr` of a mission."""
    blocks = listing([f"{block.name} × {block.count:,}" for block in mission.blocks])
    return line(
        "Mission",
        repr(mission.name) if mission.name else "",
        blocks or "no blocks",
        f"dt = {mission.dt:g} s",
        _ends(mission),
    )


def block_html(block: Any) -> str:
    """Return a block as HTML."""
    facts = block_line(block)[1:-1].partition(": ")[2]
    return page(
        f"Block {block.name}",
        [facts],
        table(("plugin", "kind"), ((repr(p), p.kind) for p in block.plugins)),
        start_picture([block]),
    )


def mission_html(mission: Any) -> str:
    """Return a mission as HTML: its blocks, its plugins, and where they start."""
    laws = f"laws of {mission.compat}" if mission.compat else ""
    facts = [
        f"steps of {mission.dt:g} s",
        mission.update,
        _ends(mission),
        laws,
        _plugins(mission.world_plugins),
    ]
    rows = ((b.name, b.team, b.count, _plugins(b.plugins)) for b in mission.blocks)
    return page(
        f"Mission {mission.name}",
        facts,
        table(("block", "team", "count", "plugins"), rows),
        start_picture(mission.blocks),
    )


def _plugins(plugins: Sequence[Any]) -> str:
    return listing([plugin.instance_name for plugin in plugins])


def _ends(mission: Any) -> str:
    times = [f"time ({mission.end:g} s)" if c == "time" else c for c in mission.end_conditions]
    return f"ends by {listing(times)}"


def start_picture(blocks: Iterable[Any]) -> str:
    """Return a picture of the start from above, as SVG: the first entity of each block, its heading, and the region of the others.

    The region is that of uniform placement, or two standard deviations of normal placement. Where a float cannot hold the distances, "".
    """
    blocks = list(blocks)
    colours = team_colours((block.team, None) for block in blocks)
    drawn = [(block, _half_width(block)) for block in blocks if block.count][:MAX_DRAWN]
    if not drawn:
        return ""
    (low_x, high_x), (low_y, high_y) = (
        (min(b.position[i] - w[i] for b, w in drawn), max(b.position[i] + w[i] for b, w in drawn))
        for i in (0, 1)
    )
    extent = max(high_x - low_x, high_y - low_y, MIN_EXTENT)
    scale = (SIZE - 2.0 * MARGIN) / extent
    if not (math.isfinite(scale) and scale > 0.0):
        return ""
    left, top = (low_x + high_x) / 2.0, (low_y + high_y) / 2.0
    shapes = []
    for block, half_width in drawn:
        x, y = SIZE / 2.0 + (block.position[0] - left) * scale, SIZE / 2.0 - (block.position[1] - top) * scale
        shapes.append(_shape(block, colours[block.team], x, y, half_width[0] * scale, half_width[1] * scale))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{SIZE:g}" height="{SIZE:g}" viewBox="0 0 {SIZE:g} {SIZE:g}" role="img" '
        f'aria-label="Start of {counted(len(drawn), "block")}, from above">'
        f'<rect x=".5" y=".5" width="{SIZE - 1:g}" height="{SIZE - 1:g}" rx="4" fill="none" stroke="currentColor" stroke-opacity=".3"/>'
        f"{''.join(shapes)}</svg><div>start from above, {extent:.3g} m across, north up</div>"
    )


def _half_width(block: Any) -> tuple[float, float]:
    """Half the size of the region in which a block starts, east and north [m]."""
    if block.count < 2:
        return 0.0, 0.0
    if block.placement == "uniform":
        return block.half_width[0], block.half_width[1]
    return 2.0 * math.sqrt(block.variance[0]), 2.0 * math.sqrt(block.variance[1])


def _shape(block: Any, colour: str, x: float, y: float, half_x: float, half_y: float) -> str:
    style = f'fill="{colour}" fill-opacity=".25" stroke="{colour}"'
    region = f'<ellipse cx="{x:.1f}" cy="{y:.1f}" rx="{half_x:.1f}" ry="{half_y:.1f}" {style}/>'
    if block.placement == "uniform":
        region = f'<rect x="{x - half_x:.1f}" y="{y - half_y:.1f}" width="{2 * half_x:.1f}" height="{2 * half_y:.1f}" {style}/>'
    to_x, to_y = x + 9.0 * math.cos(block.heading), y - 9.0 * math.sin(block.heading)
    return (
        f"<g><title>{escape(shortened(block.name))}</title>{region if half_x or half_y else ''}"
        f'<path d="M{x:.1f} {y:.1f}L{to_x:.1f} {to_y:.1f}" stroke="{colour}" stroke-width="1.5"/>'
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{colour}"/></g>'
    )
