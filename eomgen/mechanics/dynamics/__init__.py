"""The equations in separated form: M, h, b, Q, their partials, forward dynamics, energies."""
