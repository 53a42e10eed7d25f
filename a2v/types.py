"""The types that stages exchange: few, immutable, plain numbers.

Conventions (see ``docs/conventions.md``): meters, seconds, radians; right-handed axes, **y up**,
the person faces **+z**, so the person's left is **+x**; the ground is ``y = 0``; float32 at rest.
Every type has `save` and `load` to one ``.npz`` (no pickles).
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from a2v.camera import Camera as Camera
from a2v.camera import OrthographicCamera as OrthographicCamera
from a2v.camera import PhotoCamera as PhotoCamera
from a2v.errors import InputError
from a2v.face import Face as Face
from a2v.record import Record
from a2v.standing import Standing as Standing

FloatArray = NDArray[np.floating[Any]]
IntArray = NDArray[np.integer[Any]]
ByteArray = NDArray[np.uint8]
BoolArray = NDArray[np.bool_]

VIEWS: tuple[str, ...] = ("front", "back", "left", "right")
"""The paper's four views. `a2v.rendering.CameraPath` adds a turntable and custom views."""

MATERIALS: tuple[str, ...] = ("skin", "hair", "cloth", "eyes", "mouth")
"""The materials of a person, as engines shade them."""

NAME_PATTERN = r"[A-Za-z0-9][\w-]{0,63}"
"""Regular expression of names that become file names."""

Progress = Callable[[int, int], None]
"""Called by long tasks as ``progress(done, total)``. The command line or the notebook draws the
bar."""


@dataclass(frozen=True, kw_only=True)
class Motion(Record):
    """A clip of skeletal motion, or a batch of equally long clips.

    Attributes
    ----------
    joints : (..., T, J, 3) float32
        Joint positions, meters, world, y up.
    rotations : (..., T, J, 3) float32
        Rotation vectors, radians, in the papers' *chain* convention (Eq. 6): entry ``j`` turns the
        bone that ends at joint ``j`` relative to the previous bone of its kinematic chain; a chain
        starts from the identity, and entry 0 is zero. ``joints = forward_kinematics(rotations,
        root, bones)``.
    root : (..., T, 3) float32
        Position of joint 0, meters.
    fps : float
        Frames per second.
    parents : (J,) int
        Index of each joint's parent, parents first, -1 for the root.
    joint_names : tuple of J str
    skeleton : str
        Name of the skeleton in `a2v.kinematics.SKELETONS`, or "custom".
    action : str
        Name of the action; the actions of a transition are separated by commas.
    seed : int
        Seed of the generation; -1 for recorded motion.
    rest_offsets : (J, 3) float64 or None
        Rest pose of the file or body that the motion is from: each joint from its parent, meters,
        axes as everywhere; row 0 is zero.
    given_frames : int or None
        Number of first frames that were given; the others were generated to continue them.
    action_starts : (A,) float64 or None
        Start of each of the A actions in `action`, seconds from the first frame; None if unknown.
    expressions : strengths (T,) float32 by ARKit's names, or None
        Expressions of the face, in [0, 1], from a video.
    """

    joints: FloatArray
    rotations: FloatArray
    root: FloatArray
    fps: float
    parents: IntArray
    joint_names: tuple[str, ...]
    skeleton: str = "custom"
    action: str = ""
    seed: int = -1
    rest_offsets: FloatArray | None = None
    given_frames: int | None = None
    action_starts: FloatArray | None = None
    expressions: Mapping[str, FloatArray] | None = None

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {}
        self._check("joints", ("T", "J", 3), sizes, leading=True)
        self._check("rotations", ("T", "J", 3), sizes, leading=True)
        self._check("root", ("T", 3), sizes, leading=True)
        self._check("parents", ("J",), sizes)
        self._check("rest_offsets", ("J", 3), sizes)
        self._check("action_starts", ("A",), {"A": len(self.action.split(","))})
        if len(self.joint_names) != sizes["J"]:
            raise InputError(
                f"Motion has {len(self.joint_names)} joint names for {sizes['J']} joints"
            )
        if sizes["T"] < 1:
            raise InputError("Motion has no frames")
        if 0 in self.batch:
            raise InputError(
                f"Motion is a batch of {' x '.join(map(str, self.batch))} clips; expected at least "
                "one"
            )
        if not (np.isfinite(self.fps) and self.fps > 0):
            raise InputError(f"Motion.fps is {self.fps}; expected a positive number")
        if self.given_frames is not None and not 0 <= self.given_frames <= sizes["T"]:
            raise InputError(
                f"Motion.given_frames is {self.given_frames}; expected 0 to {sizes['T']}, its "
                "number of frames"
            )
        order = np.arange(sizes["J"])
        if (
            not len(order)
            or self.parents[0] != -1
            or (self.parents[1:] < 0).any()
            or (self.parents[1:] >= order[1:]).any()
        ):
            raise InputError(
                "Motion.parents must list parents before children, with -1 for joint 0 alone"
            )

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return int(self.joints.shape[-3])

    @property
    def batch(self) -> tuple[int, ...]:
        """Leading batch shape; empty for one clip."""
        return tuple(self.joints.shape[:-3])

    def __getitem__(self, index: Any) -> Motion:
        """Return the clip or clips at `index` of the leading batch dimensions."""
        if not self.batch:
            raise InputError("this Motion is a single clip, not a batch")
        return dataclasses.replace(
            self, joints=self.joints[index], rotations=self.rotations[index], root=self.root[index]
        )

    def first(self, frames: int) -> Motion:
        """Return the first `frames` frames of every clip of a batch; all if there are fewer."""
        kept = {
            name: getattr(self, name)[(*[slice(None)] * len(self.batch), slice(frames))]
            for name in ("joints", "rotations", "root")
        }
        given = None if self.given_frames is None else min(self.given_frames, frames)
        shown = (
            None
            if self.expressions is None
            else {name: strength[:frames] for name, strength in self.expressions.items()}
        )
        return dataclasses.replace(self, **kept, given_frames=given, expressions=shown)


