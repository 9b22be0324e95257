"""Each key of a field file is described by a noun phrase."""

from __future__ import annotations

import pytest

from eomgen.products.fields.documents.entries import json_schema
from tests.scene.descriptions import headless_descriptions


@pytest.mark.parametrize("mesh", [False, True])
def test_the_description_of_each_key_has_a_head_noun(mesh: bool) -> None:
    assert headless_descriptions(json_schema(mesh=mesh)) == []
