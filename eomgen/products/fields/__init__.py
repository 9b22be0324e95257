"""Hamiltonian systems: their files, models and motions; fields on meshes, and samples of their posteriors."""

from eomgen.base.products import Product
from eomgen.base.verbs import Verb

__all__ = []

PRODUCT = Product(
    modules={"fields": "eomgen.products.fields.posteriors", "sampling": "eomgen.products.fields.sampling"},
    rows={
        "eomgen.attributes": ("eomgen.products.fields.other_words:ATTRIBUTES",),
        "eomgen.file_kinds": ("eomgen.products.fields.file_kind:HAMILTONIAN_FILES",),
        "eomgen.verbs": (
            Verb(
                "sample",
                "Sample fields on a mesh from their posterior, by Hamiltonian Monte Carlo.",
                "eomgen.products.fields.commands:sample",
                behind="identify",
                heading="Studies",
            ),
        ),
    },
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["posteriors", "sampling"]
