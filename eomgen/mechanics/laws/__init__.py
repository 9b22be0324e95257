"""Laws of bodies, joints and contacts: derived with SymPy, and stored as derived, so that no build imports it."""

__all__: list[str] = []
#: Open to the other parts of ``mechanics`` as well.
WITHIN = ["derived"]
