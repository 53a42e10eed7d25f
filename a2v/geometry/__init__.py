"""Geometry that several stages share: meshes, rays, volumes, colors."""
