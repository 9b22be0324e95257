"""Euler-Bernoulli beams as bodies: shape functions and their integrals, attachments, and what they add to the separated terms."""
