"""a2v in Python: characters from photos, motions, and videos of them.

``import a2v`` offers these functions and imports this module when one is used. The module stands
above all layers: both the library's name and the commands lead here. Requests, defaults, store and
results are those of the commands (`pipelines.requests`, `pipelines.commands`).
"""

from __future__ import annotations

import contextlib
import itertools
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from typing_extensions import Unpack

from a2v.errors import InputError
from a2v.formats.registry import write_motion
from a2v.io import brief
from a2v.types import Character, Motion
from pipelines.commands import character as character_command
from pipelines.commands import reconstruct as reconstruct_command
from pipelines.commands import video as video_command
from pipelines.engine.progress import Listener
from pipelines.engine.store import Store
from pipelines.given import listing, path_given
from pipelines.inputs import RunOptions, check_writable
from pipelines.keywords import FileKeywords, FilmKeywords, MotionKeywords, PersonKeywords
from pipelines.motion_file import FORMATS
from pipelines.outputs import made_motion, write_blob
from pipelines.requests.file import FileRequest
from pipelines.requests.film import FilmRequest
from pipelines.requests.motion import MotionRequest
from pipelines.requests.person import MOST_PHOTOS, PersonRequest
from pipelines.requests.video import Resolved, VideoRequest

Where = str | os.PathLike[str]


@dataclass(frozen=True, kw_only=True)
class _Running(RunOptions):
    """How these functions run a graph: like the commands, but without output unless requested."""

    quiet: bool = True
    listener: Listener | None = None

    @classmethod
    def of(
        cls, progress: bool | Listener, cache: Where | None = None, workers: int | None = None
    ) -> _Running:
        """Return bars for True, nothing for False, else the given function."""
        if not isinstance(progress, bool) and not callable(progress):
            raise InputError(
                f"progress is {brief(progress)}; expected True, False or a function of an Update"
            )
        if workers is not None and (not isinstance(workers, int) or workers < 1):
            raise InputError(f"workers is {brief(workers)}; expected a whole number from 1 on")
        return cls(
            quiet=progress is not True,
            listener=None if isinstance(progress, bool) else progress,
            cache=None if cache is None else path_given("cache", cache, "a folder"),
            workers=workers,
        )

    @contextlib.contextmanager
    def listening(self) -> Iterator[Listener]:
        """Yield the user's progress function if there is one, else progress bars."""
        if self.listener is not None:
            yield self.listener
            return
        with super().listening() as bars:
            yield bars


@dataclass(frozen=True, kw_only=True)
class MotionClip:
    """The result of `make_motion`: a motion and its request.

    Attributes
    ----------
    request : MotionRequest
        The request.
    motion : Motion
        The joints, as ``a2v motion`` writes them.
    understood : tuple of str
        Interpretation of the words of the action: one line per part that is not the name of an
        action.
    """

    request: MotionRequest
    motion: Motion = field(repr=False)
    understood: tuple[str, ...] = ()

    def save(self, path: Where) -> Path:
        """Write it as ``a2v motion --out`` does.

        The formats are ``.npz``, ``.bvh``, and stick figures as ``.mp4``, ``.gif`` or ``.png``.

        Raises
        ------
        InputError
            No format has such a name, or the file cannot be written.
        """
        target = Path(path_given("path", path, "the name of a file to write"))
        check_writable(target.parent)
        return write_motion(target, self.motion, FORMATS)[0]


