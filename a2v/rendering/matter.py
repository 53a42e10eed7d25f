"""What a person is made of, as far as light goes: skin with a soft falloff and a soft gloss, clear
eyes, all else matt.

Skin lets light in and out again some millimeters away, red further than blue, so the border of
light on it is soft and reddish. Here the cosine of each color reaches round the border by a part w
and keeps its sum, ((cos + w) / (1 + w)) ** (1 + 2 w), and rays to the lamps start some millimeters
above the skin. Gloss is a microfacet lobe (GGX; Walter et al., EGSR 2007) with Schlick's Fresnel
term.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.face import FACE_KINDS
from a2v.geometry.colors import srgb_to_linear
from a2v.geometry.mesh import evened
from a2v.types import MATERIALS, BoolArray, FloatArray, IntArray, Surface

EYE = 2.0
"""The mark of a wet surface; skin is 1, anything else 0."""

WRAP = (0.26, 0.12, 0.07)
"""How far light goes round the border on skin, red, green and blue."""

_LIFT = 0.004
"""How far above the skin a ray to a lamp begins, meters."""

_ROUGH = 0.22
"""Width of the lobe of skin (GGX's alpha)."""
_CLEAR = 0.07
"""Width of the lobe of eyes (GGX's alpha)."""

_LEAST = 50
"""Vertices that must look like skin."""
_SHARE = 0.15
"""And what part of those that mostly do."""

_RED = (0.1, 1.3)
"""What the logarithm of red over green is on skin of any color, in white light or nearly so."""
_BLUE = (-1.6, 0.05)
"""The same of blue over green."""

_FRESNEL = 0.028
"""Reflectance of skin and eyes face on (index of refraction 1.4)."""


def matter_of(surface: Surface, bare: BoolArray | None = None) -> FloatArray | None:
    """What each vertex is, (V,) float32: `EYE`, or how surely it is skin, 0 to 1. None where
    nothing says what its skin looks like.

    Skin is what has the color of the face: its ratios of red, green and blue within what they vary
    by on the face, as bright as the face in the light or in the shade; evened out over neighbors.
    Without a face of the body's own, the seen ones of the `bare` vertices that have a color that
    skin can have stand for it.

    Parameters
    ----------
    surface : Surface
    bare : (V,) bool, optional
        Where people mostly show their skin: vertices of head and hands.
    """
    linear = np.maximum(srgb_to_linear(surface.colors.astype(np.float64)), 2e-3)
    ratio = np.log(linear[:, [0, 2]] / linear[:, 1:2])
    bright = np.log(linear @ (0.2126, 0.7152, 0.0722))
    face = surface.face
    if face is not None:
        kinds = np.array(FACE_KINDS)[face.kinds]
        sure = face.patch[kinds == "skin"]
    else:
        sure = _skin_of(surface, ratio, bright, bare)
    if len(sure) < _LEAST:
        return None
    middle, usual = np.median(ratio[sure], axis=0), float(np.median(bright[sure]))
    spread = np.maximum(1.48 * np.median(np.abs(ratio[sure] - middle), axis=0), 0.17)
    off = np.hypot(*((ratio - middle) / spread).T)
    like = np.exp(-0.5 * np.maximum(off - 1, 0) ** 2) * (
        (bright > usual - 1.3) & (bright < usual + 1.6)
    )
    like = np.clip(2 * evened(surface.faces, like, 6) - 0.5, 0, 1)
    if face is None:
        return np.asarray(like, np.float32)
    like[sure] = np.maximum(
        like[sure], 0.9 * (bright[sure] > usual - 1.3)
    )  # hair may hang into the face
    for kind, value in (("eye", EYE), ("mouth", 1.0), ("teeth", 0.0), ("tongue", 0.0)):
        like[face.patch[kinds == kind]] = value
    return np.asarray(like, np.float32)


def materials_of(surface: Surface, head: BoolArray, hands: BoolArray) -> IntArray:
    """What each face of a person is made of, (F,) uint8, an index into `MATERIALS`: eyes and mouth
    are the body's own, skin has the color of the face, hair is what else the head has, and all
    else is cloth. Each face is what most of its corners are.

    Parameters
    ----------
    surface : Surface
    head, hands : (V,) bool
        Vertices of head and hands.
    """
    like = matter_of(surface, head | hands)
    kinds = np.full(len(surface.vertices), MATERIALS.index("cloth"))
    kinds[head] = MATERIALS.index("hair")
    if like is not None:
        kinds[(like > 0.5) & (like <= 1)] = MATERIALS.index("skin")
    if surface.face is not None:
        names = np.array([MATERIALS.index(_MATERIAL_OF[name]) for name in FACE_KINDS])
        kinds[surface.face.patch] = names[surface.face.kinds]
    corners = kinds[surface.faces]
    agreed = np.where(corners[:, 1] == corners[:, 2], corners[:, 1], corners[:, 0])
    return agreed.astype(np.uint8)


_MATERIAL_OF = {
    "skin": "skin",
    "eye": "eyes",
    "mouth": "mouth",
    "tongue": "mouth",
    "teeth": "mouth",
}
"""What `FACE_KINDS` are for engines."""


def _skin_of(
    surface: Surface, ratio: FloatArray, bright: FloatArray, bare: BoolArray | None
) -> IntArray:
    """The seen vertices (n,) among the `bare` ones (V,) of a color that skin can have: neither
    hair, which is darker, nor gloves; none if they are few.

    `ratio` (V, 2) are the logarithms of red and blue over green, `bright` (V,) that of the
    luminance.
    """
    none = np.zeros(0, np.int64)
    if bare is None:
        return none
    looked = bare if surface.visible is None else bare & surface.visible
    can = (
        (ratio[:, 0] > _RED[0])
        & (ratio[:, 0] < _RED[1])
        & (ratio[:, 1] > _BLUE[0])
        & (ratio[:, 1] < _BLUE[1])
    )
    found = np.flatnonzero(looked & can)
    if len(found) < max(_LEAST, _SHARE * looked.sum()):
        return none
    # of skin and brown hair, skin is the brighter and the redder one
    light = found[bright[found] > np.quantile(bright[found], 0.9) - 1.0]
    return light if len(light) >= _LEAST else none


@dataclass(frozen=True, kw_only=True)
class Hit:
    """At points of the scene: how much is skin or eye, the width of its lobe, the shading normal
    and the way to the viewer."""

    mi: Any
    skin: Any
    glossy: Any
    alpha: Any
    normal: Any
    viewer: Any

    @classmethod
    def of(cls, mi: Any, table: Any, si: Any, person: Any, normal: Any, ray: Any) -> Hit:
        """`table` (F,) holds `matter_of` for the person's faces."""
        import drjit as dr

        value = dr.gather(mi.Float, table, si.prim_index, person)
        eye = value > 1.5
        alpha = dr.select(eye, _CLEAR, _ROUGH)
        glossy = dr.select(eye, 1.0, value)
        return cls(
            mi=mi,
            skin=dr.select(eye, 0.0, value),
            glossy=glossy,
            alpha=alpha,
            normal=normal,
            viewer=-ray.d,
        )

    def raised(self, ray: Any) -> Any:
        """A ray that begins above the skin."""
        ray.o += self.normal * (_LIFT * self.skin)
        return ray

    def least(self) -> Any:
        """The cosine from which on light reaches a point."""
        return -WRAP[0] * self.skin

    def falloff(self, cosine: Any) -> Any:
        """What of a lamp's light comes back matt, by color, instead of the `cosine`."""
        import drjit as dr

        parts = []
        for wrap in WRAP:
            reach = wrap * self.skin
            parts.append(dr.power(dr.maximum(cosine + reach, 1e-6) / (1 + reach), 1 + 2 * reach))
        return self.mi.Color3f(*parts)

    def gloss(self, way: Any, cosine: Any) -> Any:
        """The mirrored part of a lamp's light in direction `way`, pi times the lobe times the
        cosine."""
        import drjit as dr

        half = dr.normalize(way + self.viewer)
        near, along = dr.maximum(dr.dot(self.normal, half), 0), dr.maximum(dr.dot(way, half), 0.1)
        square = dr.square(self.alpha)
        spread = square / dr.square(dr.square(near) * (square - 1) + 1)
        return (
            self.glossy * spread * _schlick(along) * dr.maximum(cosine, 0) / (4 * dr.square(along))
        )

    def mirrored(self) -> tuple[Any, Any]:
        """Where the viewer sees the sky mirrored, and how much of it."""
        import drjit as dr

        facing = dr.maximum(dr.dot(self.normal, self.viewer), 0)
        return 2 * facing * self.normal - self.viewer, self.glossy * _schlick(facing) * dr.select(
            self.alpha < 0.1, 1.0, 0.5
        )


def _schlick(cosine: Any) -> Any:
    rest = 1 - cosine
    square = rest * rest
    return _FRESNEL + (1 - _FRESNEL) * square * square * rest
