"""Applied forces and force elements as generalized forces, and the quantities that their formulas mention."""
