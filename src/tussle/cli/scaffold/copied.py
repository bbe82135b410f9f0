"""Merge the source of a stock plugin and its kernels into one file."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
from pathlib import Path
from typing import Any

from tussle.errors import ParameterError


def class_renamed(source: str, old: str, new: str) -> str:
    """Replace a class name wherever it occurs as a word."""
    return re.sub(rf"\b{old}\b", new, source)


def merged(cls: type[Any]) -> str:
    """Return the source of a plugin's file, with its kernels inserted before the class.

    Raises:
        ParameterError: The source cannot be read.
    """
    try:
        path = Path(inspect.getfile(cls))
        text = path.read_text(encoding="utf-8")
    except (OSError, TypeError) as error:
        raise ParameterError(f"--from {cls.__name__}: its source cannot be read: {error}") from error
    package = cls.__module__ if path.stem == "__init__" else cls.__module__.rpartition(".")[0]
    beside = path.with_name("kernels.py")
    if not beside.is_file() or f"from {package} import kernels" not in text:
        return text
    kernels = importlib.import_module(f"{package}.kernels")
    return _joined(_Parts(text), _Parts(Path(str(kernels.__file__)).read_text(encoding="utf-8")), package)


class _Parts:
    """The docstring, the imports and the remaining source of a module."""

    def __init__(self, text: str) -> None:
        self.tree = ast.parse(text)
        self.doc = ast.get_docstring(self.tree) or ""
        lines = text.splitlines()
        imports = [n for n in self.tree.body if isinstance(n, ast.Import | ast.ImportFrom)]
        self.imports = ["\n".join(lines[n.lineno - 1 : n.end_lineno]) for n in imports]
        last = max((n.end_lineno or 0 for n in imports), default=self.tree.body[0].end_lineno or 0)
        self.rest = "\n".join(lines[last:]).strip("\n")

    def names(self) -> set[str]:
        """Names bound inside functions, which would hide names of the module."""
        functions = [n for n in ast.walk(self.tree) if isinstance(n, ast.FunctionDef | ast.Lambda)]
        inside = [n for f in functions for n in ast.walk(f)]
        return {n.arg for n in inside if isinstance(n, ast.arg)} | {
            n.id for n in inside if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
        }

    def defined(self) -> list[str]:
        """Names defined at the top level of the module."""
        found = [n.name for n in self.tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)]
        assigned = [n for n in self.tree.body if isinstance(n, ast.Assign | ast.AnnAssign)]
        names = [n for a in assigned for n in ast.walk(a) if isinstance(n, ast.Name)]
        return found + [n.id for n in names if isinstance(n.ctx, ast.Store)]


def _joined(plugin: _Parts, kernels: _Parts, package: str) -> str:
    body, law = plugin.rest, kernels.rest
    taken = plugin.names() | set(plugin.defined())
    for name in kernels.defined():
        kept = f"{name}_kernel" if name in taken else name
        body = re.sub(rf"\bkernels\.{name}\b", kept, body)
        law = re.sub(rf"(?<![\w.]){name}\b", kept, law) if kept != name else law
    wanted = [i for i in plugin.imports if i != f"from {package} import kernels"]
    wanted += [i for i in kernels.imports if i not in wanted]
    future = "from __future__ import annotations"
    ours = sorted(i for i in wanted if i.startswith(("from tussle", "import tussle")))
    numpy = sorted(i for i in wanted if i.startswith(("import numpy", "from numpy")))
    first = sorted(i for i in wanted if i not in (*ours, *numpy, future))
    head = ["\n".join(group) for group in ([future], first, [*numpy], ours) if group]
    about = "\n".join(f"# {line}".rstrip() for line in kernels.doc.splitlines())
    return "\n\n".join([f'"""{plugin.doc}"""', *head, about, law]) + f"\n\n\n{body}\n"
