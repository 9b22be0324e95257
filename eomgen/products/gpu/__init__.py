"""Models on a GPU: the target ``cuda``, and the functions of a model for arrays on a card."""

from eomgen.base.products import LateRow, Product

__all__ = []

PRODUCT = Product(
    needs=("ensembles",),
    names={"gpu": "eomgen.products.gpu.functions:gpu"},
    rows={
        "eomgen.doctor": (LateRow("gpu", "eomgen.products.gpu.requirements:card"),),
        "eomgen.ensemble_devices": (LateRow("gpu", "eomgen.products.gpu.ensembles:DeviceSamples"),),
        "eomgen.jax_cards": (LateRow("gpu", "eomgen.products.gpu.jax_kernels:CARDS"),),
        "eomgen.targets": ("eomgen.products.gpu.target:CUDA",),
    },
)
#: Open to all parts of ``products``.
WITHIN = ["functions"]