@dataclass(frozen=True, kw_only=True)
class BodyMap(Record):
    """The body in a square around the person, in pixels of the `Subject`'s image.

    Depths are measured over the floor, larger is nearer, 0 at the middle of the hips; *scales* are
    those of Laplace distributions.

    Attributes
    ----------
    landmarks : (33, 3) float32
        Landmarks of a body in BlazePose order: u, v and depth.
    landmark_scales : (33, 2) float32
        Scale in the picture, and scale in depth.
    places : (S, S, 3) float32
        Place on the body (`a2v.body.places.canonical_places`) at the middle of each pixel of the
        map.
    place_scales : (S, S) float32
        In the unit of `places`.
    depths, depth_scales : (S, S, 2) float32
        Depth of the person's front, and of the back behind it.
    inside : (S, S) bool
        Pixels that the network assigns to the person; the other maps are undefined elsewhere.
    corner : tuple of 2 float
        The upper left corner of the square.
    step : float
        Side of a pixel of the map.
    """

    landmarks: FloatArray
    landmark_scales: FloatArray
    places: FloatArray
    place_scales: FloatArray
    depths: FloatArray
    depth_scales: FloatArray
    inside: BoolArray
    corner: tuple[float, ...]
    step: float

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {}
        for name, shape in {
            "landmarks": (33, 3),
            "landmark_scales": (33, 2),
            "places": ("S", "S", 3),
            "place_scales": ("S", "S"),
            "depths": ("S", "S", 2),
            "depth_scales": ("S", "S", 2),
            "inside": ("S", "S"),
        }.items():
            self._check(name, shape, sizes)

    def pixels(self) -> FloatArray:
        """Return the centers (S, S, 2) of the map's pixels in the image: u, v."""
        steps = (np.arange(len(self.inside)) + 0.5) * self.step
        return np.stack(np.meshgrid(self.corner[0] + steps, self.corner[1] + steps), axis=-1)


