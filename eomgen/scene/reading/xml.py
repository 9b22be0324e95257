"""XML parser: plain elements that record line numbers and reads, without document types or unbounded nesting."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from xml.parsers import expat

from eomgen.errors import DescriptionError, Problem

DEPTH = 100
#: Declarations and comments before the outermost element, by beginning and end.
_ASIDE = (("<?", "?>"), ("<!--", "-->"), ("<!", ">"))
_CHARACTERS = ("<![CDATA[", "]]>")
_TAG = re.compile(r"<([A-Za-z_][\w.:-]*)")
#: A tag of any kind: of an end, or with attributes, and perhaps empty.
_ANY_TAG = re.compile(r"""<(/?)([A-Za-z_][\w.:-]*)(?:[^<>"'/]|/(?!>)|"[^"<]*"|'[^'<]*')*(/?)>""")
#: An attribute without a blank before the next attribute.
_TIGHT = re.compile(r"""(=\s*(?:"[^"<>]*"|'[^'<>]*'))(?=[A-Za-z_])""")
_BLANK = re.compile(r"\s+")
#: Blanks and comments, and an XML declaration after these, which should be the first.
_LATE_DECLARATION = re.compile(r"(\ufeff?(?>\s|<!--.*?-->)++)(<\?xml\s.*?\?>)", re.DOTALL)


class _NotXmlError(DescriptionError):
    """A text that is not well formed."""


class Element:
    """An XML element: tag, line (from 1), attributes and children, with a record of the parts that were read; of a root
    ``liberties`` are notes on faults of the file's XML.

    ``unread_attributes``, ``unread_children`` and ``has_text`` give the parts that were not read, so that a reader of a
    format can report such parts without a list of known parts.
    """

    def __init__(self, tag: str, attributes: dict[str, str], line: int) -> None:
        self.tag = tag
        self.line = line
        self._text: list[str] = []
        self._text_read = False
        self._attributes = attributes
        self._children: list[Element] = []
        self._asked: dict[str, None] = {}
        self._handed_out: set[int] = set()
        self.liberties: Sequence[str] = ()

    def add(self, child: Element) -> None:
        """Append a child."""
        self._children.append(child)

    def add_text(self, piece: str) -> None:
        """Append a piece of text."""
        self._text.append(piece)

    def text(self) -> str:
        """Return the text without white space around it, and count the text as read."""
        self._text_read = True
        return "".join(self._text).strip()

    @property
    def has_text(self) -> bool:
        """Return whether there is text that was not read."""
        return not self._text_read and any(not piece.isspace() for piece in self._text)

    def has(self, attribute: str) -> bool:
        """Return whether there is an attribute, and count the attribute as read."""
        self._asked[attribute] = None
        return attribute in self._attributes

    def get(self, attribute: str, default: str = "") -> str:
        """Return an attribute, or the default if missing, and count the attribute as read."""
        self._asked[attribute] = None
        return self._attributes.get(attribute, default)

    def children_with_tag(self, tag: str) -> Iterator[Element]:
        """Yield the children with a tag, and count each as read."""
        for child in self._children:
            if child.tag == tag:
                self._handed_out.add(id(child))
                yield child

    def children(self) -> Iterator[Element]:
        """Yield all children, and count each as read."""
        self._handed_out |= {id(child) for child in self._children}
        yield from self._children

    def first(self, tag: str) -> Element | None:
        """Return the first child with a tag, or None; of several only the first counts as read."""
        return next(self.children_with_tag(tag), None)

    def everything(self) -> Iterator[Element]:
        """Yield the element and all descendants, read or not."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting += element._children

    def read_whole(self) -> None:
        """Count the element and all descendants as read."""
        for element in self.everything():
            element._asked |= dict.fromkeys(element._attributes)
            element._handed_out |= {id(child) for child in element._children}
            element._text_read = True

    @property
    def attributes(self) -> Sequence[tuple[str, str]]:
        """Names and values of all attributes, which count as read or not as before."""
        return tuple(self._attributes.items())

    @property
    def read_children(self) -> Sequence[Element]:
        return tuple(child for child in self._children if id(child) in self._handed_out)

    @property
    def unread_children(self) -> Sequence[Element]:
        return tuple(child for child in self._children if id(child) not in self._handed_out)

    @property
    def unread_attributes(self) -> Sequence[str]:
        """Unread attributes, without namespace declarations, which belong to XML and not to the format."""
        names = (name for name in self._attributes if name not in self._asked)
        return tuple(name for name in names if name != "xmlns" and not name.startswith("xmlns:"))


def read_xml(text: str, file: str, deepest: int = DEPTH) -> Element:
    """Return the root element of an XML text; ``file`` is the name for messages.

    An XML declaration may follow a byte order mark, white space and comments, although XML requires the declaration at
    the start: many generators of robot descriptions write an empty line first. Three faults that the readers of
    simulators pass over are passed over with a note: hyphens within comments, attributes without a blank between them,
    and ends of elements that are not open.

    Raises
    ------
    DescriptionError
        If the text is not well formed, nested deeper than ``deepest``, or has a document type (which could define
        entities).
    """
    # the declaration is parsed separately and replaced by blanks, so that lines and columns stay the same
    if late := _LATE_DECLARATION.match(text):
        before, declaration = late.groups()
        _parse(f"{declaration}<a/>", file, deepest, lines_before=before.count("\n"))
        text = before + re.sub(r"[^\n]", " ", declaration) + text[late.end() :]
    try:
        return _parse(text, file, deepest)
    except _NotXmlError:
        mended, faults = _mend(text)
        if not faults:
            raise
        root = _parse(mended, file, deepest)
        root.liberties = [f"{file}:{line}: not XML, but read: {fault} [W0285]" for fault, line in faults.items()]
        return root


def _mend(text: str) -> tuple[str, dict[str, int]]:
    """Return an XML text without three faults that other readers pass over, with lines of equal numbers, and the first
    line of each fault by description."""
    pieces: list[str] = []
    faults: dict[str, int] = {}
    waiting: list[str] = []  # tags of open elements
    counts: dict[str, int] = {}  # of open elements by tag
    position, line = 0, 1
    while (start := text.find("<", position)) >= 0:
        line += text.count("\n", position, start)
        pieces.append(text[position:start])
        aside = next((pair for pair in (_CHARACTERS, *_ASIDE) if text.startswith(pair[0], start)), None)
        tag = None if aside else _ANY_TAG.match(text, start)
        position = tag.end() if tag else start + 1
        if aside:
            end = text.find(aside[1], start + len(aside[0]))
            position = len(text) if end < 0 else end + len(aside[1])
        piece, fault = text[start:position], ""
        if aside and aside[0] == "<!--" and ("--" in piece[4:-3] or piece.endswith("--->")):
            piece, fault = f"<!--{piece[4:-3].replace('-', '=')}-->", "a comment with two hyphens"
        elif tag and tag[1] and not counts.get(tag[2]):
            piece, fault = re.sub(r"[^\n]", " ", piece), f"an end </{tag[2][:64]}> of an element that is not open"
        elif tag and tag[1]:
            _close(tag[2], waiting, counts)
        elif tag:
            piece = _TIGHT.sub(r"\1 ", piece)
            fault = "attributes without a blank between them" if piece != tag[0] else ""
            waiting += [tag[2]] * (not tag[3])
            counts[tag[2]] = counts.get(tag[2], 0) + (not tag[3])
        if fault:
            faults.setdefault(fault, line)
        line += text.count("\n", start, position)
        pieces.append(piece)
    return "".join([*pieces, text[position:]]), faults


def _close(tag: str, waiting: list[str], counts: dict[str, int]) -> None:
    """Remove an open element and the elements open within; an element without an end stays a fault."""
    closed = ""
    while closed != tag:
        closed = waiting.pop()
        counts[closed] -= 1


def root_tag(text: str) -> str:
    """Return the tag of the outermost element of an XML text, also if the text is broken further on; empty without an
    element."""
    position = 1 if text.startswith("\ufeff") else 0
    while True:
        blank = _BLANK.match(text, position)
        if blank:
            position = blank.end()
        ending = next((end for start, end in _ASIDE if text.startswith(start, position)), "")
        if not ending:
            tag = _TAG.match(text, position)
            return tag[1] if tag else ""
        position = text.find(ending, position) + len(ending)
        if position < len(ending):
            return ""


def _parse(text: str, file: str, deepest: int, *, lines_before: int = 0) -> Element:
    """Return the root element of an XML text, with the lines of all elements, counted after ``lines_before``. Raises
    DescriptionError for a text that is not well formed or deeper than ``deepest`` elements, and for a document type;
    ``file`` is the name for messages."""
    parser = expat.ParserCreate()
    roots: list[Element] = []
    stack: list[Element] = []

    def problem_at(line: int, fault: str, hint: str) -> Problem:
        return Problem(f"{file}:{lines_before + line}", fault, hint)

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(stack) >= deepest:
            fault = f"elements are nested more than {deepest} deep [E1844]"
            raise DescriptionError(problem_at(parser.CurrentLineNumber, fault, ""))
        element = Element(tag, attributes, parser.CurrentLineNumber)
        if stack:
            stack[-1].add(element)
        else:
            roots.append(element)
        stack.append(element)

    def end(_tag: str) -> None:
        stack.pop()

    def characters(text: str) -> None:
        stack[-1].add_text(text)

    def document_type(*_details: object) -> None:
        fault = "document types and entities are refused [E1845]"
        raise DescriptionError(problem_at(parser.CurrentLineNumber, fault, "the file without <!DOCTYPE>"))

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = characters
    parser.StartDoctypeDeclHandler = document_type
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        fault = f"this is not XML: {expat.ErrorString(error.code)} (column {error.offset + 1}) [E1846]"
        unclosed = error.code == expat.errors.codes[expat.errors.XML_ERROR_TAG_MISMATCH]
        hint = "an end for each element: <link .../>, or <link ...> and </link>" if unclosed else ""
        raise _NotXmlError(problem_at(error.lineno, fault, hint)) from None
    return roots[0]
