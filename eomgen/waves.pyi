"""eomgen.products.waves.second_order, for type checkers and editors: by ``python -m tests.model_stub``."""

from eomgen.products.waves.second_order import *