@dataclass(frozen=True, kw_only=True)
class Subject(Record):
    """The person in a photo: an upright crop with mask and landmarks.

    Attributes
    ----------
    image : (H, W, 3) uint8
        sRGB crop around the person, EXIF orientation applied, H and W at most 2048.
    mask : (H, W) float32
        Opacity of the person in [0, 1] (an alpha matte).
    keypoints : (33, 3) float32
        Landmarks in BlazePose order (`a2v.perception.BLAZEPOSE`): u, v in pixels of `image`,
        confidence in [0, 1] (0: unseen; then u and v are undefined).
    keypoints_3d : (33, 3) float32
        Estimated positions, meters, relative to the middle of the hips, axes as everywhere (y up,
        +z toward the camera). A person who stands upright is upright here too, at any height of the
        camera; NaN if unknown.
    crop : tuple of 4 int
        Left, top, right, bottom of the crop in the upright photo's pixels (may reach outside of
        it).
    photo_size : tuple of 2 int
        Width and height of the upright photo.
    warnings : tuple of str
        Notes for the user (feet outside the photo, sideways person...).
    face : (478, 3) float32 or None
        Mediapipe's landmarks of the face: u, v and depth in pixels of `image`, larger is nearer;
        None if no face was found.
    hands : (2, 21, 4) float32 or None
        Mediapipe's landmarks of the left and the right hand: u, v and depth (larger is nearer, 0 at
        the wrist) in pixels of `image`, and 1 if that hand was found, else 0. None if neither was
        found.
    bodymap : BodyMap or None
        Output of our own network, by which `keypoints` and `keypoints_3d` were corrected; None if
        it was not run.
    focal_length : float or None
        From the photo's file, 35 mm equivalent, millimeters.
    given : (33,) bool or None
        Landmarks that the user has placed; they are certain. None if there are none.
    sides : (8,) float32 or None
        The user's depth order for each bone of `a2v.kinematics.names.LIMB_BONES`: 1 if the far end
        lies in front of the near end, -1 if behind it, 0 if not given. None if none is given.
    people : (n, 4) float32 or None
        Left, top, right, bottom of all people found, the largest first, in pixels of the upright
        photo; None if there is only one.
    """

    may_hold_nan: ClassVar[frozenset[str]] = frozenset({"keypoints_3d"})

    image: ByteArray
    mask: FloatArray
    keypoints: FloatArray
    keypoints_3d: FloatArray
    crop: tuple[int, ...]
    photo_size: tuple[int, ...]
    warnings: tuple[str, ...] = ()
    face: FloatArray | None = None
    hands: FloatArray | None = None
    bodymap: BodyMap | None = None
    focal_length: float | None = None
    given: BoolArray | None = None
    sides: FloatArray | None = None
    people: FloatArray | None = None

    def __post_init__(self) -> None:
        self._check("image", (None, None, 3))
        self._check("mask", self.image.shape[:2])
        self._check("keypoints", (33, 3))
        self._check("keypoints_3d", (33, 3))
        self._check("face", (478, 3))
        self._check("hands", (2, 21, 4))
        self._check("given", (33,))
        self._check("sides", (8,))
        self._check("people", (None, 4))


@dataclass(frozen=True, kw_only=True)
class Surface(Record):
    """A closed triangle mesh of a person with colors.

    Attributes
    ----------
    vertices : (V, 3) float32
        Meters, y up, in the frame of `camera`: the photo is the orthographic front view.
    faces : (F, 3) int32
        Counter-clockwise seen from outside.
    colors : (V, 3) float32
        sRGB in [0, 1].
    uv : (F, 3, 2) float32 or None
        Texture coordinates of each face's corners, origin at the lower left.
    texture : (H, W, 3) uint8 or None
        sRGB; goes with `uv`. Row 0 is the top (v = 1).
    visible : (V,) bool or None
        Whether the photo's camera saw the vertex.
    twins : (V,) int32 or None
        The vertex of the fitted body that each vertex is a copy of (as in the hands), -1 for none.
    face : Face or None
        Its expressions, if the photo shows a face from the front.
    standing : Standing or None
        The same mesh in the body's rest pose, only of canonical characters. The face's offsets are
        then in that pose.
    normal_map : (H, W, 3) uint8 or None
        Detail that the vertices lack: normals in the tangent space of
        `a2v.geometry.normal_map.corner_tangents`, as glTF keeps them; goes with `uv`.
    materials : (F,) uint8 or None
        Material of each face, an index into `MATERIALS`.
    """

    vertices: FloatArray
    faces: IntArray
    colors: FloatArray
    uv: FloatArray | None = None
    texture: ByteArray | None = None
    visible: BoolArray | None = None
    twins: IntArray | None = None
    face: Face | None = None
    standing: Standing | None = None
    normal_map: ByteArray | None = None
    materials: IntArray | None = None

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {"materials": len(MATERIALS)}
        self._check("vertices", ("V", 3), sizes)
        self._check("faces", ("F", 3), sizes, below="V")
        self._check("colors", ("V", 3), sizes)
        self._check("materials", ("F",), sizes, below="materials")
        if self.normal_map is not None and self.uv is None:
            raise InputError("Surface.normal_map needs uv")
        if (self.uv is None) != (self.texture is None):
            raise InputError("Surface needs both uv and texture, or neither")
        self._check("uv", ("F", 3, 2), sizes)
        self._check("visible", ("V",), sizes)
        self._check("twins", ("V",), sizes, least=-1)
        if self.face is not None:
            self.face.check_vertices(sizes["V"])
        if self.standing is not None and len(self.standing.vertices) != sizes["V"]:
            raise InputError(
                f"Surface.standing has {len(self.standing.vertices)} vertices; expected the "
                f"surface's {sizes['V']}"
            )


