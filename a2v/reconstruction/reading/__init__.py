"""Read a photo once: which pixels show which part, skin, hair, cloth or background, and facts such
as bare feet and skirts. `READERS` is the list of what is found."""

from a2v.reconstruction.reading.read import READERS, Reader, ReadingSettings, Source, read_photo
from a2v.reconstruction.reading.record import HairSeen, Reading

__all__ = ["READERS", "HairSeen", "Reader", "Reading", "ReadingSettings", "Source", "read_photo"]
