"""Modules within a public module of the product."""

from __future__ import annotations

import pytest

from tests.test_public_modules import _run

SAME = "sys.modules['eomgen.products.waves.second_order.sea']"


@pytest.mark.slow_except("form1")
@pytest.mark.parametrize(
    ("form", "check"),
    [
        ("import eomgen.waves.sea as it", f"sys.modules['eomgen.waves.sea'] is {SAME}"),
        ("from eomgen.waves import sea as it", f"it is {SAME}"),
        ("from eomgen.waves.sea import Sea", f"sys.modules['eomgen.waves.sea'] is {SAME} and Sea is eomgen.waves.Sea"),
    ],
    ids=["form0", "form1", "form2"],
)
def test_public_modules_are_imported_by_each_form_of_an_import_first(form: str, check: str) -> None:
    assert _run(f"import sys, eomgen\n{form}\nprint({check})") == "True"
