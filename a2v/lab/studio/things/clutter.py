"""Surroundings of a person in a view: objects in the hands, furniture, other people, and
photographs behind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from a2v.geometry.colors import srgb_to_linear
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.lighting import background
from a2v.lab.studio.posing import Pose
from a2v.lab.studio.stand import Sitting, Stand
from a2v.lab.studio.things.backgrounds import Backgrounds
from a2v.lab.studio.things.furniture import Body, draw_furniture
from a2v.lab.studio.things.held import Held, draw_held
from a2v.lab.studio.things.paint import draw_patterns
from a2v.lab.studio.things.solids import Thing, joined, with_thing
from a2v.types import BoolArray, ByteArray, FloatArray

PATTERNS = 4
"""Number of patterns of one view's objects."""
_NEAREST = 0.3
"""Objects nearer to the camera than this fraction of its distance are left out."""
_MOST_HIDDEN = 0.5
"""Largest fraction of the person that another person may occlude."""


@dataclass(frozen=True, eq=False)
class CutOut:
    """A person cut out of a picture: linear light (h, w, 3) float32, and its alpha (h, w)
    float32."""

    color: FloatArray
    alpha: FloatArray

    @classmethod
    def of(cls, image: ByteArray, mask: BoolArray) -> CutOut:
        """Cut out the person of a picture, sRGB (H, W, 3), without the rim."""
        rows, columns = np.nonzero(mask)
        box = slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1)
        thin = cv2.erode(
            mask[box].astype(np.uint8),
            np.ones((3, 3), np.uint8),
            borderType=cv2.BORDER_CONSTANT,
            borderValue=1,
        )
        alpha = cv2.GaussianBlur(thin.astype(np.float32), (0, 0), 0.6)
        return cls(srgb_to_linear(image[box].astype(np.float32) / 255).astype(np.float32), alpha)


@dataclass(frozen=True, eq=False)
class Clutter:
    """The surroundings of one person.

    Attributes
    ----------
    held : Held, optional
        Object in the hands. Its pose must be the person's.
    furniture : bool
        Whether there is furniture.
    others : sequence of CutOut
        Other people; mostly empty.
    photographs : Backgrounds, optional
        Photographs that replace the drawn background.
    """

    held: Held | None = None
    furniture: bool = False
    others: Sequence[CutOut] = ()
    photographs: Backgrounds | None = None

    @classmethod
    def draw(
        cls,
        generator: np.random.Generator,
        *,
        things: float = 0.0,
        furniture: float = 0.0,
        others: float = 0.0,
        people: Sequence[CutOut] = (),
        photographs: float = 0.0,
        backgrounds: Backgrounds | None = None,
    ) -> Clutter:
        """Draw surroundings by these shares. A share of 0 draws no random number.

        Others are chosen from `people`, photographs from `backgrounds`.
        """

        def happens(share: float) -> bool:
            return share > 0 and bool(generator.random() < share)

        held = draw_held(generator) if happens(things) else None
        seat = happens(furniture)
        beside: Sequence[CutOut] = ()
        if people and happens(others):
            beside = [
                people[int(at)]
                for at in generator.integers(len(people), size=int(generator.integers(1, 4)))
            ]
        return cls(
            held, seat, beside, backgrounds if backgrounds and happens(photographs) else None
        )

    @property
    def grip(self) -> Pose:
        """Rotations of fingers and arms that hold the object; they replace the pose's."""
        return self.held.pose if self.held is not None else {}

    def solids(
        self, placed: Stand, generator: np.random.Generator
    ) -> tuple[Thing, list[ByteArray]] | None:
        """Return the objects in the photo's frame, with their patterns; None if there are none or
        they would reach the camera."""
        if self.held is None and not self.furniture:
            return None
        parts: list[Thing] = []
        avatar: Avatar = placed.outfit.avatar
        ground = np.array(placed.transforms, np.float64)
        ground[:, :3, 3] += placed.shift
        if self.held is not None:
            parts.append(self.held.placed(avatar, ground))
        if self.furniture:
            person = avatar.skin(placed.transforms) + placed.shift
            found = draw_furniture(Body.of(avatar, ground, person), generator)
            parts.append(
                Thing(found.vertices, found.faces, found.uv, (found.patterns + 2) % PATTERNS)
            )
        patterns = draw_patterns(generator, PATTERNS)
        frame, whole = placed.frame, joined(parts)
        away = frame.distance - (whole.vertices - frame.middle) @ frame.axes[2]
        if float(away.min()) < _NEAREST * frame.distance:
            return None
        return Thing(frame.warp(whole.vertices), whole.faces, whole.uv, whole.patterns), patterns

    def around(
        self, size: int, feet: float, person: BoolArray, generator: np.random.Generator
    ) -> tuple[FloatArray | None, FloatArray | None]:
        """Draw the background (H, H, 3) and the foreground (H, H, 4), linear light; None for the
        default.

        Parameters
        ----------
        size : int
            Side of the picture, pixels.
        feet : float
            Row of the person's feet, pixels.
        person : (S, S) bool
            Pixels of the person.
        """
        if self.photographs is None and not self.others:
            return None, None
        picture = (
            background(size, feet, generator)
            if self.photographs is None
            else self.photographs.draw(size, generator)
        )
        if not self.others:
            return picture, None
        front = np.zeros((size, size, 4), np.float32)
        rows, columns = np.nonzero(
            cv2.resize(person.astype(np.uint8), (size, size), interpolation=cv2.INTER_NEAREST)
        )
        tall, covered = float(np.ptp(rows)), np.zeros((size, size), np.float32)
        covered[rows, columns] = 1
        picture = np.concatenate([picture, np.ones((size, size, 1), np.float32)], axis=-1).astype(
            np.float32
        )
        for other in self.others:
            nearer = bool(generator.random() < 0.5)
            height = (
                tall * generator.uniform(0.9, 1.7)
                if nearer
                else tall * generator.uniform(0.45, 1.0)
            )
            middle = columns.mean() + generator.choice([-1, 1]) * generator.uniform(
                0.15, 0.8
            ) * tall * (0.7 if nearer else 1.0)
            foot = feet + (
                generator.uniform(0.0, 0.9) * height * 0.5
                if nearer
                else -generator.uniform(0, 0.15) * tall
            )
            layer = _laid(other, size, height, float(middle), float(foot), generator)
            hides = float((np.maximum(layer[..., 3], front[..., 3]) * covered).sum()) / max(
                float(covered.sum()), 1.0
            )
            if nearer and hides < _MOST_HIDDEN:
                front = _over(layer, front)
            else:
                picture = _over(layer, picture)
        return picture[..., :3], front if front[..., 3].any() else None


