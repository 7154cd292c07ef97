"""Mesh files of all formats, read and written."""
