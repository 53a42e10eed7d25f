"""The sample photo, and the person that the pipeline makes of it."""

from a2v.samples.ready import ReadyPerson, load_ready_person

__all__ = ["ReadyPerson", "load_ready_person"]
