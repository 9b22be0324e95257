"""XML documents as elements with the lines of the text, and findings with places.

Document type definitions are refused: a model description has none, and entities could name other files.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from xml.parsers import expat

from eomgen.base.data import dataclass, field


@dataclass
class Element:
    """One element of a document.

    Attributes
    ----------
    tag : name, without a namespace's prefix as in the text
    attributes : values by name
    line : of the start of the element, from 1
    children : elements in order
    """

    tag: str
    attributes: Mapping[str, str]
    line: int
    children: list[Element] = field(default_factory=list)

    def all(self, tag: str) -> list[Element]:
        """Return the children with this name."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Element | None:
        """Return the first child with this name, None without any."""
        return next((child for child in self.children if child.tag == tag), None)

    def walk(self) -> Iterator[tuple[Element, Element | None]]:
        """Yield this element and all within, each with the parent, in the order of the text."""
        waiting: list[tuple[Element, Element | None]] = [(self, None)]
        while waiting:
            element, parent = waiting.pop()
            yield element, parent
            waiting.extend((child, element) for child in reversed(element.children))


class Malformed(ValueError):
    """A text that is not an XML document as the standards ask for.

    Attributes
    ----------
    line : of the fault, from 1
    cause : the fault
    """

    def __init__(self, line: int, cause: str) -> None:
        super().__init__(f"line {line}: {cause}")
        self.line, self.cause = line, cause


def parsed(text: str) -> Element:
    """Return the root of a document.

    Raises
    ------
    Malformed
        A text that is not well-formed, or has a document type definition.
    """
    parser, open_elements, roots = expat.ParserCreate(), list[Element](), list[Element]()

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, parser.CurrentLineNumber)
        (open_elements[-1].children if open_elements else roots).append(element)
        open_elements.append(element)

    def end(_tag: str) -> None:
        open_elements.pop()

    def document_type(*_: object) -> None:
        raise Malformed(parser.CurrentLineNumber, "a document type definition is not allowed")

    def declaration(_version: str, encoding: str | None, _standalone: int) -> None:
        if encoding is not None and encoding.upper() != "UTF-8":
            raise Malformed(parser.CurrentLineNumber, f'encoding="{encoding}", and the standards ask for UTF-8')

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler, parser.XmlDeclHandler = document_type, declaration
    try:
        parser.Parse(text.encode(), True)
    except expat.ExpatError as error:
        raise Malformed(error.lineno, expat.ErrorString(error.code)) from None
    except LookupError as error:  # of encodings that Python has not
        raise Malformed(parser.CurrentLineNumber, f"{error}, and the standards ask for UTF-8") from None
    return roots[0]


class Report:
    """Findings in one file.

    Parameters
    ----------
    file : path inside the archive
    standard : with the version, as ``FMI 3.0``
    """

    def __init__(self, file: str, standard: str) -> None:
        self.file, self.standard = file, standard
        self.findings: list[str] = []

    def add(self, element: Element | None, cause: str, rule: str) -> None:
        """Add a finding: place, cause and the rule that is broken."""
        where = self.file if element is None else f"{self.file}, line {element.line}, {place_of(element)}"
        self.findings.append(f"{where}: {cause} ({self.standard}: {rule})")


def place_of(element: Element) -> str:
    """Return the name of an element in messages."""
    own = element.attributes
    if "name" in own and "valueReference" in own:
        return f'variable "{own["name"]}"'
    for key in ("name", "valueReference", "index", "modelIdentifier"):
        if key in own:
            return f'{element.tag} {key}="{own[key]}"'
    return element.tag
