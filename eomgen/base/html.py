"""Small pieces of HTML with which objects show themselves in notebooks: headings, paragraphs, formulas, tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import islice

_CELL = "text-align:left;vertical-align:top;padding:0.15em 0.8em 0.15em 0"


def escape_html(text: str, *, quote: bool = True) -> str:
    """Return plain text as HTML."""
    from html import escape  # noqa: PLC0415  # brings a table of all characters; most processes show none

    return escape(text, quote)


def page(heading: str, *parts: str) -> str:
    """Return parts of HTML under a heading in plain text; empty parts are left out."""
    return f"<div><strong>{escape_html(heading)}</strong>{''.join(parts)}</div>"


def paragraph(text: str) -> str:
    """Return plain text as a paragraph; an empty text for an empty one."""
    return f'<p style="margin:0.3em 0">{escape_html(text)}</p>' if text else ""


def formula(latex: str) -> str:
    """Return a formula on a separate line, which notebooks set by MathJax."""
    return f"<div>$$\\displaystyle {escape_html(latex, quote=False)}$$</div>"


def table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return an HTML table of text, of at most 40 rows and the number of further rows; an empty text if there is no
    row. Columns that are empty in all rows are left out."""
    waiting = iter(rows)
    shown = [[str(cell) for cell in row] for row in islice(waiting, 40)]
    if not shown:
        return ""
    left = sum(1 for _ in waiting)
    kept = [k for k in range(len(headings)) if any(row[k] for row in shown)]
    head = "".join(f'<th style="{_CELL}">{escape_html(headings[k])}</th>' for k in kept)
    body = "".join(
        f"<tr>{''.join(f'<td style={chr(34)}{_CELL}{chr(34)}>{escape_html(row[k])}</td>' for k in kept)}</tr>"
        for row in shown
    )
    more = paragraph(f"and {left} more") if left else ""
    parts = f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody>"
    return f'<table style="margin:0.4em 0;border-collapse:collapse">{parts}</table>{more}'
