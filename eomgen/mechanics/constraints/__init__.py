"""Constraint equations: rows, their rates and partials; joints between absolute bodies; counted angles."""
