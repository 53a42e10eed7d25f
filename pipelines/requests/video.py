"""Request for a video: a person, a motion and a film.

Command line, tables, page and Python share this one description.
"""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Mapping
from dataclasses import dataclass

from a2v.formats.registry import split_clip
from pipelines.engine.graph import Graph, Parameters
from pipelines.engine.refs import File, Ref
from pipelines.engine.store import Store
from pipelines.graph import video_graph
from pipelines.options import group
from pipelines.requests.fields import check_known, hints_of, names_of
from pipelines.requests.film import FilmRequest
from pipelines.requests.motion import MotionRequest
from pipelines.requests.person import PersonRequest, listed


@dataclass(frozen=True, kw_only=True)
class Resolved:
    """A checked request: everything that the graph needs to make the video.

    Attributes
    ----------
    parameters : dict
        The inputs of `graph` by name.
    recorded : bool
        Whether the motion comes from a file.
    understood : tuple of str
        Interpretation of the words of the action: one line per part that is not the name of an
        action.
    """

    parameters: Parameters
    recorded: bool = False
    understood: tuple[str, ...] = ()

    @property
    def in_force(self) -> Parameters:
        """Return the parameters that are settings, with the defaults that were chosen.

        Files and references to the store are left out.
        """
        return {
            name: value
            for name, value in self.parameters.items()
            if not isinstance(value, Ref | File)
        }

    @property
    def graph(self) -> Graph:
        """Return the steps that make the video."""
        return video_graph(recorded=self.recorded, several="other" in self.parameters)


@dataclass(frozen=True, kw_only=True)
class VideoRequest:
    """A request for a video."""

    person: PersonRequest = group(PersonRequest)
    motion: MotionRequest = group(MotionRequest)
    film: FilmRequest = group(FilmRequest)

    @classmethod
    def of(cls, **values: object) -> VideoRequest:
        """Make a request from values by name; each value goes to the part that it belongs to.

        See `pipelines.requests.fields.Request.of`.
        """
        own = _by_part(values)
        return cls(
            person=PersonRequest.of(**own["person"]),
            motion=MotionRequest.of(**own["motion"]),
            film=FilmRequest.of(**own["film"]),
        )

    def changed(self, **values: object) -> VideoRequest:
        """Return the request with some values replaced."""
        parts = {
            part: getattr(self, part).changed(**own)
            for part, own in _by_part(values).items()
            if own
        }
        return dataclasses.replace(self, **parts) if parts else self

    def described(self) -> dict[str, object]:
        """Return all values by name, in the form that `of` takes."""
        parts = (getattr(self, item.name) for item in dataclasses.fields(self))
        return {
            item.name: getattr(part, item.name)
            for part in parts
            for item in dataclasses.fields(part)
        }

    def files(self) -> dict[str, str]:
        """Return the files that the request names, by the names of the values."""
        named = self.described()
        if named["motion"]:
            named["motion"], _ = split_clip(str(named["motion"]))
        more = {
            f"photo {number}": path
            for number, path in enumerate(listed(str(named["more"] or "")), 2)
        }
        return (
            {name: str(named[name]) for name in FILES if named[name]}
            | more
            | {
                name: str(named[name])
                for name in MAYBE_FILES
                if named[name] and os.path.isfile(str(named[name]))  # noqa: PTH113
            }
        )

    def resolve(self, store: Store) -> Resolved:
        """Check the request and read its files into `store`.

        Raises
        ------
        InputError
            An unknown model, action, view or look (the nearest are named), a number out of range,
            or an unreadable file.
        """
        film = self.film.resolve(store)
        moving = self.motion.resolve()
        parameters = film | moving.parameters | self.person.resolve(store)
        return Resolved(
            parameters=parameters,
            recorded=self.motion.motion is not None,
            understood=moving.understood,
        )


FILES = (
    *("photo", "mask", "keypoints", "corrections"),
    *("motion", "motion_bone_map", "timeline", "keyframes"),
)
"""Values that name a file."""
MAYBE_FILES = ("model", "background", "camera", "look", "path")
"""Values that may."""


@functools.cache
def _parts() -> Mapping[str, str]:
    """Return the part of the request that a name belongs to."""
    known = dict[str, str]()
    for part, kind in hints_of(VideoRequest).items():
        for name in (*names_of(kind), *(item.name for item in dataclasses.fields(kind))):
            if known.setdefault(name, part) != part:
                raise TypeError(f"two parts of a request have a value called {name}")
    return known


def names() -> tuple[str, ...]:
    """Return the names of all values of a request; settings of a stage look like ``fit.steps``."""
    return tuple(names_of(VideoRequest))


def _by_part(values: Mapping[str, object]) -> dict[str, dict[str, object]]:
    known = _parts()
    check_known([*values], known)
    own: dict[str, dict[str, object]] = {"person": {}, "motion": {}, "film": {}}
    for name, value in values.items():
        own[known[name]][name] = value
    return own


# --- straight to what a graph takes


def video_parameters(
    store: Store, photo: str | os.PathLike[str], action: str = "", **values: object
) -> Parameters:
    """Return the graph's parameters of a video from `values` with the names of `VideoRequest`.

    See `VideoRequest.resolve`.
    """
    return VideoRequest.of(photo=photo, action=action, **values).resolve(store).parameters


def photo_parameters(store: Store, photo: str | os.PathLike[str], **values: object) -> Parameters:
    """Return the graph's parameters from a photo to a character.

    `values` have the names of `PersonRequest`.
    """
    return PersonRequest.of(photo=photo, **values).resolve(store)
