"""Contacts: bodies of simple shapes on planes and surfaces, with laws of normal and tangential forces."""

from eomgen.base.products import LateRow, Product

__all__ = []

PRODUCT = Product(
    rows={
        "eomgen.sections": (
            LateRow("tyres", "eomgen.products.contacts.tyres:SECTION", behind="bushings"),
            LateRow("contacts", "eomgen.products.contacts.section:SECTION", behind="tyres"),
        ),
        "eomgen.info": ("eomgen.products.contacts.info:INFO",),
        "eomgen.checks": ("eomgen.products.contacts.step_check:ROWS",),
        "eomgen.starts": (LateRow("contacts", "eomgen.products.contacts.step_check:sentences"),),
    },
)
