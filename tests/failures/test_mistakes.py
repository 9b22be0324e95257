"""What users tried by mistake is answered, and every answer says where, what, and what to try."""

from __future__ import annotations

import pytest

from tests.failures.mistakes import MISTAKES, Mistake

MOTIONS = [mistake for mistake in MISTAKES if mistake.group == "motions"]


def answered(mistake: Mistake) -> None:
    answer = mistake.answer()
    missing = [piece for piece in mistake.pieces if piece not in answer]
    assert not missing, f"{missing} in: {answer}"


@pytest.mark.slow_cases("simulate(u=)")
@pytest.mark.parametrize("mistake", [each for each in MISTAKES if each not in MOTIONS], ids=lambda each: each.what)
def test_answers(mistake: Mistake) -> None:
    answered(mistake)


@pytest.mark.long_except_every(2)
@pytest.mark.slow_except("a spring through zero length")
@pytest.mark.parametrize("mistake", MOTIONS, ids=lambda each: each.what)
def test_answers_of_runs(mistake: Mistake) -> None:
    answered(mistake)


def test_there_are_as_many_as_were_tried() -> None:
    counts = [sum(mistake.group == group for mistake in MISTAKES) for group in ("files", "calls", "motions")]
    assert counts == [27, 32, 20]
