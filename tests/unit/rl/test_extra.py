"""Without the packages of the extra, the import says what to install."""

import subprocess
import sys


def test_missing_packages_are_named():
    code = "import sys; sys.modules['pettingzoo'] = None\nimport tussle.rl"
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert "MissingExtraError" in done.stderr
    assert "pip install 'tussle[rl]'" in done.stderr
