"""eomgen.products.linear.control, for type checkers and editors: by ``python -m tests.model_stub``."""

from eomgen.products.linear.control import *
