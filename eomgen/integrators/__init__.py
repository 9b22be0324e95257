"""Time integrators: families of methods as data with checked order conditions, and the data of their C steppers."""

__all__ = ["compositions", "events", "families", "newton", "stepper_data", "stepper_layout"]
