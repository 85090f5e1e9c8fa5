"""What views of a scene from one point are good for: environment maps, shadow maps, occlusion."""
