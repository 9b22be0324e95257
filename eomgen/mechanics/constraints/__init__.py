"""Constraint equations with rates and partials; joints between absolute bodies; angles counted over revolutions."""

__all__ = []
#: Open to the other parts of ``mechanics`` as well.
WITHIN = ["beam_strains", "joints", "loops", "rows"]
