"""Counts of phrases that replace a noun."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.language import (
    ALLOWED,
    ANCHORS,
    comments,
    counts_of,
    has_chain,
    of_python,
    per_thousand,
    public_texts,
)


def test_public_docstrings_and_pages_have_few_phrases_that_other_packages_avoid() -> None:
    for label, texts in public_texts().items():
        for name, number in per_thousand(texts).items():
            assert number <= ALLOWED * ANCHORS[name][1], f"{label}: {number:.2f} of {name} per 1000 words"


def test_phrases_are_counted_in_docstrings_comments_and_messages(tmp_path: Path) -> None:
    file = tmp_path / "sample.py"
    docstring = '"""Return what is led.\n\nwhere : str\n    The place, not counted as a name.\n"""\n'
    file.write_text(docstring + '# those of the joint\nwhat = f"the joint, where {1} moves"\n# what?\n')
    counted = counts_of([file])
    expected = {"what": 1, "those of": 1, "where": 1, "Return what": 1, "name what": 1}
    assert {key: value for key, value in counted.items() if key != "words" and value} == expected
    assert of_python("def f(what): return what.found")[1] == ["f", "what", "found", "what"]
    assert of_python("x = 'one two three'")[0] == ["one two three"]


def test_comments_are_not_in_strings() -> None:
    source = (
        'a = "# no"  # first, "quoted"\nb = """\n# no\n"""\nc = \'"# no\' + r"\\"  # second\n# it\'s\nd = "no" # third'
    )
    assert list(comments(source)) == ['# first, "quoted"', "# second", "# it's", "# third"]


def test_pronouns_are_counted(tmp_path: Path) -> None:
    file = tmp_path / "sample.py"
    file.write_text('"""Return its rows: the last ones, with their names, before the other is itself."""\n')
    counted = counts_of([file])
    assert {key: counted[key] for key in ("it", "they", "one", "others", "Return it")} == {
        "it": 2, "they": 1, "one": 1, "others": 1, "Return it": 1,
    }  # fmt: skip  # one line for the parts


@pytest.mark.parametrize(
    ("text", "chained"),
    [
        ("Return the rows of parts of runs of a model of a scene.", True),
        ("Return the rows of parts of runs of a model.", False),
        ("Return rows. The rows of parts of runs of a model of a scene.", False),
        ("Return rows of parts of\n    runs of models of ``scene.toml``", True),
        ("Return rows of parts of runs\n\nof a model of a scene", False),
        ("# the rows of parts of runs of a model of a scene", False),
    ],
)
def test_first_sentences_with_four_words_of_are_counted(text: str, chained: bool, tmp_path: Path) -> None:
    assert has_chain(text) == chained
    file, page = tmp_path / "sample.py", tmp_path / "sample.md"
    file.write_text(f'"""{text}"""\n')
    page.write_text(text)
    assert counts_of([file])["four of"] == chained and counts_of([page])["four of"] == 0
