"""Triangle meshes, scenes, and where they come from."""
