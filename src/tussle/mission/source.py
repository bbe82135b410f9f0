"""Reading of a mission's files into one tree: decoding, placeholders and includes, which are confined to allowed folders."""

from __future__ import annotations

import codecs
import os
import re
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import escape

from tussle.declare.texts import shown
from tussle.documents import size_of
from tussle.errors import MissionError, listed, nearest_name
from tussle.folders import real_path
from tussle.mission.node import Budget, Node, parse
from tussle.mission.problems import Place, Problems
from tussle.plugins import stock

LIBRARY = Path(__file__).parent / "library"
XINCLUDE = "http://www.w3.org/2001/XInclude}"
XML = "http://www.w3.org/XML/1998/namespace}"
ENCODING = re.compile(rb"<\?xml[^>]{0,200}?encoding\s*=\s*[\"']([A-Za-z0-9._-]{1,40})[\"']")
ENCODINGS = ("utf-8", "us-ascii", "iso-8859-1", "windows-1252")
POINTER = re.compile(r"xpointer\(((?:/(?:\*|[\w.-]+))+)\)")
TITLE = re.compile(r"<runscript[^>]{0,2000}?\sname\s*=\s*(?:\"([^\"]{0,200})\"|'([^']{0,200})')", re.DOTALL)


def shipped_missions() -> dict[str, tuple[Path, str]]:
    """Missions shipped with tussle: name -> (file, title)."""
    found = {}
    for path in sorted(LIBRARY.glob("*.xml")):
        title = TITLE.search(path.read_text(encoding="utf-8"))
        found[path.stem] = (path, (title[1] or title[2] or "") if title else "")
    return found


def find_mission(source: str | Path, search: Sequence[str | Path] = ()) -> Path:
    """Find a mission's file: by the name of a shipped mission or of a stock plugin (its example), or by path, also below a search path.

    Raises:
        MissionError: There is no such file.
    """
    shipped = shipped_missions()
    if isinstance(source, str) and source in shipped:
        return shipped[source][0]
    if isinstance(source, str) and source in stock.examples():
        return stock.examples()[source]
    if "\0" in str(source):
        raise MissionError(f"{shown(str(source))} is not a file name")
    path = _expanded(source)
    candidates = [path] if path.is_absolute() else [path, *(_expanded(s) / path for s in search)]
    for candidate in candidates:
        if _is_file(candidate):
            return candidate
    is_folder = os.path.isdir(path)  # noqa: PTH112  Path.is_dir raises for names that are too long
    why = "is a folder, not a mission file" if is_folder else "is neither a file nor a shipped mission"
    raise MissionError(
        f"{shown(str(source))} {why}{nearest_name(path.stem, [*shipped, *stock.examples()])}; of shipped missions {listed(shipped)}"
    )


def _expanded(path: str | Path) -> Path:
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return Path(path)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # the name is too long for the file system, or the folder is not readable
        return False


