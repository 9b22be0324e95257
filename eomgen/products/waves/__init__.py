"""Ocean waves: spectra of seas, waves in scenes, and second-order motion of particles and surface."""

from eomgen.base.products import Product

__all__ = []

PRODUCT = Product(
    modules={"waves": "eomgen.products.waves.second_order"},
    rows={
        "eomgen.sections": ("eomgen.products.waves.section.sections:WAVES",),
        "eomgen.info": ("eomgen.products.waves.info:SEAS",),
    },
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["second_order"]
