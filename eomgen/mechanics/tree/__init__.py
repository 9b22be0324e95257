"""The tree of links: joints as chains of elementary motions, base, inertias, beams as links that deform."""
