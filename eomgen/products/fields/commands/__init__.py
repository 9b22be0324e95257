"""Commands of Hamiltonian systems: runs and information of coordinates, meshes and samples of fields."""

__all__ = []
#: Open to the other parts of ``products`` as well.
WITHIN = ["hamiltonian", "mesh_info"]
