"""Applied forces and force elements as generalized forces, and the quantities that their formulas mention."""

__all__ = []
#: Open to the other parts of ``mechanics`` as well.
WITHIN = ["applied", "beams", "frame_pairs", "internal_states", "loads", "symbols", "tyres"]
