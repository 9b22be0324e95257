"""Optimisers: the functions of a model with the interfaces of optimal control, with exact sparse second derivatives."""

from eomgen.base.products import Product

__all__ = []

PRODUCT = Product(
    names={
        "casadi": "eomgen.products.optimisers.casadi_functions:casadi",
        "jax": "eomgen.products.optimisers.jax_functions:jax",
        "torch": "eomgen.products.optimisers.torch_functions:torch",
    },
    rows={
        "eomgen.targets": (
            "eomgen.products.optimisers.casadi_code:CASADI",
            "eomgen.products.optimisers.acados_code:ACADOS",
        )
    },
    needs=("derivatives",),
)
#: Open to all parts of ``products``.
WITHIN = ["casadi_functions", "jax_functions", "torch_functions"]
