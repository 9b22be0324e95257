"""Functions that give Taylor coefficients order by order, and where their pieces meet."""
