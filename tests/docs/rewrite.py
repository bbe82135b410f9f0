"""Writes into the pages what their code prints now.

python tests/docs/rewrite.py

Look at the difference before you commit it: a number that changes for no reason that you know of is a fault.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile

from pages import OUTPUT, PAGES, examples, namespace, printed_by
from parameters_page import PAGE as PARAMETERS
from parameters_page import parameters_page
from parity_page import PAGE as PARITY
from parity_page import parity_page
from plugin_pages import FOLDER, plugin_pages
from reference import PAGE, reference
from rooms import PICTURE, picture


def game() -> str:
    """What the first command of the README prints, run as a user runs it."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    command = [sys.executable, "-m", "tussle.cli", "run", "predator_prey"]
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            command, check=True, capture_output=True, text=True, env=environment, cwd=folder
        )
    return done.stdout.strip("\n") + "\n"


def main() -> None:
    """Rewrite all pages."""
    for page in PAGES:
        text, module = page.read_text(), namespace(page)
        for example in examples(page):
            printed, _ = printed_by(example, page, module)
            if example.output is not None and printed != example.output:
                old, new = (
                    f"{example.code}```\n\n```text\n{output}```\n" for output in (example.output, printed)
                )
                assert old in text, (
                    f"{page.name}:{example.line}: the output does not stand right under the code"
                )
                text = text.replace(old, new)
        text = OUTPUT.sub(lambda shown: f"{shown[1]}{game()}```", text)
        page.write_text(text)
    PAGE.write_text(reference())
    PARITY.write_text(parity_page())
    PARAMETERS.write_text(parameters_page())
    PICTURE.write_text(picture())
    FOLDER.mkdir(exist_ok=True)
    for page, text in plugin_pages().items():
        page.write_text(text)


if __name__ == "__main__":
    main()
