"""Convert a video to a motion: track one person through it, and fit one body to all of its frames.

`a2v.footage.follow.follow_person` does all of it. `a2v.footage.reading` reads videos,
`a2v.footage.tracking` detects the person in single frames, and `a2v.footage.fit` fits the body.
"""

from a2v.footage.reading import SUFFIXES, is_video
from a2v.footage.settings import FollowSettings

__all__ = ["SUFFIXES", "FollowSettings", "is_video"]
