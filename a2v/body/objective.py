"""The objective of a fit at each stage: its terms and their weights."""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from a2v.body import terms as term
from a2v.body.anny import AnnyModel
from a2v.body.collision import limb_balls
from a2v.body.evidence import Evidence
from a2v.body.lbfgs import GRADIENT, Metric, metric_of, minimize
from a2v.body.pose_prior import load_pose_prior
from a2v.body.pose_space import pose_space
from a2v.body.settings import FitSettings
from a2v.body.shape_prior import shape_prior
from a2v.body.silhouette import RimMatches, match_rim
from a2v.body.skin import spread_vertices
from a2v.body.skinning import BodyState
from a2v.body.surface_term import SurfaceMatches, SurfaceSamples, match_surface
from a2v.body.unknowns import Unknowns
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.kinematics.so3 import rotvec_to_rotmat
from a2v.types import FloatArray, IntArray

if TYPE_CHECKING:
    from torch import Tensor

Stage = Literal["depth", "camera", "joints", "silhouette", "surface_joints", "surface"]

_SOLES = [
    LANDMARK_INDEX[f"{side}_{place}"]
    for side in ("left", "right")
    for place in ("heel", "foot_index")
]


class Objective:
    """The sum of the terms, and its minimization with L-BFGS."""

    def __init__(
        self,
        model: AnnyModel,
        evidence: Evidence,
        settings: FitSettings,
        *,
        surface: SurfaceSamples | None = None,
    ):
        """Make the papers' objective (Eq. 15) if `surface` is given, else that of a photo alone."""
        import torch

        self.model, self.surface = model.rounded(), surface
        self.evidence, self.settings = evidence, settings
        self.space = pose_space(model)
        self.balls = limb_balls(model)
        self._pixels, self._weights = _tensor(evidence.pixels), _tensor(evidence.weights)
        self._depth, self._depth_weights = (
            _tensor(evidence.depth),
            _tensor(evidence.depth_confidence),
        )
        self._natural, self._spread, self._limits = (
            _tensor(self.space.natural),
            _tensor(self.space.spread),
            _tensor(self.space.limits),
        )
        mean, spread = shape_prior(model, of_photo=surface is None)
        self._shape_mean, self._shape_spread = _tensor(mean), _tensor(spread)
        self._shape_bounds = _tensor(model.shape_bounds)
        if evidence.points is not None:
            known = np.isfinite(evidence.points).all(axis=1)
            self._points = _tensor(np.where(known[:, None], evidence.points, 0.0))
            self._points_weights = _tensor(np.where(known, evidence.weights, 0.0))
        if (dense := evidence.dense) is not None:
            self._map = {
                item.name: torch.from_numpy(getattr(dense, item.name))
                for item in dataclasses.fields(dense)
            }
        self._prior = load_pose_prior()
        rest = model.rest(torch.from_numpy(model.shape_default))[0]
        self._inner = torch.from_numpy(
            spread_vertices(rest.numpy(), model.faces, 700, seed=settings.seed)
        )
        self._extent = torch.stack([rest[:, 1].argmax(), rest[:, 1].argmin()])
        self._rim: RimMatches | None = None
        self._matches: SurfaceMatches | None = None

    def _state(
        self, unknowns: Unknowns, stage: Stage
    ) -> tuple[BodyState, Tensor, dict[str, Tensor]]:
        """Pose the vertices that a stage needs; returns the state, the landmarks and the vertices
        by use."""
        import torch

        wanted = {"extent": self._extent, "landmarks": self.model.landmark_vertices}
        if stage in ("joints", "silhouette") and self.evidence.dense is not None:
            wanted["dense"] = self._map["vertex_ids"]
        if stage == "silhouette" and self.evidence.mask is not None:
            wanted["inner"] = self._inner
            if self._rim is not None:
                wanted["rim"] = self._rim.vertex_ids
        if stage == "surface" and self._matches is not None:
            wanted["surface"] = self._matches.vertex_ids
        state = self.model.forward(
            unknowns.rotmats(self.space),
            unknowns.shape,
            unknowns.translation,
            vertex_ids=torch.cat(list(wanted.values())),
        )
        parts = dict(
            zip(
                wanted,
                torch.split(state.vertices, [len(ids) for ids in wanted.values()]),
                strict=True,
            )
        )
        return state, self.model.landmarks_of(parts["landmarks"], state.joints), parts

    def terms(self, unknowns: Unknowns, stage: Stage) -> dict[str, Tensor]:
        """The weighted terms of the objective at a stage."""
        s, e = self.settings, self.evidence
        state, landmarks, vertices = self._state(unknowns, stage)
        scale = unknowns.log_scale.exp()
        if stage == "depth":
            points = self.evidence.points_scale / scale * self._points
            terms = {"points": term.form(landmarks, points, weights=self._points_weights)}
        else:
            terms = self._seen(unknowns, landmarks, scale, stage)
        if self.surface is not None:
            terms["pose"] = 2.0 * s.prior_weight * term.likely_pose(unknowns.angles, self._prior)
        else:
            terms["pose"] = s.pose_weight * term.everyday_pose(
                unknowns.angles, natural=self._natural, spread=self._spread
            )
        terms["limits"] = term.outside(unknowns.angles, self._limits, tolerance=0.03)
        terms["shape"] = s.shape_weight * term.build_of_body(
            unknowns.shape,
            mean=self._shape_mean,
            spread=self._shape_spread,
            state=state,
            height=s.height,
            height_sigma=s.height_sigma,
        )
        terms["bounds"] = term.outside(unknowns.shape, self._shape_bounds, tolerance=0.02)
        if unknowns.pitch.requires_grad and unknowns.view.distance > 0:
            terms["camera"] = term.held_camera(
                unknowns.camera_height(term.lowest(landmarks[_SOLES, 1]))
            )
            if e.distance_spread > 0:
                terms["distance"] = s.distance_weight * term.usual_distance(
                    unknowns.log_distance, estimate=e.view.distance, spread=e.distance_spread
                )
        if stage not in ("depth", "camera"):
            terms["collision"] = s.collision_weight * term.collision(self.balls, state)
            terms["feet"] = s.feet_weight * term.feet(
                unknowns.angles, landmarks, space=self.space, evidence=self.evidence
            )
        if "dense" in vertices:
            terms |= self._dense(unknowns, vertices["dense"], scale)
        if "inner" in vertices:
            terms["silhouette"] = s.silhouette_weight * self._silhouette(unknowns, vertices)
        if self.surface is not None:
            targets, weights = _tensor(self.surface.targets), _tensor(self.surface.target_weights)
            terms["joints_3d"] = s.joints_weight * term.joints_inside(
                landmarks, targets, weights=weights
            )
            if self._matches is not None and "surface" in vertices:
                terms["surface"] = s.surface_weight * term.surface_distance(
                    vertices["surface"], self._matches, robust=s.surface_robust
                )
        return terms

    def values(self, unknowns: Unknowns, stage: Stage) -> dict[str, float]:
        """The weighted terms as plain numbers."""
        import torch

        with torch.no_grad():
            return {name: float(value) for name, value in self.terms(unknowns, stage).items()}

    def cost(self, unknowns: Unknowns, stage: Stage) -> float:
        """The sum of the terms as a plain number."""
        return sum(self.values(unknowns, stage).values())

    def landmark_gaps(self, unknowns: Unknowns) -> FloatArray:
        """Distances (33,) of the landmarks in the picture from the photo's, relative to the
        height."""
        import torch

        with torch.no_grad():
            gaps = unknowns.project(self._state(unknowns, "camera")[1]) - self._pixels
            found: FloatArray = gaps.norm(dim=-1).numpy() / self.evidence.height
        return found

    def of_poses(self, unknowns: Unknowns, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Evaluate many poses (N, D); the other unknowns are those of `unknowns`.

        Returns the cost (N,) of the terms of landmarks and angles, and the landmarks (N, 33, 3),
        meters.
        """
        import torch

        with torch.no_grad():
            poses = torch.from_numpy(angles)
            rotmats = rotvec_to_rotmat(self.space.rotvecs(poses))
            rotmats[:, 0] = unknowns.rotmats(self.space)[0].to(rotmats)
            rest, heads = self.model.rest(unknowns.shape.float(), self.model.landmark_vertices)
            landmarks = (
                self.model.landmarks_at(rotmats, rest, heads).double() + unknowns.translation
            )
            terms = self._seen(unknowns, landmarks, unknowns.log_scale.exp(), "silhouette")
            terms["pose"] = self.settings.pose_weight * term.everyday_pose(
                poses, natural=self._natural, spread=self._spread
            )
            terms["limits"] = term.outside(poses, self._limits, tolerance=0.03)
            return torch.stack(list(terms.values())).sum(0).numpy(), landmarks.numpy()

    def _seen(
        self, unknowns: Unknowns, landmarks: Tensor, scale: Tensor, stage: Stage
    ) -> dict[str, Tensor]:
        """The terms of the keypoints, in the photo and along the limbs; `scale` () is the
        camera's."""
        s, e = self.settings, self.evidence
        square = (unknowns.project(landmarks) - self._pixels).square().sum(-1) / e.height**2
        # at first no landmark counts as an outlier
        robust = 10.0 if stage == "camera" else s.keypoint_robust
        weight = 1.0 if self.surface is None else s.joints_weight
        seen = square
        terms = {
            "keypoints": weight
            * term.robust_sum(square, weights=self._weights, scale=robust)
            / s.keypoint_sigma**2
        }
        if stage == "silhouette":
            terms["strays"] = term.strays(square, weights=self._weights)
        first, last = e.segments[:, 0], e.segments[:, 1]
        along = (landmarks[..., last, 2] - landmarks[..., first, 2]) * scale
        square = (along - self._depth).square() / e.height**2
        weight = s.depth_weight * (
            1.0 if self.surface is None else 0.1
        )  # a surface is more precise than the detector
        terms["depth"] = (
            weight
            * term.robust_sum(square, weights=self._depth_weights, scale=3.0 * s.depth_sigma)
            / s.depth_sigma**2
        )
        if e.hints is not None and stage != "camera":
            near, far = e.hints.bones[:, 0], e.hints.bones[:, 1]
            along = (landmarks[..., far, 2] - landmarks[..., near, 2]) * scale / e.height
            terms["given_places"] = term.at_given_places(seen[..., e.hints.landmarks])
            terms["given_sides"] = term.on_given_sides(
                along, signs=_tensor(e.hints.signs), depths=_tensor(e.hints.depths)
            )
        return terms

    def _dense(self, unknowns: Unknowns, vertices: Tensor, scale: Tensor) -> dict[str, Tensor]:
        """Return the terms of the body map's pixels for the `vertices` (m, 3) around their places;
        `scale` () is the camera's."""
        s, height, found = self.settings, self.evidence.height, self._map
        vertices = (found["shares"][..., None] * vertices[found["chosen"]]).sum(-2)
        pixels, depths = unknowns.project(vertices), scale * vertices[:, 2]
        seen = term.seen_at(pixels, found["pixels"], weights=found["weights"], height=height)
        weights = found["depth_weights"]
        deep = term.depths_agree(depths, found["depths"], weights=weights, height=height)
        return {"dense": s.dense_weight * seen, "dense_depth": s.dense_depth_weight * deep}

    def _silhouette(self, unknowns: Unknowns, vertices: dict[str, Tensor]) -> Tensor:
        s, mask, height = self.settings, self.evidence.mask, self.evidence.height
        assert mask is not None
        inner = unknowns.project(vertices["inner"])
        loss = term.skin_in_mask(
            inner, mask, height=height, robust=s.silhouette_robust, sigma=s.silhouette_sigma
        )
        if self._rim is not None:
            rim = unknowns.project(vertices["rim"])
            loss = loss + term.rim_on_contour(
                rim, self._rim, height=height, robust=s.silhouette_robust, sigma=s.silhouette_sigma
            )
        return loss

    def _skin(self, unknowns: Unknowns) -> FloatArray:
        """Current vertices (V, 3) float32."""
        import torch

        with torch.no_grad():
            state = self.model.forward(
                unknowns.rotmats(self.space).float(),
                unknowns.shape.float(),
                unknowns.translation.float(),
            )
        vertices: FloatArray = state.vertices.numpy()
        return vertices

    def renew(self, unknowns: Unknowns, stage: Stage) -> None:
        """Update the correspondences of a stage."""
        if stage == "silhouette":
            self.renew_silhouette(unknowns)
        else:
            self.renew_surface(unknowns)

    def renew_silhouette(self, unknowns: Unknowns) -> None:
        """Match points of the mask's contour, if there is a mask, to the rim of the current
        body."""
        mask = self.evidence.mask
        if mask is None or not len(mask.contour):
            return
        camera = unknowns.camera()
        self._rim = match_rim(
            mask,
            camera.flatten(self._skin(unknowns)),
            self.model.faces,
            camera.flat,
            height=self.evidence.height,
        )

    def renew_surface(self, unknowns: Unknowns) -> None:
        """Match the samples of the surface to the current body."""
        assert self.surface is not None
        self._matches = match_surface(self.surface, self._skin(unknowns), self.model.faces)

    def _free(self, unknowns: Unknowns, stage: Stage) -> list[Tensor]:
        """The unknowns that a stage changes."""
        free = [unknowns.root, unknowns.translation]
        if unknowns.log_scale.requires_grad and stage != "depth":
            free.append(unknowns.log_scale)
            if unknowns.view.distance > 0:
                free.append(unknowns.pitch)
                if self.evidence.distance_spread > 0 and stage == "silhouette":
                    free.append(unknowns.log_distance)
        if stage != "camera":
            free.append(unknowns.angles)
        if stage not in ("depth", "camera"):
            free.append(unknowns.shape)
        return free

    def _loss(self, unknowns: Unknowns, stage: Stage) -> Tensor:
        import torch

        return torch.stack(list(self.terms(unknowns, stage).values())).sum()

    def metric(self, unknowns: Unknowns, *, stage: Stage) -> Metric:
        """The coordinates in which the objective of a stage is round at `unknowns`."""
        return metric_of(partial(self._loss, unknowns, stage), self._free(unknowns, stage))

    def minimize(
        self,
        unknowns: Unknowns,
        steps: int,
        *,
        stage: Stage,
        metric: Metric | None = None,
        gradient: float = GRADIENT,
    ) -> float:
        """Lower the objective by at most `steps` iterations of L-BFGS; return the largest change of
        an unknown in the coordinates of `metric`, which is computed here by default."""
        return minimize(
            partial(self._loss, unknowns, stage),
            self._free(unknowns, stage),
            steps=steps,
            history=20,
            metric=metric or self.metric(unknowns, stage=stage),
            gradient=gradient,
        )

    def minimize_angles(
        self, unknowns: Unknowns, which: IntArray, steps: int, *, stage: Stage
    ) -> float:
        """Lower the objective by changing only the angles `which` (n,); return its value."""
        import torch

        index, others = torch.from_numpy(which), unknowns.angles.detach()
        own = others[index].requires_grad_()

        def loss() -> Tensor:
            unknowns.angles = others.index_put((index,), own)
            return self._loss(unknowns, stage)

        minimize(loss, [own], steps=steps, history=20, metric=metric_of(loss, [own]))
        unknowns.angles = others.index_put((index,), own.detach()).requires_grad_()
        return self.cost(unknowns, stage)


def _tensor(values: Any) -> Tensor:
    """A copy of `values` in float64."""
    import torch

    return torch.tensor(np.asarray(values, dtype=np.float64))
