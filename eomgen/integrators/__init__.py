"""Time integrators: methods as data that check themselves, and a slow, clear NumPy stepper as oracle of the C templates."""

__all__ = ["families", "methods", "newton", "step_splitting", "stepper_data", "stepper_layout"]
