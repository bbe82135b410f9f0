"""The picture of the architecture page: the packages on their floors, and who imports whom, read from the code."""

from __future__ import annotations

import inspect
import re
import tomllib
from html import escape
from importlib import import_module

import grimp
import networkx as nx
from pages import ROOT

PICTURE = ROOT / "docs/images/packages.svg"
WIDTH, HEIGHT, GAP = 420, 46, 30
"""Of a box and between floors [px]."""


def floors() -> list[list[str]]:
    """Packages from top to bottom, of the contract that the imports are held to. Modules at the root are left out."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    layers = next(each["layers"] for each in contracts if each["name"] == "Imports point down")
    named = [[name.strip() for name in layer.replace(":", "|").split("|")] for layer in layers]
    kept = [[name for name in floor if (ROOT / "src/tussle" / name).is_dir()] for floor in named]
    return [floor for floor in kept if floor]


def imports() -> set[tuple[str, str]]:
    """Pairs of packages of which the first imports the second, without those that follow from others."""
    packages = {name for floor in floors() for name in floor}
    modules = grimp.build_graph("tussle", exclude_type_checking_imports=False)
    pairs = {
        (module.split(".")[1], imported.split(".")[1])
        for module in modules.modules - {"tussle"}
        for imported in modules.find_modules_directly_imported_by(module) - {"tussle"}
    }
    graph = nx.DiGraph(sorted((a, b) for a, b in pairs if a != b and {a, b} <= packages))
    return set(nx.transitive_reduction(graph).edges)


def picture() -> str:
    """The picture as SVG."""
    rows = floors()
    total = 2 * WIDTH + 3 * GAP
    height = len(rows) * (HEIGHT + GAP) + GAP
    places = {
        name: (total * (2 * i + 1) / (2 * len(row)), GAP + r * (HEIGHT + GAP))
        for r, row in enumerate(rows)
        for i, name in enumerate(row)
    }
    drawn = [
        f'<line x1="{places[a][0]:g}" y1="{places[a][1] + HEIGHT:g}" x2="{places[b][0]:g}" y2="{places[b][1] - 2:g}"/>'
        for a, b in sorted(imports())
    ]
    boxes = []
    for name, (x, y) in places.items():
        about = re.split(r"[:;.]", inspect.getdoc(import_module(f"tussle.{name}")) or "")[0]
        boxes += [
            f'<rect x="{x - WIDTH / 2:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="5"/>',
            f'<text class="name" x="{x:g}" y="{y + 19:g}">{name}</text>',
            f'<text x="{x:g}" y="{y + 36:g}">{escape(about)}</text>',
        ]
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {total} {height}" role="img">',
            "<title>The packages of tussle on their floors, with arrows to what each imports</title>",
            "<style>rect{fill:#eef3f8;stroke:#5b7083}line{stroke:#5b7083;marker-end:url(#end)}",
            "text{font:12px sans-serif;text-anchor:middle;fill:#222}.name{font-weight:bold;font-size:14px}</style>",
            '<marker id="end" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto">',
            '<path d="M0 0 8 4 0 8z" fill="#5b7083"/></marker>',
            f'<path d="M0 0H{total}V{height}H0z" fill="#fff"/>',
            *drawn,
            *boxes,
            "</svg>\n",
        ]
    )
