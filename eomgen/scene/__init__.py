"""What the user writes, read and checked: scene files, URDF, formulas, and the Scene they become."""
