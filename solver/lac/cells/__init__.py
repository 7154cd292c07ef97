"""Cells: their types, shape functions, quadrature, faces, orientation."""
