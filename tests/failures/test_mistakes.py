"""What users tried by mistake is answered, and every answer says where, what, and what to try."""

from __future__ import annotations

import pytest

from tests.failures.mistakes import MISTAKES, Mistake


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.what)
def test_answers(mistake: Mistake) -> None:
    answer = mistake.answer()
    missing = [piece for piece in mistake.pieces if piece not in answer]
    assert not missing, f"{missing} in: {answer}"


def test_there_are_as_many_as_were_tried() -> None:
    counts = [sum(mistake.group == group for mistake in MISTAKES) for group in ("files", "calls", "motions")]
    assert counts == [27, 32, 20]
