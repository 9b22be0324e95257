"""JSON as text has the characters of the standard library's encoder, with null for numbers that JSON does not have."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from eomgen.base.json_text import finite, json_text

DATA = {
    "empty": [{}, [], "", ()],
    "numbers": [1, -2.5e-300, True, None, 'a "quoted" text\nof two lines, Ångström'],
    "nested": {"rows": [[1.0, 2.0], [3.0, math.nan]], "of": ("a", {"b": -math.inf, 3: np.float64(0.1)})},
    "plain": {"1": 1.0, "x": math.inf},
}


@pytest.mark.parametrize("data", [DATA, [], {}, "text", 0.1, math.nan, [DATA, [DATA]], (1, "2")])
def test_text_is_that_of_the_encoder(data: object) -> None:
    assert json_text(data) == json.dumps(finite(data), indent=2)


def test_other_types_are_refused() -> None:
    with pytest.raises(TypeError, match="ndarray is not JSON serializable"):
        json_text({"a": [1.0, np.zeros(2)]})
