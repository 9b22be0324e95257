"""Applied forces and force elements as generalized forces, and the quantities in their formulas."""

__all__ = ["applied", "contact_pairs", "contacts", "cosserat_beams", "forces", "frame_pairs", "loads", "symbols"]
#: Open to the other parts of ``mechanics`` as well.
WITHIN = [
    "applied",
    "contact_pairs",
    "cosserat_beams",
    "frame_pairs",
    "internal_states",
    "loads",
    "section_loads",
    "symbols",
]
