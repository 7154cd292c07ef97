"""Changes of a mesh: transforms, parts, moved nodes."""
