"""Ocean waves: spectra of seas, waves in scenes, and second-order motion of particles and surface."""

from eomgen.base.products import LateRow, Product

__all__ = []

PRODUCT = Product(
    modules={"waves": "eomgen.products.waves.second_order"},
    rows={
        "eomgen.sections": (
            LateRow("waves", "eomgen.products.waves.section.sections:WAVES", behind="random"),
            LateRow("hulls", "eomgen.products.waves.hulls.section:SECTION", behind="efforts"),
        ),
        "eomgen.formula_words": tuple(
            f"eomgen.products.waves.formula.fields:{word}"
            for word in ("ELEVATION", "SLOPE", "WATER_VELOCITY", "WATER_ACCELERATION")
        ),
        "eomgen.keys": ("eomgen.products.waves.section.following:FOLLOW",),
        "eomgen.keys_elsewhere": ("eomgen.products.waves.section.schema:ELSEWHERE",),
        "eomgen.notes": ("eomgen.products.waves.hulls.doubts:NOTE",),
        "eomgen.info": ("eomgen.products.waves.info:SEAS",),
    },
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["second_order"]
