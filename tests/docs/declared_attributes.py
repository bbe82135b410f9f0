"""Extension of Griffe, which reads the code for mkdocstrings: what classes declare, and attributes that code adds to them."""

from __future__ import annotations

from typing import Any

import griffe
from reference import documented_classes, members_with_docs, own_bases


class DeclaredAttributes(griffe.Extension):
    """Gives attributes of public classes the description that they have on the pages in docs/: kind, unit, default, doc."""

    def __init__(self) -> None:
        classes = {base for cls in documented_classes() for base in own_bases(cls)}
        self._docs = {f"{cls.__module__}.{cls.__qualname__}": dict(members_with_docs(cls)) for cls in classes}

    def on_class(self, *, cls: griffe.Class, **kwargs: Any) -> None:
        """Describe the attributes of a class that have no docstring in its source."""
        for name, doc in self._docs.get(cls.path, {}).items():
            if name not in cls.members:
                cls.set_member(name, griffe.Attribute(name))
            member = cls.members[name]
            if not member.is_alias and not member.docstring:
                member.docstring = griffe.Docstring(doc, parent=member)
