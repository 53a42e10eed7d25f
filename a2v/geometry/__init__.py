"""Meshes, rays, volumes, colours: what several stages ask of geometry, once."""
