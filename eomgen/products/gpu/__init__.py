"""Models on a GPU: the target ``cuda``, and the functions of a model for arrays on a card."""

from eomgen.base.products import Product

__all__ = []

PRODUCT = Product(
    names={"gpu": "eomgen.products.gpu.functions:gpu"}, rows={"eomgen.targets": ("eomgen.products.gpu.target:CUDA",)}
)
