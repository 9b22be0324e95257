"""Derivation without Python's search for circles of references: tapes are millions of objects that hold none.

The search looks at all objects there are each time that their number has grown by a quarter, which was a quarter to a
third of the time of a model of thousands of bodies, and a tenth of a first reading with its imports. Objects without
references are freed as ever.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def without_search_for_circles() -> Iterator[None]:
    """Switch the search off meanwhile, and on again if it was on."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
