"""The recipes by which gmsh makes meshes: a function of the name of each.

A new kind of mesh is a type in `solver.mesh.keys`, and a function of that type in `mapped`.
"""
