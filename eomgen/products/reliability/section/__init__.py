"""Random processes of a scene, expanded in standard normal variables that are tunable parameters."""

__all__ = []
