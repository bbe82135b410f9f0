"""docs/parameters.md: the parameters of SCRIMMAGE's plugins with their defaults, and what becomes of each here."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from types import ModuleType

from pages import ROOT
from parity_page import differences
from parity_page import table as markdown
from scrimmage_parameters import Parameter, state_of, table

from tussle.cli.pages import default_text
from tussle.plugins import historic, stock

PAGE = ROOT / "docs" / "parameters.md"
MAX_SHOWN = 60
"""Characters of a default."""
EFFECTS = {"unread": "no effect", "refused": "error", "chosen": "read"}
REASONS = {
    "chosen": "it names a plugin, or a class or function of a plugin file, or is passed on to that class",
    "inside": "a list of plugins",
}
HEAD = """# Parameters of SCRIMMAGE's plugins

What becomes of each parameter that a plugin of SCRIMMAGE (2025) reads, for those who move a mission over. The defaults there are
those of the plugin's `.xml`, or where it has none those of the code that reads the parameter. [Parity](parity.md) lists the laws
that differ; the page of [each plugin](plugins/index.md) has all its parameters here, with units. This page is written by
`python tests/docs/rewrite.py` from `tests/docs/scrimmage_parameters.csv`.

"no effect" means that the parameter is accepted, with a note; "error" that a mission which gives it is refused with a message that
names it; "the same" that the default is that of SCRIMMAGE.

"""


def shown(text: str) -> str:
    """A default as a cell of a table."""
    text = " ".join(text.split()).replace("|", "\\|")
    return f"`{text[:MAX_SHOWN]}{'...' * (len(text) > MAX_SHOWN)}`" if text else "none"


def here(row: Parameter, law: ModuleType) -> str:
    """What a mission gets that omits a parameter, or what becomes of one that gives it."""
    state, cls = state_of(row.plugin, row.name, row.default, law), law.load(row.plugin)
    if state == "inside":
        return ", ".join(type(p).__name__ for p in cls.columns[row.name].default) or "none"
    if state in EFFECTS:
        return EFFECTS[state]
    if state == "same":
        return "the same"
    return shown(default_text(cls.params()[cls.historic_attributes.renamed.get(row.name, row.name)]))


def linked(plugin: str) -> str:
    """A plugin with a link to its page."""
    return f"[{plugin}](plugins/{plugin}.md)"


def written(row: Parameter) -> str:
    """A parameter, with its name here if that is another."""
    now = stock.load(row.plugin).historic_attributes.renamed.get(row.name)
    return f"`{row.name}`" + (f" (here `{now}`)" if now else "")


def parameters_page() -> str:
    """The page."""
    known = [row for row in table() if row.state not in ("missing", "viewer")]
    differing = [row for row in known if {here(row, stock), here(row, historic)} != {"the same"}]
    same = [row for row in known if row not in differing]
    drawn = [row for row in table() if row.state == "viewer"]
    lines = (
        [
            linked(row.plugin), written(row), shown(row.default), here(row, stock), here(row, historic),
            row.reason or REASONS.get(row.state, ""),
        ]
        for row in differing
    )  # fmt: skip
    titles = ["plugin", "parameter", "SCRIMMAGE", "tussle", "`--compat scrimmage`", "why"]
    names = ["plugin", "parameters and defaults"]
    dropped = "".join(
        f"* {name}: {why.removeprefix('dropped: ')}.\n" for name, why in differences()["missing"].items()
    )
    return f"""{HEAD}## Those that differ

{len(differing)} parameters have another default, or no effect.

{markdown(titles, lines)}
## Those of drawings

{len(drawn)} parameters say what is drawn and how. They have no effect: [`tussle view`](view.md) has options of its own.

{markdown(names, by_plugin(drawn))}
## Those that do not differ

{len(same)} parameters have the default of SCRIMMAGE by both laws, here in SCRIMMAGE's units.

{markdown(names, by_plugin(same))}
## Plugins that are dropped

{dropped}"""


def by_plugin(rows: list[Parameter]) -> Iterator[list[str]]:
    """A line per plugin."""
    for plugin, its in groupby(rows, lambda row: row.plugin):
        yield [linked(plugin), ", ".join(f"{written(row)} {shown(row.default)}" for row in its)]
