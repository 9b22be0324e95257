"""Pages write terms as the glossary does."""

from __future__ import annotations

from tests.prose import GLOSSARY, findings, pages, prose, separations, spellings, terms


def test_pages_write_terms_as_the_glossary_does() -> None:
    wrong = {
        str(page): found
        for page in pages()
        if page not in GLOSSARY and (found := list(findings(page.read_text(encoding="utf-8"))))
    }
    assert wrong == {}
    assert len(pages()) > 200 and len(terms()) > 150


def test_other_spellings_and_separations_are_found() -> None:
    text = "A discretized\nCenter, `center`, [it](center.md) and generalized alpha.\n"
    assert list(findings(text)) == [
        (1, "discretized", "discretised"),
        (2, "Center", "centre"),
        (2, "generalized alpha", "generalized-alpha"),
    ]
    assert separations()["generalized alpha"] == "generalized-alpha"
    assert spellings()["factorisation"] == "factorization"
    assert prose("one\n```toml\ntwo\n```\n").split() == ["one"]
