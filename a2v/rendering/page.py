"""A web page in one file: the character, which can be turned in the browser, next to the video.

The page needs no server and no network. The viewer is three.js with its glTF loader. It is read
from the wheel of trimesh, which carries both for its own notebooks (MIT license; the notice stays
in the page).
"""

from __future__ import annotations

import base64
import csv
import functools
import html
import importlib.util
import json
import os
import re
import tempfile
import zipfile
from importlib import metadata
from pathlib import Path

from a2v.errors import A2VError, InputError
from a2v.formats.characters import Clips, Strengths
from a2v.formats.gltf import write_glb
from a2v.formats.registry import CharacterFormat
from a2v.io import atomic_path, read_bytes
from a2v.props import Props
from a2v.types import Character

MAX_PAGE_BYTES = 400 << 20
"""Largest size of a page; browsers refuse to open much larger ones."""


@functools.lru_cache(maxsize=1)
def viewer_script() -> str:
    """Return three.js with ``THREE.GLTFLoader`` as one classic script; it defines the global
    ``THREE``.

    Raises
    ------
    A2VError
        The installed trimesh does not contain this viewer.
    """
    # trimesh itself is not imported: that takes half a second
    found = importlib.util.find_spec("trimesh")
    folder = Path(found.origin if found and found.origin else ".").parent
    try:
        with zipfile.ZipFile(folder / "resources" / "templates" / "viewer.zip") as archive:
            page = archive.read("viewer.html.template").decode("utf-8")
    except (OSError, KeyError, zipfile.BadZipFile):
        page = ""
    end = "THREE.GLTFLoader=GLTFLoader;})();"  # trimesh's own page follows it
    begin, stop = page.find("<script>"), page.find(end)
    if begin < 0 or stop < begin or "AnimationMixer" not in page[begin:stop]:
        raise A2VError(
            f"trimesh {metadata.version('trimesh')} carries no three.js viewer with animation; "
            "install trimesh 5.2"
        )
    return str(page[begin + len("<script>") : stop + len(end)])


@functools.lru_cache(maxsize=1)
def stage_script() -> str:
    """Return a script that defines ``makeStage``: light, ground and a camera turned by hand. It
    needs `viewer_script`."""
    return Path(__file__).with_name("stage.js").read_text(encoding="utf-8")


@functools.lru_cache(maxsize=1)
def speech_script() -> str:
    """Return a script that defines ``makeSpeech``, which moves the mouth of a character, and
    ``VISEMES``, its table."""
    script = Path(__file__).with_name("speech.js").read_text(encoding="utf-8")
    return f"{script}\nconst VISEMES = {json.dumps(_visemes())};\n"


def write_page(
    path: str | os.PathLike[str],
    character: bytes | str | os.PathLike[str],
    video: bytes | str | os.PathLike[str] | None = None,
    *,
    title: str = "a2v",
) -> None:
    """Write an HTML page with an animated character that can be turned, and a video beside it.

    The video runs in step with the first clip. A fragment
    ``#azimuth=90&elevation=10&time=0.5&clip=1`` after the page's address chooses the direction of
    view (degrees; 90: the person's left), a time to stop at (seconds) and a clip.

    Parameters
    ----------
    path
        Ends in ``.html``; written atomically.
    character : bytes or path
        A binary glTF, such as `a2v.formats.write_glb`'s.
    video : bytes or path or None
        An MP4.
    title : str
        Heading of the page.

    Raises
    ------
    InputError
        `character` is not a binary glTF, `video` is not an MP4, or both together are too large for
        a page.
    """
    pieces = _pieces(_data(character), b"" if video is None else _data(video), title)
    with atomic_path(path) as temporary, open(temporary, "wb") as stream:
        stream.writelines(pieces)


def page_of(glb: bytes, film: bytes = b"", *, title: str = "a2v") -> str:
    """Return the HTML of `write_page` for a binary glTF and an MP4 (may be empty)."""
    return b"".join(_pieces(glb, film, title)).decode()


def _pieces(glb: bytes, film: bytes, title: str) -> list[bytes]:
    """Return the parts of a page. As one string it would be copied several times on the way to a
    file."""
    if glb[:4] != b"glTF":
        raise InputError("the character is not a binary glTF (.glb); make one with write_glb")
    if film and film[4:8] != b"ftyp":
        raise InputError("the video is not an MP4; make one with write_video")
    if len(glb) + len(film) > MAX_PAGE_BYTES:
        raise InputError(
            f"character and video are {(len(glb) + len(film)) >> 20} MB; expected at most "
            f"{MAX_PAGE_BYTES >> 20} MB"
        )
    parts: dict[str, bytes] = {
        "title": html.escape(title).encode(),
        "layout": b"both" if film else b"alone",
        "glb": base64.b64encode(glb),
        "video": b'<video id="video" src="data:video/mp4;base64,%b" %b></video>'
        % (base64.b64encode(film), _PLAYER)
        if film
        else b"",
    }
    return [piece if name is None else parts[name] for name, piece in _template()]


_PLAYER = b"controls loop muted autoplay playsinline"


@functools.lru_cache(maxsize=1)
def _template() -> tuple[tuple[str | None, bytes], ...]:
    """Split the page's template at its placeholders. Return pairs of the placeholder's name and its
    text; the name of text between placeholders is None."""
    text = Path(__file__).with_name("page.html").read_text(encoding="utf-8")
    words = re.split(r"\$(title|video|layout|glb|viewer|stage|speech|visemes)\b", text)
    pieces = [(word if place % 2 else None, word.encode()) for place, word in enumerate(words)]
    scripts = {
        "viewer": viewer_script(),
        "stage": stage_script(),
        "speech": Path(__file__).with_name("speech.js").read_text(encoding="utf-8"),
        "visemes": json.dumps(_visemes()),
    }
    return tuple(
        (None, scripts[name].encode()) if name in scripts else (name, piece)
        for name, piece in pieces
    )


def _visemes() -> dict[str, dict[str, float]]:
    """Return the face shapes of each viseme, from the table of `a2v.animation.visemes`."""
    path = Path(__file__).parents[1] / "animation" / "visemes.csv"
    with open(path, encoding="utf-8", newline="") as stream:
        rows = [row for row in csv.DictReader(stream) if row["vrchat"]]
    words = {row["viseme"]: row["shapes"].split() for row in rows}
    return {
        name: dict(zip(some[::2], map(float, some[1::2]), strict=True))
        for name, some in words.items()
    }


def write_character_page(
    path: str | os.PathLike[str],
    character: Character,
    clips: Clips,
    *,
    expressions: Strengths | None = None,
    props: Props | None = None,
) -> None:
    """Write an HTML page of a character with named clips, its facial expressions and the props of
    the scene.

    Raises
    ------
    InputError
        A clip does not fit the character, or the page would be too large.
    """
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "character.glb"
        write_glb(source, character, clips, expressions=expressions, props=props)
        write_page(path, source, title=", ".join(clips))


PAGE_FORMATS: tuple[CharacterFormat, ...] = (
    CharacterFormat(suffixes=(".html",), write=write_character_page),
)
"""Formats that show characters."""


def _data(source: bytes | str | os.PathLike[str]) -> bytes:
    if isinstance(source, bytes):
        return source
    return read_bytes(source, limit=MAX_PAGE_BYTES)
