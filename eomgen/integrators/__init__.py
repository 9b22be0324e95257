"""Time integrators: families of methods as data that check themselves, and what the C of a stepper is made from."""

__all__ = ["families", "methods", "newton", "step_splitting", "stepper_data", "stepper_layout"]
