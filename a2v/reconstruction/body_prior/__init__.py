"""The `body-prior` backend: the fitted body pushed out to the person's silhouette, without a
network."""

from a2v.reconstruction.body_prior.settings import SurfaceSettings
from a2v.reconstruction.body_prior.surface import body_prior_surface

__all__ = ["SurfaceSettings", "body_prior_surface"]
