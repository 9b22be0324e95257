"""eomgen.products.testing.contracts, for type checkers and editors: by ``python -m tests.model_stub``."""

from eomgen.products.testing.contracts import *