@dataclass(frozen=True, kw_only=True)
class Reconstruction(Record):
    """A backend's result: the shape of a person, and the colors that the backend expects.

    Attributes
    ----------
    surface : Surface
        Closed, in the frame of the photo's camera. Its colors are not set yet.
    backend : str
        Name of the backend, one of `a2v.reconstruction.backends.NAMES`.
    from_body : bool
        Whether the surface is the fitted body itself, pushed outward. Fitting a body to it again
        gives no new information.
    expected_colors : (V, 3) float32 or None
        c^p of Eq. 14: sRGB in [0, 1] that the backend predicts for each vertex, NaN if unknown;
        None if it predicts no colors.
    """

    may_hold_nan: ClassVar[frozenset[str]] = frozenset({"expected_colors"})

    surface: Surface
    backend: str
    from_body: bool = False
    expected_colors: FloatArray | None = None

    def __post_init__(self) -> None:
        self._check("expected_colors", (len(self.surface.vertices), 3))


@dataclass(frozen=True, kw_only=True)
class Body(Record):
    """A parametric body in one pose and shape, with its rig.

    Attributes
    ----------
    model : str
        Name of the body model ("anny").
    parameters : dict of arrays
        The model's own parameters of this shape and pose.
    vertices : (V, 3) float32
        Meters, in the frame of the photo's camera (or of the world, for a body without a photo).
    faces : (F, 3) int32
    bone_names : tuple of B str
    bone_parents : (B,) int
        -1 for the root; parents first.
    bone_transforms : (B, 4, 4) float32
        World from bone at this pose; the translation is the bone's head (its joint).
    rest_transforms : (B, 4, 4) float32
        World from bone in the rest pose of the same shape.
    bone_tails : (B, 3) float32
        Other end of each bone at this pose, meters.
    weights : (V, B) float32
        Linear blend skinning weights; rows sum to 1.
    parts : (V,) int8
        Body part of each vertex, an index into `a2v.body.PARTS`.
    """

    model: str
    parameters: Mapping[str, np.ndarray]
    vertices: FloatArray
    faces: IntArray
    bone_names: tuple[str, ...]
    bone_parents: IntArray
    bone_transforms: FloatArray
    rest_transforms: FloatArray
    bone_tails: FloatArray
    weights: FloatArray
    parts: IntArray

    def __post_init__(self) -> None:
        sizes = {"B": len(self.bone_names)}
        self._check("vertices", ("V", 3), sizes)
        self._check("faces", ("F", 3), sizes, below="V")
        self._check("bone_parents", ("B",), sizes, below="B", least=-1)
        self._check("bone_transforms", ("B", 4, 4), sizes)
        self._check("rest_transforms", ("B", 4, 4), sizes)
        self._check("bone_tails", ("B", 3), sizes)
        self._check("weights", ("V", "B"), sizes)
        self._check("parts", ("V",), sizes)


