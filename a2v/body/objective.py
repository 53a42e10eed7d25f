"""What a fit minimises: every term in units of squared standard deviations, so that the weights are plain numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from a2v.body.anny import AnnyModel
from a2v.body.collision import LimbBalls
from a2v.body.landmarks import BLAZEPOSE
from a2v.body.pose_prior import load_pose_prior
from a2v.body.pose_space import PoseSpace, pose_space
from a2v.body.silhouette import MaskField, rasterize, rim_vertices
from a2v.body.skinning import BodyState
from a2v.kinematics import best_scale
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera

if TYPE_CHECKING:
    import torch

    from a2v.body.fit import FitSettings
    from a2v.body.surface_term import SurfaceSamples

Stage = Literal["depth", "camera", "joints", "silhouette", "surface_joints", "surface"]

# How far to trust each landmark: the face and the hands have many, and where they lie on a body is less certain.
_TRUST = {
    **dict.fromkeys(BLAZEPOSE, 0.4),
    "nose": 0.7,
    **{
        f"{side}_{joint}": value
        for side in ("left", "right")
        for joint, value in {
            "ear": 0.7, "shoulder": 1.0, "elbow": 1.0, "wrist": 1.0, "pinky": 0.3, "index": 0.3, "thumb": 0.2, "hip": 0.7, "knee": 1.0,
            "ankle": 1.0, "heel": 0.5, "foot_index": 0.6,
        }.items()
    },
}  # fmt: skip

_SEGMENTS = [
    *((f"{side}_{first}", f"{side}_{last}") for side in ("left", "right") for first, last in (
        ("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"), ("shoulder", "hip"), ("heel", "foot_index"),
    )),
    ("left_shoulder", "right_shoulder"), ("left_hip", "right_hip"), ("left_ear", "right_ear"),
    ("left_ear", "nose"), ("right_ear", "nose"),
]  # fmt: skip


def geman_mcclure(square: torch.Tensor, scale: float) -> torch.Tensor:
    """ρ of Eq. 16 (Geman and McClure 1987) of squared residuals: like the square below `scale`, level above."""
    return scale**2 * square / (scale**2 + square)


@dataclass(eq=False)
class Unknowns:
    """The parameters of a fit; float64 leaf tensors.

    Attributes
    ----------
    base : (3, 3)
        Orientation that `root` is relative to (constant).
    root : (3,)
        Rotation vector of the whole body.
    angles : (D,)
        See `PoseSpace`.
    shape : (S,)
    translation : (3,)
        Metres.
    log_scale : ()
        Logarithm of the camera's scale.
    center : tuple of 2 float
        The camera's centre; constant, since the translation does the same.
    """

    base: torch.Tensor
    root: torch.Tensor
    angles: torch.Tensor
    shape: torch.Tensor
    translation: torch.Tensor
    log_scale: torch.Tensor
    center: tuple[float, float]

    @classmethod
    def build(
        cls,
        model: AnnyModel,
        *,
        root: FloatArray,
        angles: FloatArray,
        shape: FloatArray,
        translation: FloatArray,
        camera: OrthographicCamera,
    ) -> Unknowns:
        """From plain numbers; `root` is a rotation vector (3,)."""
        import torch

        from a2v.kinematics.so3 import rotvec_to_rotmat

        def leaf(values: Any) -> torch.Tensor:
            return torch.tensor(np.asarray(values, dtype=np.float64)).requires_grad_()

        return cls(
            base=torch.tensor(rotvec_to_rotmat(np.asarray(root, dtype=np.float64))),
            root=leaf(np.zeros(3)),
            angles=leaf(angles),
            shape=leaf(shape),
            translation=leaf(translation),
            log_scale=leaf(np.log(camera.scale)),
            center=(camera.center_u, camera.center_v),
        )

    def rotmats(self, space: PoseSpace) -> torch.Tensor:
        """Rotation matrices (B, 3, 3) of the bones."""
        import torch

        from a2v.kinematics.so3 import rotvec_to_rotmat

        local = rotvec_to_rotmat(space.rotvecs(self.angles))
        first = rotvec_to_rotmat(self.root) @ self.base
        return torch.cat([first[None], local[1:]])

    def root_rotvec(self) -> FloatArray:
        """Orientation of the whole body as one rotation vector (3,)."""
        from a2v.kinematics.so3 import rotmat_to_rotvec, rotvec_to_rotmat

        result: FloatArray = rotmat_to_rotvec((rotvec_to_rotmat(self.root.detach()) @ self.base).numpy())
        return result

    def camera(self) -> OrthographicCamera:
        """The camera as a record."""
        return OrthographicCamera(scale=float(self.log_scale.detach().exp()), center_u=self.center[0], center_v=self.center[1])

    def fix_camera(self, camera: OrthographicCamera) -> None:
        """Take over a camera for good."""
        import torch

        self.log_scale = torch.tensor(np.log(camera.scale), dtype=torch.float64)
        self.center = (camera.center_u, camera.center_v)

    def project(self, points: torch.Tensor) -> torch.Tensor:
        """Pixels (..., 2) of points (..., 3)."""
        import torch

        scale = self.log_scale.exp()
        return torch.stack([self.center[0] + scale * points[..., 0], self.center[1] - scale * points[..., 1]], dim=-1)


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the photo says.

    Attributes
    ----------
    pixels : (33, 2), confidence : (33,)
    depth : (n,)
        Depth differences along `segments`, in pixels of the photo (detector's metres times its scale).
    segments : (n, 2) int
    depth_confidence : (n,)
    points : (33, 3) or None
        The detector's 3D keypoints, metres; NaN where unknown.
    points_scale : float
        Pixels per metre of `points`.
    height : float
        Rough standing height of the person, pixels.
    straight : tuple of bool
        Whether the left and the right leg look straight.
    standing : tuple of bool
        Whether they also look upright, as a leg that carries weight.
    mask : MaskField or None
    """

    pixels: FloatArray
    confidence: FloatArray
    depth: FloatArray
    segments: IntArray
    depth_confidence: FloatArray
    points: FloatArray | None
    points_scale: float
    height: float
    straight: tuple[bool, bool]
    standing: tuple[bool, bool]
    mask: MaskField | None

    @property
    def has_depth(self) -> bool:
        """Whether any 3D keypoints are known."""
        return self.points is not None

    @property
    def mask_known(self) -> BoolArray:
        """Pixels (h, w) of the working raster that the photo covers."""
        assert self.mask is not None
        height, width = self.mask.inside.shape
        u, v = np.meshgrid((np.arange(width) + 0.5) * self.mask.step, (np.arange(height) + 0.5) * self.mask.step)
        left, top, right, bottom = self.mask.known
        inside: BoolArray = (u > left) & (u < right) & (v > top) & (v < bottom)
        return inside

    @classmethod
    def build(cls, pixels: FloatArray, confidence: FloatArray, points: FloatArray, mask: MaskField | None) -> Evidence:
        """From keypoints (33, 2) with confidence (33,), 3D keypoints (33, 3) and the mask."""
        names = {name: index for index, name in enumerate(BLAZEPOSE)}
        known = np.isfinite(points).all(axis=1) & (confidence > 0.2)
        scale = 0.0
        if known.sum() >= 8:
            weight = np.where(known, confidence, 0.0)
            flat = np.where(known[:, None], points[:, :2] * [1.0, -1.0], 0.0)
            scale = best_scale(flat, pixels, weight)
        usable = scale > 1.0
        segments = np.array([[names[first], names[last]] for first, last in _SEGMENTS])
        difference = points[segments[:, 1], 2] - points[segments[:, 0], 2]
        depth_known = known[segments].all(axis=1) & usable
        seen = pixels[confidence > 0.3]
        height = 1.7 * scale if usable else _height_without_depth(pixels, confidence, names, seen)
        straight, standing = zip(*(_leg(side, names, pixels, confidence, points, usable) for side in ("left", "right")), strict=True)
        return cls(
            pixels=pixels,
            confidence=confidence,
            depth=np.where(depth_known, difference, 0.0) * scale,
            segments=segments,
            depth_confidence=np.where(depth_known, confidence[segments].min(axis=1), 0.0),
            points=points if usable else None,
            points_scale=scale,
            height=height,
            straight=(bool(straight[0]), bool(straight[1])),
            standing=(bool(standing[0]), bool(standing[1])),
            mask=mask,
        )


