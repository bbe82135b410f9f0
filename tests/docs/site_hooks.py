"""Hooks of MkDocs: pages that are made from code, and pages that show the files outside docs/ to which pages link.

The same pages are read on code hosts, where links lead to files of the repository. On the site each such file has a page of its own.
"""

from __future__ import annotations

import importlib
import inspect
import logging
import os
import posixpath
import re
from collections.abc import Iterator

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from pages import FENCE, ROOT
from reference import PARTS, inherited, public

LINK = re.compile(r"(?<=\]\()(?!\w+:|#)([^)#\s]+)")
"""Target of a link to a file, without its anchor."""
EXTERNAL = re.compile(r'href="(https?://[^"]+)')
LOG = logging.getLogger("mkdocs.hooks.site")
FILES = "files"
"""Folder of the site for files outside docs/."""
PROJECT = "README.md", "CONTRIBUTING.md", "CODING.md", "tests/README.md", "CODE_OF_CONDUCT.md", "CHANGELOG.md"
"""Files outside docs/ that stand in the navigation."""
MODULES = {module: title for module, title in PARTS.items() if module != "tussle.stock"}


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Complete the navigation: plugins by kind, public modules, files outside docs/."""
    if "MIKE_DOCS_VERSION" in os.environ:  # only there is a list of versions, which the page asks for
        config.extra["version"] = {"provider": "mike"}
    assert config.nav is not None
    sections = {
        title: entries for each in config.nav if isinstance(each, dict) for title, entries in each.items()
    }
    sections["Project"][:] = [site_path(name) for name in PROJECT]
    sections["Reference"][:0] = [
        {"Python": ["reference.md", *(f"reference/{module}.md" for module in MODULES)]},
        {"Plugins": ["plugins/index.md", *plugins_by_kind()]},
    ]
    return config


def plugins_by_kind() -> Iterator[dict[str, list[str]]]:
    """Pages of plugins, as their index lists them."""
    for part in (ROOT / "docs/plugins/index.md").read_text().split("\n## ")[1:]:
        yield {part.split()[0]: [f"plugins/{name}" for name in LINK.findall(part)]}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for each public module, and for each file outside docs/ to which a page links."""
    for module in MODULES:
        files.append(File.generated(config, f"reference/{module}.md", content=module_page(module)))
    seen: set[str] = set()
    waiting = [
        *PROJECT,
        *(f"docs/{file.src_uri}" for file in files.documentation_pages() if not file.generated_by),
    ]
    while waiting:
        path = waiting.pop()
        if path in seen or not (ROOT / path).exists():  # MkDocs warns of what does not exist
            continue
        seen.add(path)
        if path.endswith(".md"):
            waiting += [target(path, link) for link in LINK.findall(FENCE.sub("", (ROOT / path).read_text()))]
        waiting += files_in(path)
        if not path.startswith("docs/"):
            files.append(File.generated(config, site_path(path), content=shown(path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let links of the pages in docs/ lead to pages of the site."""
    if page.file.src_uri == "reference.md":  # the same in one page, for who reads it without a site
        return module_index()
    return markdown if page.file.generated_by else linked(f"docs/{page.file.src_uri}", markdown)


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> None:
    """List links to other sites, which are not followed."""
    for link in sorted(set(EXTERNAL.findall(html))):
        LOG.info("%s links to %s", page.file.src_uri, link)


def linked(path: str, markdown: str) -> str:
    """A page of the repository with the links that it has on the site."""
    folder = posixpath.dirname(site_path(path)) or "."
    return LINK.sub(lambda link: posixpath.relpath(site_path(target(path, link[1])), folder), markdown)


def target(path: str, link: str) -> str:
    """Path in the repository of what a page links to."""
    found = posixpath.normpath(posixpath.join(posixpath.dirname(path), link))
    return f"{found}/README.md" if (ROOT / found / "README.md").exists() else found


def site_path(path: str) -> str:
    """Where a file of the repository stands among the sources of the site."""
    if path.startswith("docs/"):
        return path.removeprefix("docs/")
    return f"{FILES}/{path}{'' if path.endswith('.md') or is_binary(path) else '.md'}"


def is_binary(path: str) -> bool:
    """Whether a file is not text."""
    return (ROOT / path).is_file() and b"\0" in (ROOT / path).read_bytes()


def shown(path: str) -> str | bytes:
    """Content of the page for a file outside docs/: itself, its text as a block of code, or the list of a folder."""
    file = ROOT / path
    if is_binary(path):
        return file.read_bytes()
    if path.endswith(".md"):
        return linked(path, file.read_text())
    head = f"---\nsearch:\n  exclude: true\n---\n\n# `{path}`\n\n"
    if file.is_dir():
        names = (posixpath.relpath(each, path) for each in files_in(path))
        return linked(path, head + "".join(f"- [{name}]({file.name}/{name})\n" for name in names))
    language = file.suffix[1:] if file.suffix in (".py", ".xml", ".cpp") else "text"
    return f"{head}`````{language}\n{file.read_text()}\n`````\n"


def files_in(path: str) -> list[str]:
    """Paths in the repository of the files in a folder and its folders; none if the path is that of a file."""
    found = (
        each for each in (ROOT / path).rglob("*.*") if each.is_file() and "__pycache__" not in each.parts
    )
    return sorted(each.relative_to(ROOT).as_posix() for each in found)


def module_index() -> str:
    """The page that stands on the site in place of docs/reference.md."""
    rows = (f"| [`{module}`](reference/{module}.md) | {title} |\n" for module, title in MODULES.items())
    return (
        "# Reference of Python names\n\nAll public names, by module. "
        "The [plugins that ship](plugins/index.md) have a page each.\n\n| module | |\n|---|---|\n"
        + "".join(rows)
    )


def module_page(module: str) -> str:
    """The page of a module: its names with what they do, and then each of them, by mkdocstrings."""
    doc = inspect.getdoc(importlib.import_module(module)) or ""
    lines = [f"---\ntitle: {module}\n---\n\n# {MODULES[module]}: `{module}`\n\n{doc}\n"]
    for name, value in public(module).items():
        lines.append(f"::: {module}.{name}\n    options:\n      inherited_members: {inherited(value)}\n")
    return "\n".join(lines)