@dataclass(frozen=True, kw_only=True)
class Person:
    """The result of `make_character`: a character and its request.

    Attributes
    ----------
    request : PersonRequest
        The request.
    character : Character
        The surface with its body and its binding, as frames show it; files for other tools have
        fewer triangles (``triangles=0``: all).
    notes : tuple of str
        Notes about the result, such as doubts about the photo.
    running : RunOptions
        Where and how it was made; its videos use the same.
    """

    request: PersonRequest
    character: Character = field(repr=False)
    notes: tuple[str, ...]
    running: RunOptions = field(repr=False)

    @listing(FileKeywords)
    def save(
        self,
        path: Where,
        motions: Mapping[str, MotionClip] | None = None,
        **values: Unpack[FileKeywords],
    ) -> Path:
        """Write the character with clips by name, as ``a2v character --out`` does.

        Without clips it is the file of ``a2v reconstruct``.

        Parameters
        ----------
        path : path
            ``.glb``, ``.fbx``, ``.usdz``, ``.vrm`` or ``.html``; without clips also ``.obj`` or
            ``.ply``.
        motions : mapping of MotionClip
            Clips by their names in the file.
        values : the options of ``a2v character`` for exported files
            ``pose="photo"``, ``rig="mixamo"``, ``root_motion=True``, ``visemes="vrchat"``,
            ``author``, ``license_url``, ``vrm="0.x"``, ``lods="15000,8000"`` and
            ``compress="meshopt"``; triangles and texture are `make_character`'s.

        Raises
        ------
        InputError
            No format has this suffix, the format lacks a requested part, an option is unknown, or
            the file cannot be written.
        """
        target = Path(path_given("path", path, "the name of a file to write"))
        asked = _clips(motions)
        own = FileRequest.of(**values)
        posing, rigging, engine = own.posing, own.rigging, own.engine
        posing.check_rig(target, rigging)
        engine.check(target)
        bare = not asked and rigging.plain and target.suffix.lower() in reconstruct_command.FORMATS
        avatar = None if bare else character_command.avatar_of(target, rigging, own.avatar)
        if asked:
            animated = character_command.animate(
                self.request,
                asked,
                self.running,
                deform=None,
                folder=target.parent,
                posing=posing,
            )
        else:
            check_writable(target.parent)
            outcome = self.running.run(
                ["engine_character", *posing.targets],
                self.request.resolve(Store(self.running.cache)),
            )
            animated = character_command.Animated(
                character=posing.posed(outcome, "engine_character")
            )
        if bare:
            return reconstruct_command.write_person(target, animated.character, engine)[0]
        return character_command.write_animated(target, animated, rigging, engine, avatar)[0]


def _clips(motions: Mapping[str, MotionClip] | None) -> dict[str, MotionRequest]:
    """Return the requests of clips by name.

    Raises
    ------
    InputError
        One is no `MotionClip`.
    """
    if not isinstance(motions or {}, Mapping):
        raise InputError(f"motions is {brief(motions)}; expected clips by their names")
    for name, clip in (motions or {}).items():
        if not isinstance(clip, MotionClip):
            raise InputError(f"{name} is {brief(clip)}; expected a result of make_motion")
    return {name: clip.request for name, clip in (motions or {}).items()}


@listing(PersonKeywords)
def make_character(
    photo: Where | None = None,
    *,
    photos: Sequence[Where] = (),
    progress: bool | Listener = False,
    cache: Where | None = None,
    workers: int | None = None,
    **values: Unpack[PersonKeywords],
) -> Person:
    """Make the character of the person in one or several photos.

    Parameters
    ----------
    photo : path
        The person, seen whole.
    photos : sequence of paths
        Instead: two to eight photos of the same person in the same clothes, from several sides. The
        character is made in the first one's pose; the order of the others means nothing.
    progress : bool or function of an `Update`
        True draws bars on standard error; a function hears how far the stages are.
    cache : path or None
        The store; by default ``$A2V_CACHE``, else ``~/.cache/a2v``, as for the commands.
    workers : int or None
        Number of processes; one per core by default.
    values : the options of ``a2v reconstruct`` by their names with underscores
        ``mask="m.png"``, ``backend="body-prior"``, ``fit={"height": 1.6}``.

    Raises
    ------
    InputError
        An unknown name, a value or a file that cannot be used, or nobody is found in the photo.
    """
    if isinstance(photos, str | bytes | os.PathLike):
        raise InputError(f"photos is {brief(photos)}; expected a list of paths")
    given = [
        path_given("photo", path, "the path of an image")
        for path in (
            *(() if photo is None else (photo,)),
            *itertools.islice(photos, MOST_PHOTOS + 1),
        )
    ]
    if not given:
        raise InputError("no photo given; name one, or several of the same person as photos=")
    if named := [path for path in given[1:] if "," in path]:
        raise InputError(
            f"the name {named[0]} has a comma, and commas separate further photos; rename it"
        )
    more = {"more": ",".join(given[1:])} if given[1:] else {}
    request = PersonRequest.of(photo=given[0], **more, **values)
    running = _Running.of(progress, cache, workers)
    outcome = running.run("character", request.resolve(Store(running.cache)))
    return Person(
        request=request,
        character=outcome.get("character", Character),
        notes=outcome.notes,
        running=running,
    )


