"""XML into plain elements that know their line, without document types, entities or unbounded nesting."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from eomgen.errors import DescriptionError, Problem

DEPTH = 100


@dataclass
class Element:
    """An XML element: tag, attributes, line (from 1) and children; its text is not kept."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)

    def named(self, tag: str) -> Iterator[Element]:
        """Yield the children with a tag."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        """Return the first child with a tag, or None."""
        return next(self.named(tag), None)


def read_xml(text: str, file: str) -> Element:
    """Return the root element of an XML text; ``file`` is the name for messages.

    Raises
    ------
    DescriptionError
        If it is not well formed, nested more than 100 deep, or has a document type (which could define entities).
    """
    parser = expat.ParserCreate()
    top = Element("", {}, 0)
    stack = [top]

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(stack) > DEPTH:
            raise DescriptionError(
                Problem(f"{file}:{parser.CurrentLineNumber}", f"elements are nested more than {DEPTH} deep", "")
            )
        element = Element(tag, attributes, parser.CurrentLineNumber)
        stack[-1].children.append(element)
        stack.append(element)

    def end(_tag: str) -> None:
        stack.pop()

    def document_type(*_details: object) -> None:
        raise DescriptionError(
            Problem(
                f"{file}:{parser.CurrentLineNumber}", "document types and entities are refused", "the file without <!DOCTYPE>"
            )
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.StartDoctypeDeclHandler = document_type
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        problem = Problem(
            f"{file}:{error.lineno}", f"this is not XML: {expat.ErrorString(error.code)} (column {error.offset + 1})", ""
        )
        raise DescriptionError(problem) from None
    return top.children[0]
