"""Nodes from moving vertices to frames and videos."""

from __future__ import annotations

import dataclasses
import functools
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from a2v.props import Props
from a2v.rendering.camera import CameraPath, ViewCamera
from a2v.rendering.scene import LookSettings
from a2v.types import VIEWS, Body, Character, RenderSettings
from pipelines.engine.memo import memo, note
from pipelines.engine.refs import Ref
from pipelines.engine.store import current, get, put
from pipelines.nodes.values import Blob, Image, Poses, Vertices, load_character


@memo(remember=False)
def frame_settings(render: RenderSettings) -> Ref[RenderSettings]:
    """Return the settings that a single frame depends on.

    The variant is the Mitsuba variant that works on this machine.
    """
    from a2v.rendering import choose_variant

    variant = render.variant
    if variant == "auto":
        variant, message = choose_variant()
        if message:
            note(message)
    return put(
        dataclasses.replace(
            render,
            variant=variant,
            views=VIEWS,
            follow=True,
            titles=False,
            threads=0,
            provenance={},
        )
    )


@memo()
def camera(
    vertices: np.ndarray,
    poses: Ref[Poses],
    body: Ref[Body],
    render: RenderSettings,
    cameras: tuple[CameraPath, ...],
) -> np.ndarray:
    """Return the cameras of every frame and view.

    They follow the character; the front view stands in the character's mean direction.
    """
    from a2v.animation.root_motion import ground_trajectory_of
    from a2v.rendering import extreme_points, follow_cameras

    moves = get(poses, Poses)
    facing = ground_trajectory_of(moves.bone_transforms, get(body, Body)).heading
    track = np.stack([extreme_points(get(ref, Vertices).vertices) for ref in vertices])
    wanted = (
        *VIEWS,
        *(view for view in render.views if view not in VIEWS),
    )  # The four views are the same whichever of them are requested.
    tracks = follow_cameras(
        track,
        dataclasses.replace(render, views=wanted),
        cameras=cameras,
        facing=facing,
        fps=moves.fps,
    )
    found = np.empty((len(track), len(render.views)), dtype=object)
    for c, view in enumerate(render.views):
        for t, one in enumerate(tracks[view]):
            found[t, c] = put(one)
    return found


@memo()
def frame(
    character: Ref[Character],
    vertices: Ref[Vertices],
    camera: Ref[ViewCamera],
    frame_settings: Ref[RenderSettings],
    backdrop: Ref[Blob] | None,
    look: LookSettings,
    things: Ref[Props],
) -> Ref[Image]:
    """Render one frame of one view, with what a person stands on, sits on and holds."""
    solids = get(things, Props)
    shape = put(solids.shape())  # the same in every frame, so that the scene is kept
    renderer = _renderer(current().address, character, frame_settings, backdrop, look, shape)
    moved = np.concatenate([get(vertices, Vertices).vertices, solids.at(0)])
    return put(Image.of(renderer.render(moved, get(camera, ViewCamera))))


@functools.lru_cache(maxsize=1)
def _renderer(
    address: str,
    character: Ref[Character],
    frame_settings: Ref[RenderSettings],
    backdrop: Ref[Blob] | None,
    look: LookSettings,
    props: Ref[Props],
) -> Any:
    """Return the scene, which is kept for later frames in the same process.

    Its setup takes seconds.
    """
    from a2v.body.parts import PARTS
    from a2v.perception.photo import decode_photo
    from a2v.rendering import Renderer
    from a2v.rendering.things import with_props
    from pipelines.engine.store import Store

    settings = threaded(Store(address).get(frame_settings, RenderSettings))
    picture = (
        None
        if backdrop is None
        else decode_photo(bytes(Store(address).get(backdrop, Blob)), "the background")[..., :3]
    )
    person = load_character(address, character)
    bare = np.isin(
        person.parts, [PARTS.index(part) for part in ("head", "left_hand", "right_hand")]
    )
    things = Store(address).get(props, Props)
    bare = np.concatenate([bare, np.zeros(len(things.vertices), bool)])
    return Renderer(with_props(person.surface, things), settings, look, backdrop=picture, bare=bare)


def threaded(settings: RenderSettings) -> RenderSettings:
    """Return an encoder with as many threads as this process may use: 1 in a worker."""
    return dataclasses.replace(settings, threads=int(os.environ.get("OMP_NUM_THREADS", "0")))


@memo()
def clip(frame: np.ndarray, poses: Ref[Poses]) -> Ref[Blob]:
    """Encode one view as an MP4."""
    return put(encode((get(ref, Image).pixels for ref in frame), get(poses, Poses).fps))


@memo()
def video(frame: np.ndarray, poses: Ref[Poses], render: RenderSettings) -> Ref[Blob]:
    """Encode all views side by side as an MP4, with their names above them if requested."""
    from a2v.rendering import contact_sheet

    labels = render.views if render.titles else None
    rows = ([get(ref, Image).pixels for ref in row] for row in frame)
    return put(
        encode(
            (contact_sheet(row, rows=1, cols=len(row), labels=labels, gap=0) for row in rows),
            get(poses, Poses).fps,
        )
    )


def encode(frames: Iterator[np.ndarray], fps: float) -> Blob:
    """Encode frames as an MP4."""
    from a2v.rendering import write_video

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "clip.mp4"
        write_video(path, frames, fps)
        return Blob.of(path.read_bytes())
