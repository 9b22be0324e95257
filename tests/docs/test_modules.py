"""The page of modules is current, and tells one module from another."""

from __future__ import annotations

from collections import Counter

from tests.modules import PACKAGE, ROOT, first_sentence, folders, page


def test_the_page_of_modules_is_current() -> None:
    written = (ROOT / "docs" / "modules.md").read_text(encoding="utf-8")
    assert written == page(), "`python -m tests.modules docs/modules.md` renews it"


def test_every_module_has_a_sentence_of_its_own() -> None:
    sentences = {file: first_sentence(file) for _, files in folders() for file in files}
    assert [file.relative_to(PACKAGE) for file, sentence in sentences.items() if not sentence] == []
    assert [sentence for sentence, count in Counter(sentences.values()).items() if count > 1] == []
