"""Contacts: tangential laws of pairs as formulas, and tyres from files."""

from eomgen.base.products import Product

__all__ = []

PRODUCT = Product()
