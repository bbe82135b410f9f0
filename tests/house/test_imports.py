"""What may be imported: by kernels, by the package at all, and by `import tussle`."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from tree import ROOT, imported_modules, parsed, python_files, relative

FOR_KERNELS = (
    "__future__",
    "typing",
    "numpy",
    "numba",
    "math",
    "tussle.numeric",
    "tussle.numeric.rng",
    "tussle.numeric.neighbors",
    "tussle.world.contacts",
)
# Of NumPy, what makes scratch arrays and names constants and types, and the functions that IEEE 754 rounds exactly.
NUMPY_FOR_KERNELS = {
    *("empty", "zeros", "ones", "full", "empty_like", "zeros_like", "arange"),
    *("inf", "nan", "pi", "float64", "int64", "uint64", "bool_", "ndarray"),
    *("sqrt", "floor", "abs", "minimum", "maximum", "isnan", "isfinite"),
}
OF_ROS = {"rospy", "geometry_msgs", "nav_msgs", "sensor_msgs"}  # packages of Debian, which `.ci/run` installs
OF_CI = {"griffe", "mkdocs", "rerun"}  # of the extras `docs` and `rerun`, which `.ci/run` installs
OTHERS = {"opendis", "torchrl", "actors_pb2", "actors_pb2_grpc", "command_pb2", "command_pb2_grpc"}
"""Installed by `.ci/run` without its dependencies; tried where it is there; modules that protoc makes in tests."""
IMPORTED_AS = {
    "foxglove_sdk": "foxglove",
    "pillow": "pil",
    "protobuf": "google",
    "rerun_sdk": "rerun",
    "grpcio": "grpc",
    "grpcio_tools": "grpc_tools",
}
OPTIONAL_PARTS = (
    "tussle.view",
    "tussle.batch",
    "tussle.rl",
    "tussle.plan",
    "tussle.cli.bridges",
    "tussle.cli",
)


def is_within(name: str, packages: tuple[str, ...]) -> bool:
    return any(name == package or name.startswith(package + ".") for package in packages)


def requirements(project: dict, *extras: str) -> set[str]:
    """Packages that the project needs with some extras, by the names they are imported under; extras may name extras."""
    lists = [project["dependencies"], *(project["optional-dependencies"][extra] for extra in extras)]
    found = set()
    for line in (line for lines in lists for line in lines):
        inner = re.match(r"tussle\[(.*)\]", line)
        if inner:
            found |= requirements(project, *inner[1].split(","))
        else:
            name = re.match(r"[A-Za-z0-9._-]+", line)[0].lower().replace("-", "_")
            found.add(IMPORTED_AS.get(name, name))
    return found


def third_party(tree: str) -> dict[str, str]:
    """Outside packages that a folder imports, each with one place."""
    found: dict[str, str] = {}
    own = {path.stem for path in python_files(tree)} | {"tussle"}
    for path in python_files(tree):
        for line, name in imported_modules(parsed(path)):
            package = name.split(".")[0]
            if package not in own and package not in sys.stdlib_module_names and package != "None":
                found[package] = f"{relative(path)}:{line}"
    return found


def test_imports_make_no_circle():
    """Those for the type checker and those inside functions count: what names another module has it in mind."""
    files = {}
    for path in python_files("src"):
        parts = path.relative_to(ROOT / "src").with_suffix("").parts
        files[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    graph = {
        module: {
            name if name in files else name.rpartition(".")[0] for _, name in imported_modules(parsed(path))
        }
        for module, path in files.items()
    }
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"imports make a circle: {' <- '.join(error.args[1])}")


def kernel_files() -> list[Path]:
    return [path for path in python_files("src") if path.name == "kernels.py"]


def test_kernels_import_only_what_the_kernel_cache_can_follow():
    assert not [
        f"{relative(path)}:{line} imports {name}"
        for path in kernel_files()
        for line, name in imported_modules(parsed(path))
        if not is_within(name, FOR_KERNELS)
        and not name.startswith(".".join(path.relative_to(ROOT / "src").parent.parts) + ".")
    ]


def test_kernels_take_from_numpy_only_what_is_the_same_on_every_machine():
    assert not [
        f"{relative(path)}:{node.lineno} uses np.{node.attr}"
        for path in kernel_files()
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == "np"
        and node.attr not in NUMPY_FOR_KERNELS
    ]


def test_declared_dependencies_are_the_imported_ones():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = [name for name in project["optional-dependencies"] if name not in ("test", "frames", "docs")]
    used = {name.lower() for name in third_party("src")}
    declared = requirements(project, *extras)
    assert used - {"llvmlite", "mpl_toolkits", "vtkmodules"} == declared - {"tensorboard"}, (
        "llvmlite comes with numba, mpl_toolkits with matplotlib, vtkmodules with pyvista; torch imports tensorboard"
    )


def test_packages_of_extras_are_imported_where_they_are_used():
    """At the head of a module they would be needed by whoever loads it. `tussle.rl` makes subclasses of those of its own extra."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    core = requirements(project) | {"llvmlite", "tussle"} | sys.stdlib_module_names
    found = []
    for path in python_files("src"):
        allowed = core | requirements(project, "rl") if path.parent.name == "rl" else core
        for node in parsed(path).body:
            if isinstance(node, ast.Import | ast.ImportFrom) and not getattr(node, "level", 0):
                names = [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module]
                found += [
                    f"{relative(path)}:{node.lineno} imports {name}"
                    for name in names
                    if name.split(".")[0].lower() not in allowed
                ]
    assert not found


