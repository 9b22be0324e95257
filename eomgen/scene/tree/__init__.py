"""The tree of a scene: sections of bodies, beams, joints and all with a place there, read together."""

__all__: list[str] = []
#: Open to the other parts of ``scene``.
WITHIN = ["beam_attachments", "sections"]