NOTHING = Clutter()


def among(alone: Sitting, thing: Thing, patterns: Sequence[ByteArray]) -> Sitting:
    """Return a person among objects in the same frame."""
    surface, normals = with_thing(alone.surface, alone.normals, thing, patterns)
    return Sitting(
        surface=surface,
        normals=normals,
        camera=alone.camera,
        own=(len(alone.surface.vertices), len(alone.surface.faces)),
    )


def _laid(
    other: CutOut,
    size: int,
    height: float,
    middle: float,
    foot: float,
    generator: np.random.Generator,
) -> FloatArray:
    """Place a person on an empty picture (H, H, 4): `height` pixels tall, in the column `middle`,
    with the feet in the row `foot`."""
    scale = height / other.alpha.shape[0]
    shift = np.array([middle - scale * other.alpha.shape[1] / 2, foot - height])
    matrix = np.array([[scale, 0, shift[0]], [0, scale, shift[1]]])
    source = np.dstack([other.color * float(np.exp(generator.normal(0, 0.25))), other.alpha])
    if generator.random() < 0.5:
        source = source[:, ::-1]
    if scale < 0.7:  # reduce without aliasing
        source = cv2.GaussianBlur(source, (0, 0), 0.4 / scale)
    return np.asarray(
        cv2.warpAffine(
            np.ascontiguousarray(source, np.float32), matrix, (size, size), flags=cv2.INTER_LINEAR
        )
    )


def _over(layer: FloatArray, picture: FloatArray) -> FloatArray:
    """Composite a layer (H, W, 4) over a picture (H, W, 4); neither is premultiplied by its
    alpha."""
    own, below = layer[..., 3:], picture[..., 3:]
    alpha = own + below * (1 - own)
    color = (layer[..., :3] * own + picture[..., :3] * below * (1 - own)) / np.maximum(alpha, 1e-6)
    return np.concatenate([color, alpha], axis=-1)
