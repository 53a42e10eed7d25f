"""How the person's materials reflect light: skin with a soft falloff and a soft gloss, clear eyes,
all else matte.

Light enters skin and leaves it again some millimeters away, red farther than blue. So the border
between light and shadow on skin is soft and reddish. Here the cosine of each color reaches around
that border by a width w and keeps its integral, ((cos + w) / (1 + w)) ** (1 + 2 w), and rays to the
lamps start some millimeters above the skin. Gloss is a microfacet lobe (GGX; Walter et al., EGSR
2007) with Schlick's Fresnel term.
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
"""Value of wet surfaces in the table of materials. Skin has 1, everything else 0."""

WRAP = (0.26, 0.12, 0.07)
"""Width w by which light reaches around the shadow border on skin: red, green, blue."""

_LIFT = 0.004
"""Height above the skin at which a ray to a lamp starts, meters."""

_ROUGH = 0.22
"""Width of the lobe of skin (GGX's alpha)."""
_CLEAR = 0.07
"""Width of the lobe of eyes (GGX's alpha)."""

_LEAST = 50
"""Smallest number of vertices that must have a skin color."""
_SHARE = 0.15
"""Smallest fraction of the usually bare vertices that must have a skin color."""

_RED = (0.1, 1.3)
"""Range of log(red / green) on skin of any color, in white or nearly white light."""
_BLUE = (-1.6, 0.05)
"""Range of log(blue / green) on skin."""

_FRESNEL = 0.028
"""Reflectance of skin and eyes at normal incidence (index of refraction 1.4)."""


def matter_of(surface: Surface, bare: BoolArray | None = None) -> FloatArray | None:
    """Return the material of each vertex, (V,) float32: `EYE`, or the probability of skin, 0 to 1.

    Returns None if the color of the skin cannot be found. Vertices with the color of the face are
    skin: their ratios of red, green and blue are within the variation on the face, and they are as
    bright as the lit or shaded face. The result is smoothed over neighbors. If the surface has no
    face of the body model, the visible `bare` vertices with a possible skin color replace the face.

    Parameters
    ----------
    surface : Surface
    bare : (V,) bool, optional
        Vertices of head and hands, where skin is usually bare.
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
    )  # hair may hang over the face
    for kind, value in (("eye", EYE), ("mouth", 1.0), ("teeth", 0.0), ("tongue", 0.0)):
        like[face.patch[kinds == kind]] = value
    return np.asarray(like, np.float32)


def materials_of(surface: Surface, head: BoolArray, hands: BoolArray) -> IntArray:
    """Return the material of each face of a person, (F,) uint8, an index into `MATERIALS`.

    Eyes and mouth are the body model's. Skin has the color of the face, the rest of the head is
    hair, and all else is cloth. Each face has the material of most of its corners.

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
"""Names of `FACE_KINDS` as materials for engines."""


def _skin_of(
    surface: Surface, ratio: FloatArray, bright: FloatArray, bare: BoolArray | None
) -> IntArray:
    """Return the visible vertices (n,) among the `bare` ones (V,) that have a possible skin color.

    Hair (darker) and gloves are left out. The result is empty if only few remain. `ratio` (V, 2)
    are the logarithms of red and blue over green, `bright` (V,) is that of the luminance.
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
    # skin is brighter and redder than brown hair
    light = found[bright[found] > np.quantile(bright[found], 0.9) - 1.0]
    return light if len(light) >= _LEAST else none


@dataclass(frozen=True, kw_only=True)
class Hit:
    """Material at points of the scene: weights of skin and eye, width of the lobe, shading normal,
    direction to the viewer."""

    mi: Any
    skin: Any
    glossy: Any
    alpha: Any
    normal: Any
    viewer: Any

    @classmethod
    def of(cls, mi: Any, table: Any, si: Any, person: Any, normal: Any, ray: Any) -> Hit:
        """Look up the material at hits; `table` (F,) holds `matter_of` for the person's faces."""
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
        """Return a ray that starts above the skin."""
        ray.o += self.normal * (_LIFT * self.skin)
        return ray

    def least(self) -> Any:
        """Return the smallest cosine at which light still reaches a point."""
        return -WRAP[0] * self.skin

    def falloff(self, cosine: Any) -> Any:
        """Return the fraction of a lamp's light that is reflected diffusely, per color, in place of
        the `cosine`."""
        import drjit as dr

        parts = []
        for wrap in WRAP:
            reach = wrap * self.skin
            parts.append(dr.power(dr.maximum(cosine + reach, 1e-6) / (1 + reach), 1 + 2 * reach))
        return self.mi.Color3f(*parts)

    def gloss(self, way: Any, cosine: Any) -> Any:
        """Return the glossy part of a lamp's light from direction `way`: pi times the lobe times
        the cosine."""
        import drjit as dr

        half = dr.normalize(way + self.viewer)
        near, along = dr.maximum(dr.dot(self.normal, half), 0), dr.maximum(dr.dot(way, half), 0.1)
        square = dr.square(self.alpha)
        spread = square / dr.square(dr.square(near) * (square - 1) + 1)
        return (
            self.glossy * spread * _schlick(along) * dr.maximum(cosine, 0) / (4 * dr.square(along))
        )

    def mirrored(self) -> tuple[Any, Any]:
        """Return the direction in which the viewer sees the sky reflected, and its reflectance."""
        import drjit as dr

        facing = dr.maximum(dr.dot(self.normal, self.viewer), 0)
        return 2 * facing * self.normal - self.viewer, self.glossy * _schlick(facing) * dr.select(
            self.alpha < 0.1, 1.0, 0.5
        )


def _schlick(cosine: Any) -> Any:
    rest = 1 - cosine
    square = rest * rest
    return _FRESNEL + (1 - _FRESNEL) * square * square * rest
