"""Calculus from tape to tape: partials, gradients, jets in time."""
