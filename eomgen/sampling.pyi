"""eomgen.products.fields.sampling, for type checkers and editors: by ``python -m tests.model_stub``."""

from eomgen.products.fields.sampling import *
