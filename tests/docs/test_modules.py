"""The page of modules tells one module from another."""

from __future__ import annotations

from collections import Counter

from docs.site.modules import PACKAGE, first_sentence, folders, page


def test_every_module_has_a_sentence_of_its_own() -> None:
    sentences = {file: first_sentence(file) for _, files in folders() for file in files}
    assert [file.relative_to(PACKAGE) for file, sentence in sentences.items() if not sentence] == []
    assert [sentence for sentence, count in Counter(sentences.values()).items() if count > 1] == []
    listed = page()
    assert all(f"- `{file.name}`: {sentence}\n" in listed for file, sentence in sentences.items())
