"""Makes the pictures of the terminal, of the report and of the page on plots: python tests/docs/pictures.py."""

from __future__ import annotations

import io
import os
import shutil
import tempfile
from pathlib import Path

import typer
from playwright.sync_api import sync_playwright
from rich.terminal_theme import DIMMED_MONOKAI

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
BATCH = (
    "batch predator_prey --vary keepers.Predator.max_speed=25:45 --vary run.update=sequential,synchronous"
    " --sample product --samples 4 --runs 10 --end 60 --out games"
)

HUNT = "run predator_prey --seed 3 --end 300 --out hunt"
PLOTS = {
    "trajectory": "--kind trajectory --team 2 --team 3",
    "left": "--kind left",
    "altitude": "--kind altitude --team 1",
    "distance-3-109": "--between 3 109",
    "density": "--kind density --team 1",
}
"""Name of each plot of the page -> how it is drawn there."""


def called(command: str, width: int) -> str:
    """Run a command as on a terminal of some width, and return the terminal as SVG."""
    from tussle.cli import terminal
    from tussle.cli.app import app

    os.environ |= {"COLUMNS": str(width), "FORCE_COLOR": "1"}
    terminal.out.cache_clear()
    console = terminal.out()
    console.record, console.file = True, io.StringIO()
    assert typer.main.get_command(app)(command.split(), standalone_mode=False) == terminal.OK, command
    return console.export_svg(title=f"tussle {command}", theme=DIMMED_MONOKAI)


def main() -> None:
    """Make all pictures."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        os.chdir(folder)
        called(BATCH, 80)
        browser = play.chromium.launch(
            executable_path=shutil.which("chromium") or shutil.which("chromium-headless-shell"),
            args=["--no-sandbox"],
        )
        for columns in (80, 120):
            width = round(12.2 * min(columns, 100)) + 18  # of the terminal in the SVG [pixels]
            page = browser.new_page(viewport={"width": width, "height": 600})
            page.set_content(
                f"<body style='margin: 0'>{called('analyze games --quantity score[2]', columns)}"
            )
            page.screenshot(path=IMAGES / f"terminal-{columns}.png", full_page=True, timeout=300_000)
        called("report games", 80)
        page = browser.new_page(viewport={"width": 1100, "height": 1500})
        page.goto(Path("games/report/index.html").resolve().as_uri())
        page.screenshot(path=IMAGES / "report.png", timeout=300_000)
        browser.close()
        called(HUNT, 80)
        for name, how in PLOTS.items():
            called(f"plot hunt {how}", 80)
            shutil.copy(f"hunt/plots/{name}.png", IMAGES / f"plot-{name.partition('-')[0]}.png")


if __name__ == "__main__":
    main()
