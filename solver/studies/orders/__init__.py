"""Orders of convergence on ladders of meshes."""