@pytest.mark.parametrize("tree", ["tests", "examples", "benchmarks"])
def test_what_tests_and_examples_import_is_in_the_test_extra(tree):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    used, declared = third_party(tree), requirements(project, "test")
    allowed = declared | OF_ROS | OF_CI | OTHERS | {"_pytest"}
    missing = {name: place for name, place in used.items() if name.lower() not in allowed}
    assert not missing


def test_no_test_module_imports_what_some_versions_of_python_lack():
    """Their tests are to skip there, and could not be collected."""
    extra = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]["test"]
    lacking = {
        IMPORTED_AS.get(name := each.split(">")[0], name) for each in extra if "python_version" in each
    }
    assert len(lacking) >= 4
    found = [
        f"{relative(path)}: {name}"
        for path in sorted((ROOT / "tests").rglob("test_*.py"))
        for node in ast.parse(path.read_text()).body
        for name in [*(each.name for each in getattr(node, "names", ())), getattr(node, "module", None) or ""]
        if isinstance(node, ast.Import | ast.ImportFrom) and name.split(".")[0] in lacking
    ]
    assert not found


def test_importing_the_package_loads_no_shipped_plugin_and_no_optional_part():
    script = "import sys, tussle; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = run.stdout.split()
    assert "tussle" in loaded
    plugins = [name for name in loaded if re.fullmatch(r"tussle\.stock\.[a-z]+\..+", name)]
    assert not plugins
    assert not [name for name in loaded if is_within(name, OPTIONAL_PARTS)]


DOORS = ("tussle.messages", "tussle.plan", "tussle.serve")  # which only users import
LOADED = (
    "tussle.plugins.stock",
    "tussle.plugins.historic",
    "tussle.cli.scaffold.templates",
)  # by name or as text


def test_each_module_is_imported_by_another():
    """A module that has moved leaves no copy behind."""
    files = {f: ".".join(f.relative_to(ROOT / "src").with_suffix("").parts) for f in python_files("src")}
    imports = {f: {name for _, name in imported_modules(parsed(f))} for f in files}
    texts = {
        n.value
        for f in files
        for n in ast.walk(parsed(f))
        if isinstance(n, ast.Constant) and isinstance(n.value, str)
    }
    used = {text.partition(":")[0] for text in texts}  # commands are loaded when they are called
    used |= {part for names in imports.values() for name in names for part in (name, name.rpartition(".")[0])}
    unused = {
        name
        for f, name in files.items()
        if f.name not in ("__init__.py", "__main__.py")
        and name not in used
        and not is_within(name, (*DOORS, *LOADED))
    }
    assert not unused
