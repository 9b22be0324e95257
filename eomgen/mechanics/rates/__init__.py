"""Time derivatives of generalized forces and accelerations: recursion, jets, closed form."""
