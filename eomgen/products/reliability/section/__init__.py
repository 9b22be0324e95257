"""Random processes of a scene, expanded in standard normal variables that are tunable parameters."""

__all__ = []
#: Open to the other parts of ``scene`` as well.
WITHIN = ["schema", "sections"]
