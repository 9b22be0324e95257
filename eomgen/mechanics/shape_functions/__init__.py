"""Shape functions of beams and their integrals, exact to the last digit on every machine."""
