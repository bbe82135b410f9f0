"""`tussle schema`: the XML schema of mission files (XSD 1.0), by which editors complete and check them.

It is made of the tables of tags and of the declarations of all plugins. In XSD 1.0 the content of a tag cannot decide on its attributes, so
a plugin's tag takes the attributes of all plugins of its kind; what XSD cannot say, `tussle check` checks.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from xml.etree import ElementTree as ET

from tussle.api import Plugin
from tussle.cli.options import PluginOptions
from tussle.cli.pages import allowed_text, default_text, first_sentence, load_plugins
from tussle.cli.terminal import WRONG_INPUT, out, say_error
from tussle.declare.columns import Param
from tussle.declare.texts import FALSE, TRUE
from tussle.declare.units import spellings
from tussle.mission import tags
from tussle.mission.catalogue import KINDS, historic
from tussle.mission.laws import COMPAT
from tussle.mission.scene_tags import BUILDING, TERRAIN, WALL
from tussle.mission.spec import BLOCK_VALUES, END_CONDITIONS, MISSION_VALUES

XS = "http://www.w3.org/2001/XMLSchema"
XINCLUDE = "http://www.w3.org/2001/XInclude"
TEXT = "text"
NUMBER = r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE][\-+]?[0-9]{1,3})?|inf"
PRODUCT = r"[A-Za-z%1/][A-Za-z0-9]*[/^* ][A-Za-z0-9/^* \-]*"
"""A unit of several factors, or with a power; that it is one and has the right dimension cannot be said here."""
ANY_UNIT = r"[A-Za-z%/][A-Za-z0-9%/^*\-]*( [A-Za-z][A-Za-z0-9%/^*\-]*)*"
PARAMS = {"update": MISSION_VALUES["update"], "placement": BLOCK_VALUES["placement"]}
ENUMS = {"compat": ("", *COMPAT)}


def schema(options: PluginOptions) -> int:
    """Print the schema, and report plugins that cannot be loaded and are not in it.

    Returns:
        The exit code.
    """
    found, _, wrong = load_plugins(options.plugin_files)
    out().file.write(mission_schema(found))
    for text in wrong:
        say_error(text)
    return WRONG_INPUT if wrong else 0


def mission_schema(plugins: Mapping[str, type[Plugin]]) -> str:
    """Return the schema of mission files with these plugins, by the names that missions give them."""
    root = ET.Element("xs:schema", {"xmlns:xs": XS})
    types = TypeTable(root)
    writer = SchemaWriter(types, plugins)
    runscript = ET.SubElement(root, "xs:element", name="runscript")
    _document(runscript, "A mission of tussle.")
    writer.add_content(runscript, tags.WORLD, tags.RUNSCRIPT)
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _document(parent: ET.Element, text: str) -> None:
    annotation = ET.Element("xs:annotation")
    ET.SubElement(annotation, "xs:documentation").text = text.replace("`", "")
    parent.insert(0, annotation)


class TypeTable:
    """The named simple types of a schema. In place of any value a placeholder is allowed.

    Args:
        root: The schema, to which types are added when they are first used.
    """

    def __init__(self, root: ET.Element) -> None:
        self.root = root
        self._names: dict[tuple[object, ...], str] = {}
        self._restrict(
            ET.SubElement(root, "xs:simpleType", name="placeholder"),
            "xs:string",
            [r"[\s\S]*\$\{[^=$\{\}\s]+(=[^\{\}]*)?\}[\s\S]*"],
        )
        self._restrict(ET.SubElement(root, "xs:simpleType", name=TEXT), "xs:string")

    @staticmethod
    def _restrict(
        parent: ET.Element, base: str, patterns: Iterable[str] = (), values: Mapping[str, str] | None = None
    ) -> None:
        restriction = ET.SubElement(parent, "xs:restriction", base=base)
        for pattern in patterns:
            ET.SubElement(restriction, "xs:pattern", value=pattern)
        for value, text in (values or {}).items():
            _document_if(ET.SubElement(restriction, "xs:enumeration", value=value), text)

    def of(self, name: str, patterns: Iterable[str] = (), values: Mapping[str, str] | None = None) -> str:
        """Return the type of texts that match one of some patterns or equal one of some values (value -> documentation)."""
        key = (tuple(patterns), tuple(values or ()))
        if key not in self._names:
            base = re.sub(r"\W+", "_", name).strip("_")
            taken = {TEXT, "placeholder", *self._names.values()}
            self._names[key] = next(
                n for i in range(len(taken) + 1) if (n := f"{base}_{i}" if i else base) not in taken
            )
            union = ET.SubElement(
                ET.SubElement(self.root, "xs:simpleType", name=self._names[key]),
                "xs:union",
                memberTypes="placeholder",
            )
            for parts in ({"values": values}, {"patterns": key[0]}):
                if any(parts.values()):
                    self._restrict(ET.SubElement(union, "xs:simpleType"), "xs:token", **parts)
        return self._names[key]

    def number(self, unit: str, is_negative: bool = True) -> str:
        """Return the type of numbers with or without a unit; a bare one is in `unit`."""
        return self.of(
            f"number {unit}{'' if is_negative else ' not negative'}", [_quantity(unit, is_negative)]
        )

    def truth(self) -> str:
        """Return the type of booleans."""
        words = ("".join(f"[{c}{c.upper()}]" if c.isalpha() else c for c in word) for word in (*TRUE, *FALSE))
        return self.of("truth", ["|".join(words)], {"true": "", "false": ""})

    def param(self, column: Param, is_negative: bool = False) -> str:
        """Return the type of a parameter.

        Args:
            column: Its declaration.
            is_negative: Negative numbers are allowed, whatever the bounds are.
        """
        if column.ragged or (column.is_text and not column.choices):
            return TEXT
        if column.fields:
            value, more = rf"[\-+]?({NUMBER})( ?{ANY_UNIT})?", len(column.fields) - 1
            return self.of(f"numbers {more + 1}", [rf"[\[ ]*{value}([\[\], ]+{value}){{{more}}}[\], ]*"])
        if column.is_text:
            return self.of("_".join(["choice", *column.choices]), values=dict.fromkeys(column.choices, ""))
        bounds = [bound for bound in (column.ge, column.gt) if bound is not None]
        return (
            self.truth()
            if column.dtype is bool
            else self.number(column.text_units[0], is_negative or max(bounds, default=-1.0) < 0.0)
        )

    def tag(self, name: str, known: tags.TagSpec) -> str:
        """Return the type of the text of a tag or attribute of the format."""
        if name in PARAMS:
            return self.param(PARAMS[name])
        if name in ENUMS:
            return self.of(name, values=dict.fromkeys(ENUMS[name], ""))
        if name == "generate_rate":
            return self.of(name, [_quantity("1/s"), rf"[\-+]?({NUMBER}) ?/ ?[\-+]?({NUMBER})"])
        if known.reads == "words":
            word = f"({'|'.join(END_CONDITIONS)})"
            return self.of(name, [rf"({word}([, ]+{word})*,?)?"], dict.fromkeys(END_CONDITIONS, ""))
        if known.reads == "truth":
            return self.truth()
        return TEXT if known.reads == "text" else self.number(known.unit, not known.bound)


def _document_if(parent: ET.Element, text: str) -> None:
    if text:
        _document(parent, text)


def _quantity(unit: str, is_negative: bool = True) -> str:
    """Return the pattern of a number with a unit of the dimension of `unit`, or without one."""
    names = "|".join(["%"] if not unit else [re.escape(name).replace(r"\/", "/") for name in spellings(unit)])
    sign = r"[\-+]?" if is_negative else r"\+?"
    zero = "" if is_negative else r"|-[0.]+"
    return rf"({sign}({NUMBER}){zero})( ?({names}|{PRODUCT}))?"


class SchemaWriter:
    """Writes tags with their content.

    Args:
        types: The simple types.
        plugins: The plugins by their names in missions.
    """

    def __init__(self, types: TypeTable, plugins: Mapping[str, type[Plugin]]) -> None:
        self.types = types
        self.plugin_types = {tag: self._plugin_type(tag, plugins) for tag in KINDS if tag != "behaviors"}

    def add_content(
        self,
        element: ET.Element,
        children: Mapping[str, tags.TagSpec],
        attributes: Mapping[str, tags.TagSpec],
    ) -> None:
        """Give an element a content of tags, in any order, and attributes."""
        content = ET.SubElement(element, "xs:complexType")
        choice = ET.SubElement(content, "xs:choice", minOccurs="0", maxOccurs="unbounded")
        for name, known in children.items():
            self._add_tag(choice, name, known)
        ET.SubElement(choice, "xs:any", namespace=XINCLUDE, processContents="skip")
        self._add_attributes(content, attributes)
        ET.SubElement(content, "xs:anyAttribute", namespace="##other", processContents="skip")  # xml:base

    def _add_attributes(self, parent: ET.Element, attributes: Mapping[str, tags.TagSpec]) -> None:
        for name, known in attributes.items():
            attribute = ET.SubElement(parent, "xs:attribute", name=name, type=self.types.tag(name, known))
            _document(attribute, _about(known))

    def _add_tag(self, choice: ET.Element, name: str, known: tags.TagSpec) -> None:
        element = ET.SubElement(choice, "xs:element", name=name)
        if name in self.plugin_types:
            element.set("type", self.plugin_types[name])
        elif name == "run":
            self._add_attributes(ET.SubElement(element, "xs:complexType"), tags.RUN)
        elif name == "entity":
            self.add_content(element, tags.ENTITY, tags.ENTITY_ATTRIBUTES)
        elif name == "entity_common":
            self.add_content(element, tags.ENTITY, {"name": tags.TagSpec("Its name.", reads="text")})
        elif name == "base":
            self.add_content(element, tags.BASE, {})
        elif name == "param_common":
            content = ET.SubElement(element, "xs:complexType")
            ET.SubElement(
                ET.SubElement(content, "xs:sequence"),
                "xs:any",
                minOccurs="0",
                maxOccurs="unbounded",
                processContents="skip",
            )
            ET.SubElement(content, "xs:attribute", name="name", type=TEXT, use="required")
        else:
            self._add_value(element, name, known)
        _document(element, _about(known))

    def _add_value(self, element: ET.Element, name: str, known: tags.TagSpec) -> None:
        """Give an element a text, and the attributes of such a tag."""
        scene = {"terrain": TERRAIN, "wall": WALL, "building": BUILDING}.get(name, {})
        extension = _extension(element, self.types.tag(name, known))
        for attribute in (*scene, *(tags.SEED_ATTRIBUTES if name == "seed" else ())):
            ET.SubElement(extension, "xs:attribute", name=attribute, type=TEXT)
        if known.kept_for:
            ET.SubElement(extension, "xs:anyAttribute", processContents="skip")

    def _plugin_type(self, tag: str, plugins: Mapping[str, type[Plugin]]) -> str:
        """Add the type of the tag of a kind of plugin, and return its name."""
        mine = {name: cls for name, cls in plugins.items() if issubclass(cls, KINDS[tag])}
        names = self.types.of(
            f"name_of_{tag}", values={name: first_sentence(cls) for name, cls in mine.items()}
        )
        found: dict[str, dict[str, str]] = {}
        texts: dict[str, list[str]] = {}
        for name, cls in mine.items():
            for attribute, kind, text in self._attributes_of(cls):
                found.setdefault(attribute, {})[kind] = ""
                texts.setdefault(attribute, []).append(f"{name}: {text}")
        drawn, unread = historic()["viewer"], historic()["unread"]["names"]
        others = [*drawn["names"], *drawn["shown"], *unread]
        of_format = {
            **dict.fromkeys(others, tags.TagSpec("Does not change the game.", reads="text")),
            **tags.PLUGIN,
        }
        content = ET.SubElement(self.types.root, "xs:complexType", name=tag)
        extension = _extension(content, names, is_named=True)
        self._add_attributes(
            extension,
            {name: known for name, known in of_format.items() if name in tags.PLUGIN or name not in found},
        )
        for name in sorted(set(found) - set(tags.PLUGIN)):
            element = ET.SubElement(extension, "xs:attribute", name=name)
            _document(element, "\n".join(texts[name]))
            if TEXT in found[name] or len(found[name]) == 1:
                element.set("type", TEXT if TEXT in found[name] else next(iter(found[name])))
            else:
                ET.SubElement(
                    ET.SubElement(element, "xs:simpleType"), "xs:union", memberTypes=" ".join(found[name])
                )
        return tag

    def _attributes_of(self, cls: type[Plugin]) -> Iterable[tuple[str, str, str]]:
        """Name, type and documentation of each attribute of a plugin."""
        known, params = cls.historic_attributes, cls.params()
        names = {name: name for name in params} | dict(known.renamed)
        for attribute, parameter in names.items():
            if parameter in params:
                column = params[parameter]
                yield attribute, self.types.param(column, parameter in known.least_zero), _about_param(column)
        for parameter, parts in known.joined.items():
            column = params[parameter]
            for part, unit, default in zip(parts, column.text_units, column.default, strict=True):
                yield part, self.types.number(unit), f"{column.doc} Default {default:g}."
        for name, children in cls.children().items():
            yield name, TEXT, children.doc
        for name in (*known.unread, *filter(None, [known.chosen_by])):
            yield (
                name,
                TEXT,
                "Has no effect here." if name in known.unread else "What it runs, of a plugin file.",
            )


def _extension(element: ET.Element, base: str, *, is_named: bool = False) -> ET.Element:
    content = element if is_named else ET.SubElement(element, "xs:complexType")
    return ET.SubElement(ET.SubElement(content, "xs:simpleContent"), "xs:extension", base=base)


def _about(known: tags.TagSpec) -> str:
    parts = [
        f"[{known.unit}]" if known.unit else "",
        known.bound,
        f"default {known.default}" if known.default else "",
    ]
    facts = ", ".join(part for part in parts if part)
    return f"{known.doc} {facts[:1].upper()}{facts[1:]}{'.' if facts else ''}".strip()


def _about_param(column: Param) -> str:
    default = f"Default {default_text(column)}".replace("\n", ", ")
    takes = allowed_text(column)
    return f"{column.doc} {default}{f' ({takes})' if takes else ''}.".strip()
