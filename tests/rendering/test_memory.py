"""Memory stays constant over a hundred frames, from bones to pictures."""

from __future__ import annotations

import gc
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import psutil
import pytest

from a2v import Surface
from a2v.animation import ArapDeformer, bind
from a2v.body import load_body_model, make_body
from a2v.rendering import Renderer, follow_cameras
from a2v.types import RenderSettings


def resident_memory(frames: int) -> list[int]:
    """Bytes of this process after each picture but the first nine, which fill caches."""
    body = make_body(load_body_model(), grounded=True)
    character = bind(
        Surface(vertices=body.vertices, faces=body.faces, colors=np.full_like(body.vertices, 0.5)),
        body,
    )
    settings = RenderSettings(size=64, spp=2, threads=1)
    deformer, renderer = ArapDeformer(character), Renderer(character.surface, settings)
    moves = np.repeat(body.bone_transforms[None], frames, axis=0)
    moves[:, :, 2, 3] += np.linspace(0, 2, frames)[:, None]
    bounds = (
        np.stack([body.vertices.min(0), body.vertices.max(0)])
        + moves[:, :1, :3, 3]
        - moves[:1, :1, :3, 3]
    )
    cameras = follow_cameras(bounds, settings)
    process, resident = psutil.Process(), []
    gc.freeze()  # what is there already is not looked through after every frame
    for frame, transforms in enumerate(moves):
        renderer.render(deformer(transforms), cameras["left"][frame])
        if frame >= 9:
            gc.collect()
            resident.append(process.memory_info().rss)
    return resident


@pytest.mark.slow
def test_a_hundred_runs_of_the_deform_and_render_loop_keep_memory_flat() -> None:
    # A separate process: memory of other tests changes the figure, and their LLVM has aborted
    # Mitsuba's.
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        resident = pool.submit(resident_memory, 110).result()
    assert len(resident) == 101
    assert max(resident) <= 1.05 * resident[0]
    assert min(resident) >= 0.95 * resident[0]
