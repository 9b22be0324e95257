"""Models on a GPU: the target ``cuda``, and compiled models for arrays of a device."""

from eomgen.base.products import LateRow, Product

__all__ = []

PRODUCT = Product(
    rows={
        "eomgen.targets": ("eomgen.products.gpu.target:CUDA",),
        "eomgen.ensemble_devices": (LateRow("gpu", "eomgen.products.gpu.ensembles:DeviceSamples"),),
    }
)
