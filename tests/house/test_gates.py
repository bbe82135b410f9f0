"""Files that a mission names are read through one gate, and web servers are made by one class: a fix of either is one for all."""

from __future__ import annotations

import ast

import pytest
from tree import parsed, python_files, relative

GATE = "src/tussle/documents.py"
OWN_READERS = {
    "src/tussle/mission/source.py": "mission files: bounded by the limits of the mission",
    "src/tussle/mission/plugin_files.py": "Python files, which are run",
    "src/tussle/mission/catalogue.py": "files of the package",
    "src/tussle/cli/pages.py": "files of the package",
    "src/tussle/cli/scaffold/__init__.py": "files of the package",
    "src/tussle/cli/scaffold/played.py": "files of the package",
    "src/tussle/cli/scaffold/copied.py": "files of the package",
    "src/tussle/plugins/stock/__init__.py": "files of the package",
    "src/tussle/numeric/neighbors/lanes.py": "files of the package",
    "src/tussle/numeric/store.py": "files of the package",
    "src/tussle/view/page/assemble.py": "files of the package",
    "src/tussle/batch/report/__init__.py": "files of the package",
    "src/tussle/batch/code.py": "files of the package",
    "src/tussle/plugins/links/ros/domain.py": "a file of the system",
    "src/tussle/batch/slurm.py": "the log of a job of one's own",
    "src/tussle/batch/batch.py": "mission files that were read before",
    "src/tussle/rl/league.py": "the policy of a contestant, which is run",
    "src/tussle/record/run_file.py": "checksums, after a check of the size",
    "src/tussle/record/arrow_blocks.py": "tables, after a check of the size",
    "src/tussle/record/arrow_file.py": "tables, after a check of the size",
    "src/tussle/record/parquet_file.py": "tables, after a check of the size",
    "src/tussle/batch/damage.py": "tables, after a check of the size",
    "src/tussle/folders.py": "safe access to files of the user",
    "src/tussle/cli/__init__.py": "the null device",
    "src/tussle/cli/terminal.py": "the null device",
    "src/tussle/plugins/stock/autonomy/joystick/device.py": "a device of the system",
}
"""Modules that open files themselves, and which files these are."""
FOREIGN = {
    "Image",
    "nx",
    "onnx",
    "trimesh",
    "np",
    "ET",
    "ElementTree",
    "tomllib",
    "yaml",
    "imageio",
    "pv",
    "pyvista",
}
READERS = ("open", "load", "read", "imread", "parse", "iterparse", "genfromtxt", "fromfile")
WITHOUT_A_FILE = {"loads", "load_model_from_string", "parsed", "read_only", "load_external_data_for_model"}
SERVERS = {
    "AppRunner",
    "TCPSite",
    "SockSite",
    "HTTPServer",
    "ThreadingHTTPServer",
    "TCPServer",
    "UDPServer",
    "run_app",
    "start_server",
}
SERVER_MODULE = "src/tussle/view/page/web_server.py"


def opens_itself(call: ast.Call) -> bool:
    """Whether a call reads a file by its path."""
    function = call.func
    if isinstance(function, ast.Name):
        return function.id == "open" and not writes(call.args[1:2])
    if not isinstance(function, ast.Attribute):
        return False
    owner = function.value.id if isinstance(function.value, ast.Name) else ""
    if owner in FOREIGN or owner in ("documents", "webbrowser"):
        return False
    if function.attr in ("read_bytes", "read_text"):
        return True
    is_file = owner == "os" or bool(
        call.args and isinstance(call.args[0], ast.Constant) and "r" in str(call.args[0].value)
    )
    return function.attr == "open" and is_file


def writes(mode: list[ast.expr]) -> bool:
    return bool(mode) and isinstance(mode[0], ast.Constant) and not set("wxa").isdisjoint(str(mode[0].value))


def reads_a_path(call: ast.Call) -> bool:
    """Whether a reader of another package is given something else than bytes in memory, or an image without its formats."""
    function = call.func
    if not isinstance(function, ast.Attribute) or not isinstance(function.value, ast.Name):
        return False
    name, owner = function.attr, function.value.id
    if owner not in FOREIGN or not name.startswith(READERS) or name in WITHOUT_A_FILE:
        return False
    if owner == "Image" and "formats" not in {keyword.arg for keyword in call.keywords}:
        return True
    given = call.args[0] if call.args else None
    return not (isinstance(given, ast.Call) and ast.unparse(given.func) in ("io.BytesIO", "BytesIO"))


def calls(test) -> list[str]:
    return [
        f"{relative(path)}:{node.lineno}: {ast.unparse(node)[:80]}"
        for path in python_files("src")
        if relative(path) != GATE and "templates" not in path.parts
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.Call) and test(node)
    ]


def test_files_are_read_through_the_gate():
    own = [each for each in calls(opens_itself) if each.partition(":")[0] not in OWN_READERS]
    assert not own, (
        "use tussle.documents.read_bytes or read_text, which refuse pipes and devices and bound the size"
    )


def test_modules_with_readers_of_their_own_still_have_them():
    found = {each.partition(":")[0] for each in calls(opens_itself)}
    assert not set(OWN_READERS) - found


def test_readers_of_other_packages_get_bytes():
    assert not calls(reads_a_path), (
        "read the file by tussle.documents.read_bytes, and name the formats of images"
    )


def test_web_servers_are_made_by_one_class():
    def makes(call: ast.Call) -> bool:
        return ast.unparse(call.func).rpartition(".")[2] in SERVERS

    own = [each for each in calls(makes) if each.partition(":")[0] != SERVER_MODULE]
    assert not own, "use WebServer, which is silent and raises the errors of its set-up"
    assert calls(makes)


@pytest.mark.parametrize(
    ("code", "test"),
    [
        ("open(path)", opens_itself),
        ("path.read_bytes()", opens_itself),
        ("path.open('rb')", opens_itself),
        ("Image.open(path, formats=F)", reads_a_path),
        ("Image.open(io.BytesIO(data))", reads_a_path),
        ("nx.read_graphml(path)", reads_a_path),
        ("np.load(self.file)", reads_a_path),
    ],
)
def test_the_rules_find_what_they_are_for(code, test):
    assert test(ast.parse(code, mode="eval").body)


@pytest.mark.parametrize(
    "code",
    [
        "documents.read_text(path, E)",
        "path.open('wb')",
        "Image.open(io.BytesIO(d), formats=F)",
        "tomllib.loads(text)",
        "page.open()",
    ],
)
def test_the_rules_let_others_be(code):
    call = ast.parse(code, mode="eval").body
    assert not opens_itself(call)
    assert not reads_a_path(call)
