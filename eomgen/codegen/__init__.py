"""System -> Program -> C text."""