def _height_without_depth(pixels: FloatArray, confidence: FloatArray, names: dict[str, int], seen: FloatArray) -> float:
    """Standing height, pixels, from the longest limbs seen (a projection can only shorten them)."""
    ratios = {
        ("hip", "knee"): 0.23,
        ("knee", "ankle"): 0.24,
        ("shoulder", "hip"): 0.28,
        ("shoulder", "elbow"): 0.16,
        ("elbow", "wrist"): 0.14,
    }
    estimates = []
    for (first, last), ratio in ratios.items():
        for side in ("left", "right"):
            a, b = names[f"{side}_{first}"], names[f"{side}_{last}"]
            if min(confidence[a], confidence[b]) > 0.3:
                estimates.append(np.linalg.norm(pixels[a] - pixels[b]) / ratio)
    if len(estimates) >= 2:
        return float(np.percentile(estimates, 75))
    return float(1.1 * np.ptp(seen[:, 1]) + 1.0)


def _leg(
    side: str, names: dict[str, int], pixels: FloatArray, confidence: FloatArray, points: FloatArray, usable: bool
) -> tuple[bool, bool]:
    """Whether a leg looks straight, and upright too."""
    hip, knee, ankle, shoulder = (names[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle", "shoulder"))
    if min(confidence[[hip, knee, ankle]]) < 0.3:
        return False, False

    def bend(positions: FloatArray) -> float:
        upper, lower = positions[knee] - positions[hip], positions[ankle] - positions[knee]
        cosine = upper @ lower / max(np.linalg.norm(upper) * np.linalg.norm(lower), 1e-9)
        return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))

    leg = pixels[ankle] - pixels[hip]
    straight = bend(pixels) < 15.0
    if usable and np.isfinite(points[[hip, knee, ankle]]).all():
        straight &= bend(points) < 35.0  # detectors bend straight legs by some twenty degrees
    if confidence[shoulder] > 0.3:  # a leg that points at the camera is short beside the trunk
        straight &= bool(np.linalg.norm(leg) > 1.15 * np.linalg.norm(pixels[hip] - pixels[shoulder]))
    upright = abs(leg[0]) < 0.3 * leg[1]
    return bool(straight), bool(straight and upright)


