"""Modules within a public module of the product."""

from __future__ import annotations

from tests.test_public_modules import _run


def test_public_modules_are_imported_by_each_form_of_an_import_first() -> None:
    forms = ("import eomgen.waves.sea as it", "from eomgen.waves import sea as it", "from eomgen.waves.sea import Sea")
    for form in forms:
        check = "sys.modules['eomgen.waves.sea'] is sys.modules['eomgen.products.waves.second_order.sea']"
        if "Sea" in form:
            check = f"{check} and Sea is eomgen.waves.Sea"
        elif form.startswith("from"):
            check = "it is sys.modules['eomgen.products.waves.second_order.sea']"
        assert _run(f"import sys, eomgen\n{form}\nprint({check})") == "True", form
