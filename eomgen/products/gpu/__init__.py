"""Models on a GPU: the target ``cuda``, and compiled models for arrays of a device."""

from eomgen.base.products import Product

__all__ = []

PRODUCT = Product()
