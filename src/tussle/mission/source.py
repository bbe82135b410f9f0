"""From a file name to one tree: reading, decoding, placeholders, and includes that stay where they may."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tussle.errors import MissionError, listed, nearest_name
from tussle.mission.node import Budget, Node, parse
from tussle.mission.placeholders import replace_placeholders
from tussle.mission.problems import Place, Problems
from tussle.texts import shown

LIBRARY = Path(__file__).parent / "library"
XINCLUDE = "http://www.w3.org/2001/XInclude}"
XML = "http://www.w3.org/XML/1998/namespace}"
ENCODING = re.compile(rb"<\?xml[^>]{0,200}?encoding\s*=\s*[\"']([A-Za-z0-9._-]{1,40})[\"']")
ENCODINGS = ("utf-8", "us-ascii", "iso-8859-1", "windows-1252")
POINTER = re.compile(r"xpointer\(((?:/(?:\*|[\w.-]+))+)\)")
TITLE = re.compile(r"<runscript[^>]{0,2000}?\sname\s*=\s*(?:\"([^\"]{0,200})\"|'([^']{0,200})')", re.DOTALL)


def shipped_missions() -> dict[str, tuple[Path, str]]:
    """Missions that come with tussle: name -> (file, title)."""
    found = {}
    for path in sorted(LIBRARY.glob("*.xml")):
        title = TITLE.search(path.read_text(encoding="utf-8"))
        found[path.stem] = (path, (title[1] or title[2] or "") if title else "")
    return found


def find_mission(source: str | Path, search: Sequence[str | Path] = ()) -> Path:
    """The file that is meant: a shipped mission's name, a path, or a path below one of the search paths.

    Raises:
        MissionError: There is none.
    """
    shipped = shipped_missions()
    if isinstance(source, str) and source in shipped:
        return shipped[source][0]
    if "\0" in str(source):
        raise MissionError(f"{shown(str(source))} is not a file name")
    path = _expanded(source)
    candidates = [path] if path.is_absolute() else [path, *(_expanded(s) / path for s in search)]
    for candidate in candidates:
        if _is_file(candidate):
            return candidate
    is_folder = os.path.isdir(path)  # noqa: PTH112  it is False where Path.is_dir raises, as for a name too long
    why = "is a folder, not a mission file" if is_folder else "is no file and no mission that ships"
    raise MissionError(
        f"{shown(str(source))} {why}{nearest_name(path.stem[:80], shipped)}; shipped {listed(shipped)}"
    )


def _expanded(path: str | Path) -> Path:
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return Path(path)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name too long for the file system, or no right to look
        return False


def read_text(path: Path, budget: Budget) -> str:
    """A file's text.

    Raises:
        MissionError: It cannot be read or decoded, or is too long.
    """
    try:
        # Opening a pipe or a device could wait for ever.
        if not stat.S_ISREG(path.stat().st_mode):
            raise MissionError(f"{path}: this is not a regular file")
        with path.open("rb") as file:
            data = file.read(budget.limits.text + 1)
    except (OSError, ValueError) as error:
        raise MissionError(
            f"{path}: it cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from None
    budget.spend_text(len(data), str(path))
    declared = ENCODING.match(data)
    name = declared[1].decode("ascii").lower() if declared else "utf-8"
    if name not in ENCODINGS:
        raise MissionError(f"{path}:1: encoding {name!r} is not read; {listed(ENCODINGS)}")
    try:
        text = data.decode("utf-8-sig" if name == "utf-8" else name)
        if declared and name != "utf-8":
            # The resolved text is written as UTF-8.
            text = text.replace(declared[1].decode("ascii"), "utf-8", 1)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise MissionError(f"{path}:{line}: byte {data[error.start]:#04x} is not {name} text") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


@dataclass
class Source:
    """A mission's tree and what it was made from.

    Attributes:
        path: The mission's file.
        root: Its tree, with what it includes.
        text: Its text with placeholders replaced; with includes, the tree written out.
        placeholders: Names that can be set, with their defaults.
        files: All files that were read.
    """

    path: Path
    root: Node
    text: str
    placeholders: dict[str, str] = field(default_factory=dict)
    files: list[Path] = field(default_factory=list)


class Reader:
    """Reads one mission's files.

    Args:
        overrides: Values of placeholders.
        problems: Receives what is wrong but does not end the reading.
        budget: Limits on how much it may be.
        search: Folders from which files may be included, besides the mission's own.
    """

    def __init__(
        self,
        overrides: Mapping[str, str],
        problems: Problems,
        budget: Budget,
        search: Sequence[str | Path] = (),
    ) -> None:
        self.overrides = overrides
        self.problems = problems
        self.budget = budget
        self.search = [_expanded(s) for s in search]
        self.placeholders: dict[str, str] = {}
        self.files: list[Path] = []

    def read(self, path: Path, text: str | None = None) -> Source:
        """All of a mission.

        Raises:
            MissionError: It cannot be read.
        """
        root, resolved = self._file(path, text)
        roots = [path.parent.resolve(), *(s.resolve() for s in self.search)]
        if root.tag.startswith(XINCLUDE):
            raise MissionError(f"{root.place}: the outermost tag is runscript, not an include")
        n_before = len(self.files)
        self._include_all(root, [path.resolve()], roots)
        if len(self.files) > n_before:
            resolved = root.to_text()
        return Source(path, root, resolved, self.placeholders, self.files)

    def _file(self, path: Path, text: str | None = None) -> tuple[Node, str]:
        text = read_text(path, self.budget) if text is None else text
        replaced = replace_placeholders(text, str(path), self.overrides, self.problems, self.budget)
        for name, default in replaced.names.items():
            self.placeholders.setdefault(name, default)
        self.files.append(path)
        return parse(replaced.text, str(path), self.budget, replaced.line_of), replaced.text

    def _include_all(self, node: Node, inside: list[Path], roots: list[Path]) -> None:
        """Put what is included in the place of each include below a node."""
        if not any(child.tag.startswith(XINCLUDE) for child in node.children):
            for child in node.children:
                self._include_all(child, inside, roots)
            return
        children: list[Node] = []
        for child in node.children:
            if child.tag.startswith(XINCLUDE):
                children += self._included(child, inside, roots)
            else:
                self._include_all(child, inside, roots)
                children.append(child)
        node.children = children

    def _included(self, node: Node, inside: list[Path], roots: list[Path]) -> list[Node]:
        limits = self.budget.limits
        path = self._target(node, inside[-1], roots)
        if path in inside:
            chain = " -> ".join(p.name for p in [*inside[inside.index(path) :], path])
            raise MissionError(f"{node.place}: a file includes itself: {chain}")
        if len(inside) > limits.include_depth:
            raise MissionError(f"{node.place}: files include files more than {limits.include_depth} deep")
        if len(self.files) > limits.files:
            raise MissionError(
                f"{node.place}: more than {limits.files} files are included; for a file you trust there is allow_large"
            )
        root, _ = self._file(path)
        holder = Node("", {}, "", [root], root.place)
        self._include_all(holder, [*inside, path], roots)
        return self._pointed(node, holder)

    def _target(self, node: Node, including: Path, roots: list[Path]) -> Path:
        """The file that an include names, if it may be read.

        Raises:
            MissionError: It may not, or the include asks for more than a file.
        """
        place = node.where("href")
        allowed = {"href", "xpointer", "parse", XML + "base"}
        for name in node.attributes:
            if name not in allowed:
                raise MissionError(f"{node.where(name)}: include takes href and xpointer, not {shown(name)}")
        if node.tag != XINCLUDE + "include" or node.children or node.attributes.get("parse", "xml") != "xml":
            raise MissionError(
                f"{node.place}: of XInclude, only <xi:include href=... xpointer=.../> is read, without fallback or parse='text'"
            )
        href, base = node.attributes.get("href", ""), node.attributes.get(XML + "base", "")
        for part in (href, base):
            if ":" in part or part.startswith(("/", "~")) or "\\" in part or "\0" in part:
                raise MissionError(
                    f"{place}: {shown(part)} cannot be included; it takes a path relative to the including file"
                )
        if not href:
            raise MissionError(f"{place}: an include needs href='FILE'")
        start = [including.parent, *self.search]
        try:
            found = [p for p in ((s / base / href).resolve() for s in start) if _is_file(p)]
        except (OSError, RuntimeError) as error:
            raise MissionError(f"{place}: {shown(href)} cannot be included: {error}") from None
        inside = [p for p in found if any(p.is_relative_to(root) for root in roots)]
        if inside:
            return inside[0]
        if found:
            raise MissionError(
                f"{place}: {shown(base + href)} lies outside the mission's folder and the search paths, so it is not included; "
                f"add its folder to the search paths"
            )
        raise MissionError(f"{place}: there is no file {shown(base + href)} to include")

    def _pointed(self, node: Node, holder: Node) -> list[Node]:
        """What an include's xpointer selects; all without one."""
        pointer = node.attributes.get("xpointer")
        if pointer is None:
            return holder.children
        match = POINTER.fullmatch(pointer.strip())
        if match is None:
            raise MissionError(
                f"{node.where('xpointer')}: xpointer {shown(pointer)} is not read; it takes xpointer(/NAME/NAME/*)"
            )
        found = [holder]
        for step in match[1].strip("/").split("/"):
            found = [child for parent in found for child in parent.children if step in ("*", child.tag)]
        if not found:
            self.problems.note(Place(*node.where("xpointer")), f"xpointer {shown(pointer)} selects nothing")
        return [child.copied() for child in found]
