"""eomgen.products.fields.posteriors, for type checkers and editors: by ``python -m tests.model_stub``."""

from eomgen.products.fields.posteriors import *
