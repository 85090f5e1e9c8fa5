"""What is rendered: scenes, lights and mirrors, and the built-in scenes."""
