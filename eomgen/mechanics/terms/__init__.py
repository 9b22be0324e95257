"""Terms that are recorded on request: forward dynamics, implicit steps, linear models, rates."""
