"""eomgen.products.studies, for type checkers and editors: by ``python -m tests.model_stub``."""

from eomgen.products.studies import *