@dataclass(frozen=True, kw_only=True)
class Character(Record):
    """A surface bound to a body; it can be animated and exported.

    Attributes
    ----------
    surface : Surface
        In the bind pose, which is the photo's pose (`body.bone_transforms`).
    body : Body
        The fitted body.
    weights : (V, 4) float32
        Skinning weights of the surface's vertices, largest first, rows sum to 1.
    bones : (V, 4) int32
        Bones of `weights`.
    anchors : (V,) int32
        Vertex of the body that each vertex of the surface corresponds to (Eq. 19).
    parts : (V,) int8
        Body part of each vertex of the surface.
    """

    surface: Surface
    body: Body
    weights: FloatArray
    bones: IntArray
    anchors: IntArray
    parts: IntArray

    def __post_init__(self) -> None:
        sizes = {
            "V": len(self.surface.vertices),
            "bones": len(self.body.bone_names),
            "body": len(self.body.vertices),
        }
        self._check("weights", ("V", 4), sizes)
        self._check("bones", ("V", 4), sizes, below="bones")
        self._check("anchors", ("V",), sizes, below="body")
        self._check("parts", ("V",), sizes)


@dataclass(frozen=True, kw_only=True)
class RenderSettings(Record):
    """How frames are rendered.

    Attributes
    ----------
    size : int
        Length of the longer side of a view, pixels.
    aspect : str
        Width to height, such as "16:9"; from 1:4 to 4:1. The whole body fits into it.
    titles : bool
        Whether the views' names are above their pictures when these are side by side.
    spp : int
        Samples per pixel before denoising.
    views : tuple of str
        `VIEWS`, "turntable", or names of custom cameras (`a2v.rendering.CameraPath`).
    background : str
        "stage": ground and backdrop. Otherwise the person with its shadow on the color "#rrggbb",
        on a picture ("image", which is given separately) or on nothing ("transparent": frames have
        an alpha channel).
    denoise : bool
        Whether Open Image Denoise is applied to every frame.
    variant : str
        Mitsuba variant, or "auto": `llvm_ad_rgb` if LLVM works, else `scalar_rgb`.
    threads : int
        Threads of one render process; 0 for all cores.
    seed : int
    follow : bool
        True: the cameras of `VIEWS` follow the character. False: they stand still and show its
        whole path.
    """

    size: int = 512
    aspect: str = "1:1"
    titles: bool = False
    spp: int = 8
    views: tuple[str, ...] = VIEWS
    background: str = "stage"
    denoise: bool = True
    variant: str = "auto"
    threads: int = 0
    seed: int = 0
    follow: bool = True

    def __post_init__(self) -> None:
        if not 16 <= self.size <= 4096 or self.size % 2:
            raise InputError(
                f"size is {self.size}; expected an even number of pixels from 16 to 4096"
            )
        if not re.fullmatch(r"[1-9]\d{0,3}:[1-9]\d{0,3}", self.aspect) or not self._is_moderate:
            raise InputError(
                f"aspect is '{self.aspect}'; expected width:height from 1:4 to 4:1, such as 9:16"
            )
        if not 1 <= self.spp <= 65536:
            raise InputError(f"spp is {self.spp}; expected 1 to 65536 samples per pixel")
        if odd := [view for view in self.views if not re.fullmatch(NAME_PATTERN, view)]:
            raise InputError(
                f"'{odd[0]}' cannot be the name of a view; expected letters, digits, - and _, "
                "since files get this name"
            )
        if not 0 <= self.seed < 2**32:
            raise InputError(f"the renderer's seed is {self.seed}; expected 0 to {2**32 - 1}")
        if not self.views:
            raise InputError(f"no view given; choose from {', '.join(VIEWS)}")
        if doubles := [view for view in self.views if self.views.count(view) > 1]:
            raise InputError(f"view '{doubles[0]}' is given twice")
        if not re.fullmatch(r"stage|transparent|image|#[0-9a-f]{6}", self.background):
            raise InputError(
                f"background is '{self.background}'; expected stage, transparent, image or a color "
                "such as #30506f"
            )

    @property
    def _is_moderate(self) -> bool:
        width, height = map(int, self.aspect.split(":"))
        return max(width, height) <= 4 * min(width, height)

    @property
    def shape(self) -> tuple[int, int]:
        """Width and height of a view, pixels; even, as videos need."""
        width, height = map(int, self.aspect.split(":"))
        short = max(2, 2 * round(self.size * min(width, height) / max(width, height) / 2))
        return (self.size, short) if width >= height else (short, self.size)

    @property
    def window(self) -> tuple[slice, slice]:
        """Rows and columns of a view within the square of `size` pixels that its camera covers."""
        width, height = self.shape
        left, top = (self.size - width) // 2, (self.size - height) // 2
        return slice(top, top + height), slice(left, left + width)
