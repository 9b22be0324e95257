"""SDF: models and worlds of Gazebo and Drake, and their conversion to a scene."""

__all__ = []
