"""Every screen of the page of ``a2v serve``, with records that a test invents: nothing is computed."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from playwright.sync_api import Page, Route

from a2v import Character, Surface
from a2v.animation import bind
from a2v.body import load_body_model, make_body
from a2v.formats.gltf import write_glb
from a2v.geometry.mesh import vertex_normals
from a2v.rendering import write_page, write_video
from pipelines.serve.figure import QUATS
from pipelines.serve.stages import packed
from pipelines.serve.wishes import Wish
from tests.support.page import ROOT

SAMPLE = ROOT / "a2v" / "samples" / "person.jpg"
PHOTO, BAD = "a" * 16, "b" * 16
STATES: Mapping[str, dict[str, Any]] = {
    "1": {"status": "done", "action": "Walk", "seed": 0},
    "2": {"status": "done", "action": "Walk", "seed": 1},
    "3": {"status": "failed", "action": "Jump", "problem": "The disk is full; free some space."},
    "4": {"status": "cancelled", "action": "Salsa"},
    "5": {"status": "running", "action": "Run, then bow"},
    "7": {"status": "waiting", "action": "Sit", "place": 1},
    "8": {"status": "waiting", "action": "Backflip", "place": 2},
}
"""Jobs by the digit of their identity."""
TRIANGLE = packed(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]]), np.ones((3, 3), np.float32))
"""A shape that is made."""
FILES = {
    "video.mp4": 812_345,
    "front.mp4": 190_000,
    "back.mp4": 190_000,
    "character.glb": 3_912_345,
    "motion.bvh": 190_000,
    "motion.npz": 90_000,
    "preview.html": 5_412_000,
    "report.json": 31_000,
}


def striped() -> Character:
    """A person whose front is blue and whose back is brown."""
    body = make_body(load_body_model(), grounded=True)
    normals = vertex_normals(body.vertices.astype(np.float64), body.faces.astype(np.int64))
    colors = np.where(normals[:, 2:] > 0, (0.2, 0.4, 0.7), (0.5, 0.35, 0.2)).astype(np.float32)
    vertices = (body.vertices + 0.005 * normals).astype(np.float32)
    return bind(Surface(vertices=vertices, faces=body.faces, colors=colors), body)


def moved(character: Character, moves: np.ndarray) -> dict[str, Any]:
    """The answer of the server about a motion: the person stands."""
    bones = len(character.body.bone_names)
    whole = np.tile(np.array([0, 0, 0, QUATS], "<i2"), (len(moves), bones, 1))
    place = np.tile(moves[:, 0, :3, 3], (1, 1)).ravel().round(4).tolist()
    return {
        "fps": 10.0, "frames": len(moves), "place": place, "face": {},
        "bones": base64.b64encode(whole.tobytes()).decode(),
    }  # fmt: skip


class Screens:
    """Invented photos and jobs, their files, and the screens that show them.

    Parameters
    ----------
    folder : where ``preview.html``, ``both.html`` (with a video) and their parts are written
    """

    def __init__(self, folder: Path) -> None:
        character = striped()
        moves = np.repeat(character.body.bone_transforms[None], 3, axis=0)
        write_glb(folder / "c.glb", character, {"walk": (moves, 10.0)})
        write_page(folder / "preview.html", folder / "c.glb", title="Walk")
        frame = np.full((64, 128, 3), (90, 120, 150), np.uint8)
        write_video(folder / "v.mp4", [frame] * 3, 10.0)
        write_page(folder / "both.html", folder / "c.glb", folder / "v.mp4", title="Walk")
        self.folder = folder
        self._motion = moved(character, moves)
        with Image.open(SAMPLE) as opened:
            picture = opened.convert("RGB")
        picture.thumbnail((900, 900))
        self.size = picture.size
        self._photo, self._mask = io.BytesIO(), io.BytesIO()
        picture.save(self._photo, "jpeg")
        Image.new("RGBA", picture.size, (0, 0, 0, 90)).save(self._mask, "png")

    def state(self, *, jobs: bool = True, bad: bool = False, made: bool = True) -> dict[str, Any]:
        """The answer of the server about its records."""
        width, height = self.size
        grid = [[0.3 + 0.4 * (i % 6) / 5, 0.1 + 0.8 * (i // 6) / 5] for i in range(33)]
        photo = {
            "id": PHOTO,
            "title": "me.jpg",
            "status": "ready",
            "problem": "",
            "warnings": ["the left foot is outside of the photo; its shape is guessed"],
            "width": width,
            "height": height,
            "landmarks": [[u * width, v * height, 0.9] for u, v in grid],
            "known": made,
            "notes": ["the pose was not understood: expect a wrong shape"] if made else [],
            "files": {"exports/anny.glb": 3_912_345, "live/live-1.bvh": 90_000} if made else {},
            "progress": None
            if made
            else {"stage": "Surface", "share": 0.4, "left": 31.0, "shown": ["body"]},
            "people": [[0.1, 0.1, 0.5, 0.9], [0.5, 0.1, 0.9, 0.9]],
            "corrected": True,
            "looks": 1,
            "more": ["0" * 8],
            "clip": ".mp4",
            "clip_title": "dance.mp4",
            "clip_seconds": 9.5,
        }
        worse = photo | {"id": BAD, "status": "unusable", "title": "hill.jpg", "warnings": []}
        worse |= {"problem": "No person was found. Send a photo of one person, seen whole."}
        return {
            "photos": [photo, worse] if bad else [photo],
            "jobs": [self._job(digit, how) for digit, how in STATES.items()] if jobs else [],
            "motions": [
                {"id": "c" * 16, "title": "my dance", "seconds": 9.5, "notes": ["the first of 3"]}
            ],
            "damaged": 2 if bad else 0,
            "problem": "changes cannot be saved: the disk is full" if bad else "",
        }

    def _job(self, digit: str, how: Mapping[str, Any]) -> dict[str, Any]:
        status, done = how["status"], how["status"] == "done"
        progress = {"stage": "Frames 3 of 12", "share": 0.4, "left": 31.0}
        return {
            "id": digit * 16,
            "photo": PHOTO,
            "wish": Wish(action=how["action"], seed=how.get("seed", 0)).said(),
            "title": how["action"],
            "created": float(digit),
            "status": status,
            "problem": how.get("problem", ""),
            "seconds": 62.0 if done else 0.0,
            "notes": ["the arms are held closer than recorded"] if done else [],
            "files": FILES if done else {},
            "place": how.get("place", 0),
            "progress": progress if status == "running" else None,
        }

    def _still(self) -> dict[str, str]:
        return {"picture": base64.b64encode(self._photo.getvalue()).decode()}

    def serve(self, page: Page, state: Mapping[str, Any]) -> None:
        """Answer for the server about photos and jobs."""
        answers: Mapping[str, tuple[str, bytes]] = {
            "api/state": ("application/json", json.dumps(state).encode()),
            "api/photos/*/corrections": ("application/json", b'{"units": "fractions"}'),
            "photos/*/mask.png?1": ("image/png", self._mask.getvalue()),
            "photos/*/*.jpg*": ("image/jpeg", self._photo.getvalue()),
            "photos/*/stage_*.bin*": ("application/octet-stream", TRIANGLE),
            "photos/*/person.glb*": ("model/gltf-binary", (self.folder / "c.glb").read_bytes()),
            "api/people/*/still": ("application/json", json.dumps(self._still()).encode()),
            "api/people/*/play": ("application/json", json.dumps(self._motion).encode()),
            "jobs/*/*.mp4": ("video/mp4", (self.folder / "v.mp4").read_bytes()),
        }

        def answered(kind: str, body: bytes) -> Callable[[Route], None]:
            return lambda route: route.fulfill(body=body, content_type=kind)

        for pattern, (kind, body) in answers.items():
            page.route(f"**/{pattern}", answered(kind, body))


def unfold(page: Page) -> None:
    """Open all that can be opened."""
    for summary in page.locator("main summary").all():
        opened = summary.evaluate("item => item.parentElement.open")
        if summary.is_visible() and not opened:
            summary.click()


def _export(name: str) -> Callable[[Page], None]:
    def press(page: Page) -> None:
        page.locator("body[data-person]").wait_for()
        page.locator("#export").click()
        page.get_by_role("tab", name=name).click()
        for summary in page.locator("#exporting summary").all():
            summary.click()

    return press


def _camera(page: Page) -> None:
    page.locator("#camera").click()


def _correct(page: Page) -> None:
    page.locator("#person").evaluate("item => { item.open = true; }")
    page.locator("#correct").click()
    for summary in page.locator("#fixing summary").all():
        summary.click()


def _words(page: Page) -> None:
    page.locator("#action").fill("walk, then jump")
    page.locator("#chips .chip").first.click()


SCREENS: Mapping[str, tuple[dict[str, bool] | None, Callable[[Page], None]]] = {
    "empty": (None, lambda page: None),
    "unfolded": (None, unfold),
    "acting": ({"jobs": False}, _words),
    "making": ({"jobs": False, "made": False}, unfold),
    "broken": ({"jobs": False, "bad": True}, lambda page: None),
    "camera": ({"jobs": False}, _camera),
    "correct": ({"jobs": False}, _correct),
    "films": ({}, unfold),
    "clip": ({"jobs": False}, _export("Clip")),
    "film": ({"jobs": False}, _export("Film")),
    "gif": ({"jobs": False}, _export("GIF")),
    "sprites": ({"jobs": False}, _export("Sprites")),
    "character": ({"jobs": False}, _export("Person")),
}
"""By name: arguments of `Screens.state` (None: the server's own, which has no record), and what is
pressed."""


def show(page: Page, screens: Screens, address: str, name: str) -> None:
    """Bring a page to one of `SCREENS`."""
    told, press = SCREENS[name]
    page.unroute_all()
    if told is not None:
        screens.serve(page, screens.state(**told))
    page.goto("about:blank")  # or a change of the fragment alone would not load the page
    page.goto(address if told is None else f"{address}#photo={PHOTO}")
    page.locator("body[data-ready=yes]").wait_for()
    if told is not None:
        page.locator("#shown[src]").wait_for(state="attached")
    press(page)
    page.wait_for_timeout(300)
