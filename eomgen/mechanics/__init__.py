"""Virtual work to separated terms: kinematics, bodies, base motion, forces, partials."""
