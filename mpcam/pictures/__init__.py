"""Pictures of scenes: rendered with and without a mirror, all around from a point, and explained."""
