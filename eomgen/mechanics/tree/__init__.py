"""The tree of links: joints as chains of elementary motions, base, inertias, beams as links that deform."""

__all__ = ["inertia"]
#: Open to the other parts of ``mechanics`` as well.
WITHIN = ["absolute", "alike", "base", "beam_body", "beam_fields", "build", "inertia", "joints", "links"]
