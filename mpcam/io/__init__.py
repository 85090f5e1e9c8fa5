"""Files: images and their metadata, scene descriptions."""
