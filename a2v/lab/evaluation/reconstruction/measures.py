"""Compare a prediction with the truth: shape, silhouette, normals, colors."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from a2v.body import FitResult, load_body_model
from a2v.body.limbs import LIMBS, TRUNK
from a2v.body.skin import outer_skin
from a2v.errors import InputError
from a2v.geometry.mesh import face_normals, vertex_normals
from a2v.geometry.rays import RayScene
from a2v.lab.evaluation.reconstruction.alignment import Scan, aligned_distances, similar
from a2v.lab.evaluation.reconstruction.cases import Case
from a2v.lab.evaluation.reconstruction.maps import camera_of_crop, surface_maps, to_true_frame
from a2v.lab.evaluation.reconstruction.settings import BenchmarkSettings
from a2v.lab.evaluation.reconstruction.thickness import THICK, THIN, longest_ways
from a2v.types import BoolArray, Camera, FloatArray, IntArray, Subject, Surface

ASIDE = 0.01
"""Distance in the picture within which places count as one for `slabs_slack`, meters: everything is
thin at the rim of a silhouette."""
BLOCK = 0.2
"""Side of the blocks of `shifted_psnr`, meters."""
SHIFT = 0.03
"""Largest shift of a block along each axis, meters: the camera and the depth of a fit move the
pattern of a back in the picture by some centimeters."""


@dataclass(frozen=True, eq=False)
class Placed:
    """A prediction in the true frame: its surface, the normals (V, 3) of its vertices, and the
    shift of z, meters.

    `world` (V, 3) are its vertices in the world, in the size of the photo.
    """

    surface: Surface
    world: FloatArray
    normals: FloatArray
    shift: float


class Truth:
    """The truth of a case, computed once for all methods."""

    def __init__(self, case: Case, settings: BenchmarkSettings) -> None:
        """See the class."""
        self.case, self.settings = case, settings
        self.photo = (int(case.mask.shape[0]), int(case.mask.shape[1]))
        self.sides = tuple(
            surface_maps(
                case.surface, case.normals, case.camera, self.photo, size=settings.size, side=side
            )
            for side in (1, -1)
        )
        faces = case.surface.faces[case.outer]
        self._outer, self._face_normals = (
            RayScene(case.surface.vertices, faces),
            face_normals(case.surface.vertices, faces),
        )
        self._triangles = np.asarray(case.surface.vertices, np.float64)[faces]

    def place(self, surface: Surface, camera: Camera, subject: Subject) -> Placed:
        """Put a prediction into the true frame, with z shifted as in the protocol.

        Raises
        ------
        InputError
            Prediction and truth have no pixel in common.
        """
        case = self.case
        vertices = to_true_frame(
            np.asarray(surface.vertices, np.float64), camera, subject, true=case.camera
        )
        moved = dataclasses.replace(surface, vertices=vertices.astype(np.float32))
        normals = vertex_normals(moved.vertices, moved.faces).astype(np.float32)
        front = surface_maps(
            moved, normals, case.camera, self.photo, size=self.settings.size, side=1
        )
        both = front.mask & self.sides[0].mask
        if not both.any():
            raise InputError(
                f"{case.name} {case.index}: the reconstruction does not overlap the person; "
                "nothing can be compared"
            )
        shift = float(np.median(self.sides[0].depth[both]) - np.median(front.depth[both]))
        vertices[:, 2] += shift
        placed = dataclasses.replace(surface, vertices=vertices.astype(np.float32))
        return Placed(placed, self._sized(surface.vertices, camera, subject), normals, shift)

    def _sized(self, vertices: FloatArray, camera: Camera, subject: Subject) -> FloatArray:
        """Vertices (V, 3) of the world in true meters, by the pixels per meter at the depth of the
        person."""
        return np.asarray(
            vertices * (camera.scale / camera_of_crop(self.case.camera, subject).scale), np.float64
        )

    def compare_shape(self, placed: Placed) -> dict[str, float]:
        """Chamfer distance and point to surface (cm), both also after rigid alignment, normals,
        IoU, and the share that is too thick (`thick_share`)."""
        surface, case, settings = placed.surface, self.case, self.settings
        points, normals = sample_surface(surface, settings.points, seed=settings.seed)
        there = self._outer.closest(points)
        back = RayScene(surface.vertices, surface.faces).closest(case.points)
        forth, return_ = float(there.distance.mean()), float(back.distance.mean())
        maps = [
            surface_maps(
                surface, placed.normals, case.camera, self.photo, size=settings.size, side=side
            )
            for side in (1, -1)
        ]
        cosines = [
            (mine.normals * true.normals).sum(axis=-1)[mine.mask & true.mask]
            for mine, true in zip(maps, self.sides, strict=True)
        ]
        mine, true = maps[0].mask, self.sides[0].mask
        aligned = self._aligned(surface, points)
        world = self._in_world(placed.world, surface.faces)
        return {
            "chamfer": 50 * (forth + return_),
            "p2s": 100 * forth,
            "chamfer_aligned": 100 * aligned[0],
            "p2s_aligned": 100 * aligned[1],
            "chamfer_world": 100 * world[0],
            "p2s_world": 100 * world[1],
            "thick": 100
            * thick_share(*(tuple(side.depth for side in pair) for pair in (maps, self.sides))),
            "slabs": 100 * self._slabs(surface, 0.0),
            "slabs_slack": 100 * self._slabs(surface, ASIDE),
            "normals": float(np.concatenate(cosines).mean()),
            "normals_nearest": float(
                np.abs((normals * self._face_normals[there.face]).sum(axis=1)).mean()
            ),
            "iou": float((mine & true).sum() / (mine | true).sum()),
        }

    def _slabs(self, surface: Surface, aside: float) -> float:
        """Return the fraction of the pixels of both silhouettes that are slabs.

        At such a pixel the longest path through the solid is over `THICK` times the truth's
        thickness from front to back, of which the largest within `aside` meters counts. Unlike in
        `thick_share`, separate limbs are not slabs.
        """
        import cv2

        step = max(self.photo) / self.settings.size
        rows, columns = (np.arange(max(1, round(length / step))) + 0.5 for length in self.photo)
        pixels = (
            np.stack(np.meshgrid(columns * step, rows * step), axis=-1) + 0.0137 * step
        )  # not along an edge
        own = longest_ways(
            surface.vertices.astype(np.float64),
            surface.faces,
            self.case.camera,
            pixels.reshape(-1, 2),
        )
        real = self.sides[0].depth - self.sides[1].depth
        both = np.isfinite(real) & (own.reshape(real.shape) > 0)
        reach = round(aside * self.case.camera.scale / step)
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
        thickest = cv2.dilate(np.nan_to_num(real).astype(np.float32), disc)
        return float(
            (own.reshape(real.shape)[both] > THICK * np.maximum(thickest[both], THIN)).mean()
        )

    def _aligned(self, surface: Surface, points: FloatArray) -> tuple[float, float]:
        truth = Scan(self._outer, self._triangles, self.case.points)
        return aligned_distances(Scan.of(surface.vertices, surface.faces, points), truth)

    def _in_world(self, vertices: FloatArray, faces: IntArray) -> tuple[float, float]:
        """Return Chamfer distance and point to surface, meters, between people in the world, after
        scaling. Perspective distortion counts as an error."""
        plain = Surface(
            vertices=vertices.astype(np.float32),
            faces=faces.astype(np.int32),
            colors=np.full(vertices.shape, 0.5, np.float32),
        )
        points, _ = sample_surface(plain, self.settings.points, seed=self.settings.seed)
        camera, faces_ = self.case.photo_camera, self.case.surface.faces[self.case.outer]
        true = camera.raised(self.case.surface.vertices.astype(np.float64))
        truth = Scan.of(true, faces_, camera.raised(self.case.points))
        return aligned_distances(Scan.of(plain.vertices, plain.faces, points), truth, sized=True)

    def compare_fit(self, fit: FitResult, subject: Subject) -> dict[str, float]:
        """Scores of the fitted body: its skin against the dressed truth after rigid alignment, and
        the depths of its limbs relative to the trunk (cm)."""
        import torch

        vertices, faces, _ = outer_skin(fit.body)
        body = fit.body
        marks = load_body_model().landmarks_of(
            torch.from_numpy(body.vertices)[load_body_model().landmark_vertices],
            torch.from_numpy(body.bone_transforms[:, :3, 3]),
        )
        seen, skin = (
            to_true_frame(np.asarray(x, np.float64), fit.camera, subject, true=self.case.camera)
            for x in (marks.numpy(), vertices)
        )
        gap = seen[:, 2] - self.case.landmarks[:, 2]
        gap = gap - gap[list(TRUNK)].mean()
        skin[:, 2] += float(np.median(self.case.points[:, 2]) - np.median(skin[:, 2]))
        plain = Surface(
            vertices=skin.astype(np.float32),
            faces=faces.astype(np.int32),
            colors=np.full(skin.shape, 0.5, np.float32),
        )
        points, _ = sample_surface(plain, 10_000, seed=self.settings.seed)
        return {
            "body_aligned": 100 * self._aligned(plain, points)[0],
            "body_world": 100
            * self._in_world(self._sized(vertices, fit.camera, subject), faces)[0],
            "landmarks_world": 100
            * self._landmarks_in_world(np.asarray(marks.numpy(), np.float64)),
            **{
                f"depth_{limb}": 100 * float(np.abs(gap[list(places)]).mean())
                for limb, places in LIMBS.items()
            },
            "keypoint_mean": 100 * float(fit.residuals["keypoint_mean"]),
            "silhouette_iou": float(fit.residuals["silhouette_iou"]),
            **{
                f"expected_{limb}": 100 * float(error)
                for limb, error in fit.residuals.get("limb_errors", {}).items()
            },
        }

    def _landmarks_in_world(self, marks: FloatArray) -> float:
        """Mean distance of landmarks (33, 3) from the true ones in the world, meters, after a
        similarity that aligns them."""
        true = self.case.photo_camera.raised(self.case.landmarks.astype(np.float64))
        known = np.isfinite(true).all(axis=1)
        rotation, shift, factor = similar(marks[known], true[known])
        return float(
            np.linalg.norm(factor * marks[known] @ rotation.T + shift - true[known], axis=1).mean()
        )

    def compare_colors(self, placed: Placed) -> dict[str, float]:
        """PSNR (dB) and SSIM of the unlit front and back views, over all pixels that the surface or
        the true surface covers; PSNR of the back also with shifts (`shifted_psnr`), over those
        that both cover."""
        values: dict[str, float] = {}
        density = self.case.camera.scale * self.settings.size / max(self.photo)
        for name, side, true in zip(("front", "back"), (1, -1), self.sides, strict=True):
            mine = surface_maps(
                placed.surface,
                placed.normals,
                self.case.camera,
                self.photo,
                size=self.settings.size,
                side=side,
            )
            values[f"psnr_{name}"], values[f"ssim_{name}"] = image_scores(
                mine.colors, true.colors, mine.mask | true.mask
            )
            if side < 0:
                values["psnr_back_aside"] = shifted_psnr(
                    mine.colors,
                    true.colors,
                    mine.mask & true.mask,
                    block=max(2, round(BLOCK * density)),
                    reach=round(SHIFT * density),
                )
                values["detail_back"] = detail_share(
                    mine.colors, true.colors, mine.mask & true.mask
                )
        return values


def thick_share(mine: tuple[FloatArray, ...], true: tuple[FloatArray, ...]) -> float:
    """Share of the pixels of both silhouettes at which a surface is more than `THICK` times as
    thick as the truth.

    Depths (H, W) of front and back, meters, NaN outside. Thicknesses below `THIN` meters, as at
    every rim, count as `THIN`.
    """
    own, real = mine[0] - mine[1], true[0] - true[1]
    both = np.isfinite(own) & np.isfinite(real)
    return float((own[both] > THICK * np.maximum(real[both], THIN)).mean())


def detail_share(mine: FloatArray, true: FloatArray, region: BoolArray) -> float:
    """Energy of the Laplacian of a picture (H, W, 3) relative to that of the true picture, in the
    middle of a region (H, W): below 1 it is blurred."""
    import cv2

    inner = cv2.erode(region.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    if not inner.any():
        return 1.0
    energy = [
        float(
            (
                cv2.Laplacian(np.ascontiguousarray(picture.mean(axis=-1), np.float32), cv2.CV_32F)[
                    inner
                ]
                ** 2
            ).mean()
        )
        for picture in (mine, true)
    ]
    return (energy[0] + 1e-9) / (energy[1] + 1e-9)


def shifted_psnr(
    mine: FloatArray, true: FloatArray, region: BoolArray, *, block: int, reach: int
) -> float:
    """PSNR (dB, at most 100) of a picture (H, W, 3) in [0, 1] over a region (H, W) if each block of
    `block` pixels may move by up to `reach` pixels along each axis.

    Blocks without a pixel of the region do not count, and a move that takes a block out of the
    picture repeats its rim.
    """
    rows, columns = (np.arange(0, side, block) for side in region.shape)

    def summed(values: FloatArray) -> FloatArray:
        return np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1)

    wide = np.pad(mine, ((reach, reach), (reach, reach), (0, 0)), mode="edge")
    height, width = region.shape
    least = np.full((len(rows), len(columns)), np.inf)
    for down in range(2 * reach + 1):
        for aside in range(2 * reach + 1):
            moved = wide[down : down + height, aside : aside + width]
            error = ((moved - true) ** 2).mean(axis=-1, dtype=np.float64)
            least = np.minimum(least, summed(np.where(region, error, 0.0)))
    error = float(least.sum() / max(1, region.sum()))
    return min(100.0, -10 * float(np.log10(max(error, 1e-10))))


def sample_surface(surface: Surface, count: int, *, seed: int) -> tuple[FloatArray, FloatArray]:
    """Points (count, 3) float32 uniform by area, and the normals (count, 3) of their faces."""
    import trimesh

    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    points, face = trimesh.sample.sample_surface(mesh, count, seed=seed)
    return np.asarray(points, np.float32), np.asarray(mesh.face_normals[face], np.float32)


def image_scores(first: FloatArray, second: FloatArray, region: BoolArray) -> tuple[float, float]:
    """PSNR (dB, at most 100) and mean SSIM (Wang et al. 2004: Gaussian window, sigma 1.5) of
    pictures (H, W, 3) in [0, 1] over a region."""
    from skimage.metrics import structural_similarity

    error = float(((first - second)[region] ** 2).mean())
    _, similarity = structural_similarity(
        first,
        second,
        channel_axis=-1,
        data_range=1.0,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        full=True,
    )
    return min(100.0, -10 * float(np.log10(max(error, 1e-10)))), float(similarity[region].mean())