def read_text(path: Path, budget: Budget) -> str:
    """Read a file's text.

    Raises:
        MissionError: It cannot be read or decoded, or is too long.
    """
    try:
        size_of(path)  # refuses pipes and devices
        with path.open("rb") as file:
            data = file.read(budget.limits.text + 1)
    except (OSError, ValueError) as error:
        raise MissionError(
            f"{path}: it cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from None
    budget.spend_text(len(data), str(path))
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise MissionError(f"{path}:1: this is UTF-16 or UTF-32 text; save the file as UTF-8")
    declared = ENCODING.match(data)
    name = declared[1].decode("ascii").lower() if declared else "utf-8"
    if name not in ENCODINGS:
        raise MissionError(f"{path}:1: encoding {name!r} is not supported; {listed(ENCODINGS)}")
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
class MissionSource:
    """A mission's tree and its sources.

    Attributes:
        path: The mission's file.
        root: Its tree, includes resolved.
        text: Its text with placeholders replaced; if there are includes, the tree written as XML.
        own_text: The text of the mission's file alone, with placeholders replaced.
        placeholders: Names that can be set, with their defaults.
        places: Name of a placeholder -> places where it stands.
        files: All files that were read.
    """

    path: Path
    root: Node
    text: str
    own_text: str
    placeholders: dict[str, str] = field(default_factory=dict)
    places: dict[str, list[Place]] = field(default_factory=dict)
    files: list[Path] = field(default_factory=list)


class SourceReader:
    """Reads one mission's files.

    Args:
        overrides: Values of placeholders.
        problems: Receives errors and notes that do not stop the reading.
        budget: Limits on the size of the files.
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
        self.places: dict[str, list[Place]] = {}
        self.files: list[Path] = []

    def read(self, path: Path, text: str | None = None) -> MissionSource:
        """Read a mission with its includes.

        Raises:
            MissionError: It cannot be read.
        """
        root, own_text = self._file(path, text)
        roots = [real_path(path.parent), *(real_path(s) for s in self.search)]
        if root.tag.startswith(XINCLUDE):
            raise MissionError(f"{root.place}: the root tag must be <runscript>, not an include")
        n_before = len(self.files)
        self._include_all(root, [real_path(path)], roots)
        resolved = root.to_text() if len(self.files) > n_before else own_text
        return MissionSource(path, root, resolved, own_text, self.placeholders, self.places, self.files)

    def _file(self, path: Path, text: str | None = None) -> tuple[Node, str]:
        text = read_text(path, self.budget) if text is None else text
        overrides = {"folder": str(real_path(path.parent)), **self.overrides}
        replaced = replace_placeholders(text, str(path), overrides, self.problems, self.budget)
        for name, default in replaced.names.items():
            self.placeholders.setdefault(name, default)
            self.places.setdefault(name, []).extend(replaced.places[name])
        self.files.append(path)
        return parse(replaced.text, str(path), self.budget, replaced.line_of, self.problems)

    def _include_all(self, node: Node, inside: list[Path], roots: list[Path]) -> None:
        """Replace each include below a node by the tags that it includes."""
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
            raise MissionError(f"{node.place}: includes are nested more than {limits.include_depth} deep")
        if len(self.files) > limits.files:
            raise MissionError(
                f"{node.place}: more than {limits.files} files are included; use allow_large for a file that you trust"
            )
        root, _ = self._file(path)
        holder = Node("", {}, "", [root], root.place)
        self._include_all(holder, [*inside, path], roots)
        return self._selected(node, holder)

    def _target(self, node: Node, including: Path, roots: list[Path]) -> Path:
        """Return the file that an include names, if it may be read.

        Raises:
            MissionError: The file may not be included, or the include uses features that are not supported.
        """
        place = node.where("href")
        allowed = {"href", "xpointer", "parse", XML + "base"}
        for name in node.attributes:
            if name not in allowed:
                raise MissionError(f"{node.where(name)}: include takes href and xpointer, not {shown(name)}")
        if node.tag != XINCLUDE + "include" or node.children or node.attributes.get("parse", "xml") != "xml":
            raise MissionError(
                f"{node.place}: of XInclude, only <xi:include href=... xpointer=.../> is supported, without fallback or parse='text'"
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
            found = [p for p in (real_path(s / base / href) for s in start) if _is_file(p)]
        except (OSError, RuntimeError) as error:
            raise MissionError(f"{place}: {shown(href)} cannot be included: {error}") from None
        inside = [p for p in found if any(p.is_relative_to(root) for root in roots)]
        if inside:
            return inside[0]
        if found:
            raise MissionError(
                f"{place}: {shown(base + href)} lies outside the mission's folder and the search paths, so it is not included; "
                f"--data-path DIR (search=[DIR]) adds a folder to these"
            )
        raise MissionError(f"{place}: there is no file {shown(base + href)} to include")

    def _selected(self, node: Node, holder: Node) -> list[Node]:
        """Return the tags that an include's xpointer selects; all tags without one."""
        pointer = node.attributes.get("xpointer")
        if pointer is None:
            return holder.children
        match = POINTER.fullmatch(pointer.strip())
        if match is None:
            raise MissionError(
                f"{node.where('xpointer')}: xpointer {shown(pointer)} is not supported; it takes xpointer(/NAME/NAME/*)"
            )
        found = [holder]
        for step in match[1].strip("/").split("/"):
            found = [child for parent in found for child in parent.children if step in ("*", child.tag)]
        if not found:
            self.problems.note(Place(*node.where("xpointer")), f"xpointer {shown(pointer)} selects nothing")
        return [child.copied() for child in found]


PLACEHOLDER = re.compile(r"\$\{([^=${}\s]{1,200})(?:=([^{}]*))?\}")


@dataclass
class Replaced:
    """A text after replacement of its placeholders.

    Attributes:
        text: The text to parse.
        names: Placeholders outside comments, with their defaults.
        places: Name -> places where it stands outside comments.
        ends: Line of `text` at the end of each replacement that changed the number of lines.
        shifts: Number to add to lines from there on to get the line of the file.
    """

    text: str
    names: dict[str, str] = field(default_factory=dict)
    places: dict[str, list[Place]] = field(default_factory=dict)
    ends: list[int] = field(default_factory=list)
    shifts: list[int] = field(default_factory=list)

    @property
    def line_of(self) -> Callable[[int], int]:
        """Maps a line of the new text to the line of the file."""

        def shifted(line: int) -> int:
            i = bisect_right(self.ends, line)
            return max(1, line + (self.shifts[i - 1] if i else 0))

        return shifted


def _comments(text: str) -> Iterator[tuple[int, int]]:
    """Begin and end of each comment. A regular expression would take quadratic time if many comments begin and none ends."""
    begin = text.find("<!--")
    while begin >= 0 and (end := text.find("-->", begin)) >= 0:
        yield begin, end
        begin = text.find("<!--", end)


def replace_placeholders(
    text: str, file: str, overrides: Mapping[str, str], problems: Problems, budget: Budget
) -> Replaced:
    """Replace every placeholder by its override, or else by its default.

    An override is a value, never markup: <, >, & and quotes in it are escaped.

    Raises:
        MissionError: The result is too long.
    """
    comments = list(_comments(text))
    starts = [a for a, _ in comments]
    safe = {name: escape(value, {'"': "&quot;"}) for name, value in overrides.items()}
    done, parts, out = 0, [], Replaced("")
    size, line, at, shift = 0, 1, 0, 0
    for match in PLACEHOLDER.finditer(text):
        name: str = match[1]
        default: str | None = match[2]
        place = Place(file, line + text.count("\n", at, match.start()))
        i = bisect_right(starts, match.start()) - 1
        is_comment = i >= 0 and match.start() < comments[i][1]
        if not is_comment:
            out.names.setdefault(name, default or "")
            out.places.setdefault(name, []).append(place)
        value = safe.get(name, default)
        if value is None:
            value = match[0] if is_comment else ""
            if not is_comment:
                problems.error(
                    place,
                    f"${{{name}}} has no default and is not set; write ${{{name}=default}} or set {name}",
                )
        parts += [text[done : match.start()], value]
        size += match.start() - done + len(value)
        if size > budget.limits.text:
            raise MissionError(
                f"{file}: the mission is longer than {budget.limits.text:,} characters with its placeholders replaced"
            )
        done = match.end()
        line, at = line + text.count("\n", at, done), done
        change = match[0].count("\n") - value.count("\n")
        if change:
            shift += change
            out.ends.append(line - shift)
            out.shifts.append(shift)
    out.text = "".join([*parts, text[done:]])
    budget.spend_text(max(0, len(out.text) - len(text)), file)
    return out
