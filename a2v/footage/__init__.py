"""From a video to a motion: one person is followed through it, one body is fitted to all of its
frames.

`a2v.footage.follow.follow_person` does all of it; `a2v.footage.reading` reads,
`a2v.footage.tracking` looks at single frames, `a2v.footage.fit` fits.
"""

from a2v.footage.reading import SUFFIXES, is_video
from a2v.footage.settings import FollowSettings

__all__ = ["SUFFIXES", "FollowSettings", "is_video"]
