"""Events and modes of a scene: roots of formulas that stop a run, are counted, or change the state."""

__all__ = []
#: Open to the other parts of ``scene`` as well.
WITHIN = ["model", "sections"]
