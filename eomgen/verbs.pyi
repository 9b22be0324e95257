"""eomgen.base.verbs, for type checkers and editors: by ``python -m tests.model_stub``."""

from eomgen.base.verbs import *
