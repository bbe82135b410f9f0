"""What may be imported: by kernels, by the package at all, and by `import tussle`."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from graphlib import CycleError, TopologicalSorter

import pytest
from tree import ROOT, imported_modules, parsed, python_files, relative

FOR_KERNELS = (
    "__future__",
    "typing",
    "numpy",
    "numba",
    "math",
    "tussle.numeric",
    "tussle.rng",
    "tussle.neighbors",
)
# Of NumPy, what makes scratch arrays and names constants and types, and the functions that IEEE 754 rounds exactly.
NUMPY_FOR_KERNELS = {
    *("empty", "zeros", "ones", "full", "empty_like", "zeros_like", "arange"),
    *("inf", "nan", "pi", "float64", "int64", "uint64", "bool_", "ndarray"),
    *("sqrt", "floor", "abs", "minimum", "maximum", "isnan", "isfinite"),
}
OPTIONAL_PARTS = ("tussle.view", "tussle.batch", "tussle.rl", "tussle.bridges", "tussle.cli")


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
            found.add(re.match(r"[A-Za-z0-9._-]+", line)[0].lower().replace("-", "_"))
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


@pytest.mark.parametrize("path", [p for p in python_files("src") if p.name == "kernels.py"], ids=relative)
def test_kernels_import_only_what_the_kernel_cache_can_follow(path):
    own_package = ".".join(path.relative_to(ROOT / "src").parent.parts)
    for line, name in imported_modules(parsed(path)):
        allowed = is_within(name, FOR_KERNELS) or name.startswith(own_package + ".")
        assert allowed, f"{relative(path)}:{line} imports {name}; a kernel takes {', '.join(FOR_KERNELS)}"


@pytest.mark.parametrize("path", [p for p in python_files("src") if p.name == "kernels.py"], ids=relative)
def test_kernels_take_from_numpy_only_what_is_the_same_on_every_machine(path):
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "np":
            assert node.attr in NUMPY_FOR_KERNELS, f"{relative(path)}:{node.lineno} uses np.{node.attr}"


def test_declared_dependencies_are_the_imported_ones():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = [name for name in project["optional-dependencies"] if name not in ("test", "frames")]
    used = {name.lower() for name in third_party("src")}
    declared = requirements(project, *extras)
    assert used - {"llvmlite", "mpl_toolkits"} == declared, (
        "llvmlite comes with numba, mpl_toolkits with matplotlib"
    )


@pytest.mark.parametrize("path", python_files("src"), ids=relative)
def test_packages_of_extras_are_imported_where_they_are_used(path):
    """At the head of a module they would be needed by whoever loads it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    core = requirements(project) | {"llvmlite", "tussle"} | sys.stdlib_module_names
    statements = [
        node
        for node in parsed(path).body
        if isinstance(node, ast.Import | ast.ImportFrom) and not getattr(node, "level", 0)
    ]
    for node in statements:
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module]
        for name in names:
            package = name.split(".")[0].lower()
            assert package in core, (
                f"{relative(path)}:{node.lineno} imports {name}, which only an extra installs"
            )


@pytest.mark.parametrize("tree", ["tests", "examples", "benchmarks"])
def test_what_tests_and_examples_import_is_in_the_test_extra(tree):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    used, declared = third_party(tree), requirements(project, "test")
    missing = {name: place for name, place in used.items() if name.lower() not in declared | {"_pytest"}}
    assert not missing


def test_importing_the_package_loads_no_shipped_plugin_and_no_optional_part():
    script = "import sys, tussle; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = run.stdout.split()
    assert "tussle" in loaded
    plugins = [name for name in loaded if re.fullmatch(r"tussle\.stock\.[a-z]+\..+", name)]
    assert not plugins
    assert not [name for name in loaded if is_within(name, OPTIONAL_PARTS)]
