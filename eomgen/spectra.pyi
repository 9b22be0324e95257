"""eomgen.products.linear.spectra, for type checkers and editors: by ``python -m tests.model_stub``."""

from eomgen.products.linear.spectra import *
