"""Meshes, rays, volumes, colors: what several stages ask of geometry, once."""