@listing(MotionKeywords)
def make_motion(
    action: str = "",
    *,
    progress: bool | Listener = False,
    cache: Where | None = None,
    **values: Unpack[MotionKeywords],
) -> MotionClip:
    """Make a motion from the name or description of an action, or read one from a file.

    Parameters
    ----------
    action : str
        "walk slowly, then wave"; an action's name, or words.
    progress, cache : see `make_character`
    values : the options of ``a2v video`` that are a motion's, by their names with underscores
        ``seconds=6``, ``seed=4``, ``path="0,0 0,3"``, ``loop=True``; ``motion="dance.bvh"`` for a
        recorded one.

    Raises
    ------
    InputError
        An unknown name, words that mean no action (the nearest are named), or a value or a file
        that cannot be used.
    """
    request, running = MotionRequest.of(action=action, **values), _Running.of(progress, cache)
    moving = request.resolve()
    resolved = Resolved(
        parameters=moving.parameters,
        recorded=request.motion is not None,
        understood=moving.understood,
    )
    outcome = running.run("motion", resolved.parameters, graph=resolved.graph)
    return MotionClip(
        request=request,
        motion=made_motion(outcome, resolved.parameters["edit"]),
        understood=resolved.understood,
    )


@listing(FilmKeywords)
def make_video(
    person: Person,
    motion: MotionClip,
    path: Where,
    *,
    progress: bool | Listener = False,
    **values: Unpack[FilmKeywords],
) -> Path:
    """Make the video of a person in motion; return its path.

    Parameters
    ----------
    person, motion : results of `make_character` and `make_motion`
    path : path
        An ``.mp4``: the views side by side. Without a suffix a folder, which gets everything that
        ``a2v video --out`` writes.
    progress : see `make_character`
    values : the options of ``a2v video`` that are the film's, by their names with underscores
        ``views=("front", "turntable")``, ``size=720``, ``look="night"``, ``background="#30506f"``.

    Raises
    ------
    InputError
        An unknown name, a value that cannot be used, or the file cannot be written.
    """
    if not isinstance(person, Person):
        raise InputError(f"person is {brief(person)}; expected the result of make_character")
    clip = _clips({"motion": motion})["motion"]
    film, target = FilmRequest.of(**values), Path(path_given("path", path, "an .mp4 or a folder"))
    running = _Running.of(progress, person.running.cache, person.running.workers)
    if not target.suffix:
        options = video_command.Options(
            person=person.request,
            out=str(target),
            motion=clip,
            film=film,
            running=running,
        )
        return video_command.make(options, tell=lambda line: None).files[0]
    if target.suffix.lower() != ".mp4":
        raise InputError(
            f"cannot write {target}; expected a name that ends in .mp4, or a folder for all "
            "files of a video"
        )
    if film.in_photo:
        raise InputError(
            "the background photo also writes photo.mp4; give a folder instead of an .mp4"
        )
    resolved = VideoRequest(person=person.request, motion=clip, film=film).resolve(
        Store(running.cache)
    )
    check_writable(target.parent)
    outcome = running.run("video", resolved.parameters, graph=resolved.graph)
    return write_blob(outcome, outcome.values["video"], target)
