"""SDF: models and worlds of Gazebo and Drake, and their conversion to a scene."""

#: Open to the other parts of ``scene``.
WITHIN = ["source"]
