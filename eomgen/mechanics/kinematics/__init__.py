"""Motion of bodies and points: velocity and acceleration fields, positions, directions, Jacobians."""