class Objective:
    """The sum of the terms, and its minimisation with L-BFGS."""

    def __init__(self, model: AnnyModel, evidence: Evidence, settings: FitSettings, *, surface: SurfaceSamples | None = None):
        import torch

        self.model, self.evidence, self.settings, self.surface = model, evidence, settings, surface
        self.space = pose_space(model)
        self.balls = _balls(model)

        def tensor(values: Any) -> torch.Tensor:
            return torch.tensor(np.asarray(values, dtype=np.float64))

        self._pixels = tensor(evidence.pixels)
        self._weights = tensor(evidence.confidence * [_TRUST[name] for name in BLAZEPOSE])
        self._depth, self._depth_weights = tensor(evidence.depth), tensor(evidence.depth_confidence)
        self._natural, self._spread, self._limits = tensor(self.space.natural), tensor(self.space.spread), tensor(self.space.limits)
        self._shape_mean, self._shape_bounds = tensor(model.shape_default), tensor(model.shape_bounds)
        # clothes hide the chest: a photo's silhouette says too little for it, and what it would add shows on men
        photo_only = surface is None
        if photo_only:
            self._shape_mean[model.shape_names.index("gender")] = 0.35
        deviations = {"gender": 0.2 if photo_only else 0.4, "age": 0.05, "muscle": 0.25, "weight": 0.2, "height": 0.05, "proportions": 0.25}
        self._shape_spread = tensor([deviations.get(name, 0.5 if "circ" in name else 0.4) for name in model.shape_names])
        if evidence.points is not None:
            known = np.isfinite(evidence.points).all(axis=1)
            self._points = tensor(np.where(known[:, None], evidence.points, 0.0))
            self._points_weights = tensor(np.where(known, evidence.confidence * [_TRUST[name] for name in BLAZEPOSE], 0.0))
        self._prior = load_pose_prior()
        self._index = {name: index for index, name in enumerate(BLAZEPOSE)}
        self._inner = self._sample_vertices(700)
        rest = model.rest(torch.from_numpy(model.shape_default))[0]
        self._extent = torch.stack([rest[:, 1].argmax(), rest[:, 1].argmin()])
        self._rim: tuple[torch.Tensor, torch.Tensor, torch.Tensor] | None = None

    def _sample_vertices(self, count: int) -> torch.Tensor:
        """Vertices spread evenly over the skin."""
        import torch

        rest = self.model.rest(torch.from_numpy(self.model.shape_default))[0].numpy()
        corner = rest[self.model.faces]
        area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
        weight = np.zeros(len(rest))
        for index in range(3):
            np.add.at(weight, self.model.faces[:, index], area)
        rng = np.random.default_rng(self.settings.seed)
        return torch.from_numpy(np.sort(rng.choice(len(rest), size=count, replace=False, p=weight / weight.sum())))

    def _state(self, unknowns: Unknowns, stage: str) -> tuple[BodyState, torch.Tensor, dict[str, torch.Tensor]]:
        """Pose the vertices that a stage needs; returns the state, the landmarks and the vertices by use."""
        import torch

        wanted = {"extent": self._extent, "landmarks": self.model.landmark_vertices}
        if stage == "silhouette" and self.evidence.mask is not None:
            wanted["inner"] = self._inner
            if self._rim is not None:
                wanted["rim"] = self._rim[0]
        if stage == "surface" and self.surface is not None and self.surface.matched:
            wanted["surface"] = self.surface.vertex_ids
        state = self.model.forward(
            unknowns.rotmats(self.space), unknowns.shape, unknowns.translation, vertex_ids=torch.cat(list(wanted.values()))
        )
        parts = dict(zip(wanted, torch.split(state.vertices, [len(ids) for ids in wanted.values()]), strict=True))
        return state, self.model.landmarks_of(parts["landmarks"], state.joints), parts

    def terms(self, unknowns: Unknowns, stage: str) -> dict[str, torch.Tensor]:
        """The weighted terms of the objective at a stage."""
        import torch

        s, e = self.settings, self.evidence
        state, landmarks, vertices = self._state(unknowns, stage)
        scale = unknowns.log_scale.exp()
        terms: dict[str, torch.Tensor] = {}
        surface_stage = stage.startswith("surface")
        if stage == "depth":
            # Only the form: the detector's skeleton, moved and scaled onto ours.
            factor = e.points_scale / scale
            difference = landmarks - factor * self._points
            center = (self._points_weights[:, None] * difference).sum(0) / self._points_weights.sum()
            square = (difference - center).square().sum(-1)
            terms["points"] = (self._points_weights * geman_mcclure(square, 0.2)).sum() / 0.05**2
        else:
            square = (unknowns.project(landmarks) - self._pixels).square().sum(-1) / e.height**2
            robust = 10.0 if stage == "camera" else s.keypoint_robust
            weight = s.joints_weight if surface_stage else 1.0
            terms["keypoints"] = weight * (self._weights * geman_mcclure(square, robust)).sum() / s.keypoint_sigma**2
            if stage == "silhouette":  # no single landmark may stray, but where the detector is plainly wrong
                over = (square.clamp_min(1e-12).sqrt() - 0.022).clamp_min(0.0)
                terms["strays"] = (self._weights.sqrt() * geman_mcclure(over.square(), 0.03)).sum() / 0.003**2
            first, last = e.segments[:, 0], e.segments[:, 1]
            along = (landmarks[last, 2] - landmarks[first, 2]) * scale
            square = (along - self._depth).square() / e.height**2
            weight = s.depth_weight * (0.1 if surface_stage else 1.0)  # a surface knows better than the detector
            terms["depth"] = weight * (self._depth_weights * geman_mcclure(square, 3.0 * s.depth_sigma)).sum() / s.depth_sigma**2
        if surface_stage:  # Eq. 18; zero at the likeliest pose
            terms["pose"] = 2.0 * s.prior_weight * (self._prior.best - self._prior.log_likelihood(unknowns.angles))
        else:
            terms["pose"] = s.pose_weight * ((unknowns.angles - self._natural) / self._spread).square().sum()
        low, high = self._limits.unbind(-1)
        beyond = (low - unknowns.angles).clamp(min=0) + (unknowns.angles - high).clamp(min=0)
        terms["limits"] = (beyond / 0.03).square().sum()
        crown, sole = state.rest_vertices[0], state.rest_vertices[1]  # "extent" comes first
        height = ((crown[1] - sole[1] - s.height) / s.height_sigma).square()
        terms["shape"] = s.shape_weight * (((unknowns.shape - self._shape_mean) / self._shape_spread).square().sum() + height)
        low, high = self._shape_bounds.unbind(-1)
        beyond = (low - unknowns.shape).clamp(min=0) + (unknowns.shape - high).clamp(min=0)
        terms["bounds"] = (beyond / 0.02).square().sum()
        if stage not in ("depth", "camera"):
            terms["collision"] = s.collision_weight * (self.balls.penetration(state) / 0.01).square().sum()
            terms["feet"] = s.feet_weight * self._feet(unknowns, landmarks)
        if stage == "silhouette" and e.mask is not None:
            terms["silhouette"] = s.silhouette_weight * self._silhouette(unknowns, vertices)
        if surface_stage and self.surface is not None:
            terms["joints_3d"] = s.joints_weight * self.surface.joints(landmarks)
            if "surface" in vertices:
                terms["surface"] = s.surface_weight * self.surface.distance(vertices["surface"], s.surface_robust)
        return {name: torch.as_tensor(value) for name, value in terms.items()}

    def _feet(self, unknowns: Unknowns, landmarks: torch.Tensor) -> torch.Tensor:
        """Straight legs stay straight and upright in depth, and feet that stand are nearly level."""
        total = 0.0 * unknowns.angles.sum()
        middle = {
            joint: (landmarks[self._index[f"left_{joint}"]] + landmarks[self._index[f"right_{joint}"]]) / 2 for joint in ("hip", "shoulder")
        }
        if all(self.evidence.standing):  # the trunk rests on the legs
            total = total + ((middle["shoulder"][2] - middle["hip"][2] + 0.01) / 0.03).square()
        for side, straight, standing in zip(("left", "right"), self.evidence.straight, self.evidence.standing, strict=True):
            point = {name: landmarks[self._index[f"{side}_{name}"]] for name in ("hip", "ankle", "heel", "foot_index")}
            if straight:
                total = total + (unknowns.angles[self.space.index(f"{side}_knee_bend")] / 0.08).square()
            if standing:
                total = total + ((point["hip"][2] - point["ankle"][2]) / 0.025).square()
                # A camera at eye level looks down on the feet: they may seem to point down a little.
                total = total + ((point["heel"][1] - point["foot_index"][1]) / 0.06).square()
        return total

    def _silhouette(self, unknowns: Unknowns, vertices: dict[str, torch.Tensor]) -> torch.Tensor:
        s, mask = self.settings, self.evidence.mask
        assert mask is not None
        outside = mask.sample(unknowns.project(vertices["inner"])).clamp(min=0) / self.evidence.height
        # Neighbouring points say the same thing: the sums count as some ninety independent measurements.
        loss = 90.0 * geman_mcclure(outside.square(), 2 * s.silhouette_robust).mean() / s.silhouette_sigma**2
        if self._rim is not None:
            _, targets, normals = self._rim
            gap = (unknowns.project(vertices["rim"]) - targets) / self.evidence.height
            across = (gap * normals).sum(-1).square()
            along = gap.square().sum(-1) - across
            loss = loss + 90.0 * geman_mcclure(across + 0.1 * along, s.silhouette_robust).mean() / s.silhouette_sigma**2
        return loss

    def renew_silhouette(self, unknowns: Unknowns) -> None:
        """Match points of the mask's contour to the rim of the body as it is now."""
        import torch
        from scipy.spatial import cKDTree

        mask = self.evidence.mask
        assert mask is not None
        with torch.no_grad():
            state = self.model.forward(unknowns.rotmats(self.space).float(), unknowns.shape.float(), unknowns.translation.float())
        camera = unknowns.camera()
        vertices = state.vertices.numpy()
        raster = rasterize(vertices, self.model.faces, camera, mask.inside.shape, step=mask.step)["mask"]
        ids, pixels, normals = rim_vertices(vertices, self.model.faces, camera, raster, mask.step)
        self._rim = None
        if len(ids) < 10:
            return
        every = max(1, len(mask.contour) // 350)
        contour, outward = mask.contour[::every], mask.normals[::every]
        # Direction counts as much as place: a contour that faces left belongs to a left rim.
        reach = 0.06 * self.evidence.height
        tree = cKDTree(np.concatenate([pixels, reach * normals], axis=1))
        nearest = np.asarray(tree.query(np.concatenate([contour, reach * outward], axis=1))[1])
        good = (normals[nearest] * outward).sum(axis=1) > 0.3
        good &= np.linalg.norm(pixels[nearest] - contour, axis=1) < 0.12 * self.evidence.height
        if good.sum() >= 10:
            self._rim = (
                torch.from_numpy(ids[nearest[good]]),
                torch.from_numpy(contour[good].astype(np.float64)),
                torch.from_numpy(outward[good].astype(np.float64)),
            )

    def renew_surface(self, unknowns: Unknowns) -> None:
        """Match the samples of the surface to the body as it is now."""
        import torch

        assert self.surface is not None
        with torch.no_grad():
            state = self.model.forward(unknowns.rotmats(self.space).float(), unknowns.shape.float(), unknowns.translation.float())
        self.surface.match(state.vertices.numpy(), self.model)

    def minimize(self, unknowns: Unknowns, steps: int, *, stage: Stage) -> float:
        """Lower the objective by at most `steps` iterations of L-BFGS; returns its value."""
        import torch

        free = [unknowns.root, unknowns.translation]
        if unknowns.log_scale.requires_grad and stage != "depth":
            free.append(unknowns.log_scale)
        if stage != "camera":
            free.append(unknowns.angles)
        if stage not in ("depth", "camera"):
            free.append(unknowns.shape)
        optimizer = torch.optim.LBFGS(free, max_iter=steps, history_size=20, tolerance_change=1e-7, line_search_fn="strong_wolfe")

        def closure() -> torch.Tensor:
            optimizer.zero_grad()
            terms = self.terms(unknowns, stage)
            loss = torch.stack(list(terms.values())).sum()
            loss.backward()  # type: ignore[no-untyped-call]
            return loss

        optimizer.step(closure)  # type: ignore[no-untyped-call]
        with torch.no_grad():
            return float(sum(self.terms(unknowns, stage).values()))


def _balls(model: AnnyModel) -> LimbBalls:
    """The model's balls, measured once."""
    balls = getattr(model, "_limb_balls", None)
    if balls is None:
        balls = LimbBalls(model)
        model._limb_balls = balls  # type: ignore[attr-defined]
    assert isinstance(balls, LimbBalls)
    return balls
