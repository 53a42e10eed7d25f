"""From a video to a motion: one person is followed through it, one body is fitted to all of its frames.

`follow_person` does all of it; `open_reel` reads, `Tracker` looks at single frames, `FilmFit` fits.
"""

from a2v.footage.follow import Followed, follow_person, is_video
from a2v.footage.settings import FollowSettings

__all__ = ["FollowSettings", "Followed", "follow_person", "is_video"]
