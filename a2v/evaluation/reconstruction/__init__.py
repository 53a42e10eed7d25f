"""The reconstruction benchmark: photos of people whose shape and colours are known, through the real path, compared with the truth.

Photos come from the validation split of the synthetic studio: identities and an outfit that no network of ours has learned from. Everything
is compared in the photo's frame, in which the photo is the orthographic front view of the true (warped) mesh.

One photo does not show the size of a person nor the distance: predicted points go from the predicted camera to pixels and from there to the
metres of the true camera (x, y and z by the same factor), and z is shifted so that the medians of the front depths agree where both are seen.
"""

from __future__ import annotations

import dataclasses
import json
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.errors import InputError
from a2v.evaluation.metrics import confidence_interval
from a2v.geometry.visibility import vertex_normals
from a2v.io import atomic_path, sha256
from a2v.processes import safe_children
from a2v.reconstruction.backends import BACKENDS, COLORINGS, backend_digest, backend_of
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray, OrthographicCamera, Subject, Surface
from a2v.version import __version__

if TYPE_CHECKING:
    from a2v.studio.studio import Studio

SPLIT = "validation"

METRICS: Mapping[str, tuple[str, int]] = {
    "chamfer": ("Chamfer cm↓", 2),
    "p2s": ("P2S cm↓", 2),
    "normals": ("Normals↑", 3),
    "normals_nearest": ("Normals, nearest↑", 3),
    "iou": ("IoU↑", 3),
    "psnr_front": ("Front PSNR↑", 2),
    "ssim_front": ("Front SSIM↑", 3),
    "psnr_back": ("Back PSNR↑", 2),
    "ssim_back": ("Back SSIM↑", 3),
}
"""Columns of the tables by metric, and their decimals."""

STAGES = ("perception", "fit", "shape", "color")


@dataclass(frozen=True)
class BenchmarkSettings:
    """The protocol.

    Attributes
    ----------
    views : int
        Photos.
    seed : int
        Chooses them, and the points on the predicted surface.
    size : int
        Rays along each side of the square photo, for silhouettes, normals and colours.
    points : int
        Points on the predicted surface.
    true_mask : bool
        Give the true mask to perception, which then does not look for its own.
    """

    views: int = 20
    seed: int = 0
    size: int = 512
    points: int = 50_000
    true_mask: bool = False

    def __post_init__(self) -> None:
        if self.views < 1 or self.points < 100 or not 64 <= self.size <= 2048:
            raise InputError(
                f"views={self.views}, points={self.points}, size={self.size}; expected at least 1 and 100, and a size from 64 to 2048"
            )


@dataclass(frozen=True, eq=False)
class Case:
    """A photo and the person in it.

    Attributes
    ----------
    name : str
        Of the avatar, ``<group>_<F|M>_<number>_<outfit>``.
    index : int
        Of the view in its split.
    image : (H, W, 3) uint8
    mask : (H, W) uint8
        255 inside.
    camera : OrthographicCamera
        Of the photo's pixels.
    surface : Surface
        The true mesh, coloured with its texture in the photo's mean light (`lit_by`).
    normals : (V, 3)
        Unit normals of its vertices.
    outer : (n,) int
        Its faces that can be seen from somewhere: scalps under wigs and mouths are not what is reconstructed.
    points, point_normals : (M, 3)
        Uniform by area on the outer surface, with unit normals.
    facts : mapping
        For the report: pose, yaw...
    """

    name: str
    index: int
    image: ByteArray
    mask: ByteArray
    camera: OrthographicCamera
    surface: Surface
    normals: FloatArray
    outer: IntArray
    points: FloatArray
    point_normals: FloatArray
    facts: Mapping[str, Any] = dataclasses.field(default_factory=dict)


def open_studio(folder: str | os.PathLike[str], data: str | os.PathLike[str]) -> Studio:
    """The studio of the benchmark: its default settings, in true metres (no error of a guide moves or scales the world).

    Parameters
    ----------
    folder : path
        Keeps poses and guides, which are made there if they are missing (some minutes): a data set's folder, or any other.
    data : path
        Folder with ``avatars/`` and the motion data.
    """
    from a2v.studio.guide import GuideErrors
    from a2v.studio.settings import StudioSettings
    from a2v.studio.studio import Studio

    exact = {item.name: 0.0 for item in dataclasses.fields(GuideErrors)}
    return Studio.open(folder, data, StudioSettings(guide=GuideErrors(**exact)))


def choose_views(studio: Studio, settings: BenchmarkSettings) -> list[int]:
    """Indices of validation views, seeded: every held-out identity, and the other people in the held-out outfit, as often as the others."""
    from a2v.studio.variation import VALIDATION_IDENTITIES

    generator = np.random.default_rng([settings.seed, 101])
    each = studio.settings.same_avatar
    names = [studio.avatar_of(SPLIT, block * each) for block in range(len(studio.paths[SPLIT]))]
    groups: dict[str, list[int]] = {}
    for block in generator.permutation(len(names)):
        identity = names[block].rpartition("_")[0]
        groups.setdefault(identity if identity in VALIDATION_IDENTITIES else "others", []).append(int(block))
    order = sorted(groups)
    chosen: list[int] = []
    for turn in range(settings.views):
        group = groups[order[turn % len(order)]]
        lap = turn // len(order)
        block = group[lap % len(group)] + len(names) * (lap // len(group) // each)
        chosen.append(block * each + (lap // len(group)) % each)
    return chosen


def open_case(studio: Studio, index: int) -> Case:
    """A validation view with its truth."""
    view, scene = studio.view(SPLIT, index), studio.scene(SPLIT, index)
    return Case(
        name=view.avatar,
        index=index,
        image=view.image,
        mask=view.mask,
        camera=view.camera,
        surface=lit_by(scene.surface, view.gain),
        normals=scene.normals,
        outer=scene.solid().outer,
        points=view.surface_points,
        point_normals=_unit(view.surface_normals.astype(np.float32)),
        facts={"pose": scene.pose, "yaw": round(view.yaw, 1), "sha256": sha256(view.image.tobytes())},
    )


def lit_by(surface: Surface, gain: FloatArray) -> Surface:
    """A surface whose colours (and texture) are multiplied by a linear RGB gain (3,), as in even light."""
    from a2v.geometry.colors import linear_to_srgb, srgb_to_linear, to_bytes

    colors = linear_to_srgb(srgb_to_linear(surface.colors) * gain)
    if surface.texture is None:
        return dataclasses.replace(surface, colors=colors)
    table = to_bytes(linear_to_srgb(srgb_to_linear(np.arange(256, dtype=np.float32) / 255)[:, None] * gain))
    texture = np.stack([table[surface.texture[..., channel], channel] for channel in range(3)], axis=-1)
    return dataclasses.replace(surface, colors=colors, texture=texture)


def camera_of_crop(camera: OrthographicCamera, subject: Subject) -> OrthographicCamera:
    """The photo's camera for the pixels of the subject's crop."""
    left, top, right, _ = subject.crop
    zoom = subject.image.shape[1] / (right - left)
    return OrthographicCamera(scale=camera.scale * zoom, center_u=(camera.center_u - left) * zoom, center_v=(camera.center_v - top) * zoom)


def to_true_frame(points: FloatArray, camera: OrthographicCamera, subject: Subject, true: OrthographicCamera) -> FloatArray:
    """Points (N, 3) of the frame of `camera` (of the subject's crop) in that of the photo's `true` camera: same pixels, same proportions."""
    crop = camera_of_crop(true, subject)
    return crop.unproject(camera.project(points), points[:, 2] * (camera.scale / crop.scale))


@dataclass(frozen=True, eq=False)
class Maps:
    """A surface as seen along the photo's viewing axis, from the front or through from the back, on the same pixels.

    Attributes
    ----------
    mask : (S, S) bool
    depth : (S, S) float32
        z, metres; NaN outside.
    normals : (S, S, 3) float32
        Unit, towards the viewer's side; 0 outside.
    colors : (S, S, 3) float32
        sRGB in [0, 1], unlit; mid grey outside.
    """

    mask: BoolArray
    depth: FloatArray
    normals: FloatArray
    colors: FloatArray


def surface_maps(surface: Surface, normals: FloatArray, camera: OrthographicCamera, photo: tuple[int, int], size: int, side: int) -> Maps:
    """What parallel rays through a grid over the photo see.

    Parameters
    ----------
    surface : Surface
        Textured, or with colours on its vertices.
    normals : (V, 3)
    camera : OrthographicCamera
        Of the photo's pixels.
    photo : tuple of 2 int
        The photo's height and width, pixels.
    size : int
        Rays along the longer side.
    side : int
        1 from the front, -1 from the back.
    """
    from a2v.geometry.colors import linear_to_srgb
    from a2v.geometry.rays import RayScene
    from a2v.studio.texture import texture_at

    step = max(photo) / size
    rows, columns = (np.arange(max(1, round(length / step))) + 0.5 for length in photo)
    pixels = np.stack(np.meshgrid(columns * step, rows * step), axis=-1)
    far = side * (float(np.abs(surface.vertices[:, 2]).max()) + 1)
    hits = RayScene(surface.vertices, surface.faces).cast(
        np.asarray(camera.unproject(pixels.reshape(-1, 2), far), np.float32), np.array([0, 0, -side], np.float32)
    )
    shape, seen = pixels.shape[:2], hits.hit
    depth = np.full(seen.shape, np.nan, np.float32)
    depth[seen] = far - side * hits.distance[seen]
    facing = np.zeros((len(seen), 3), np.float32)
    found = hits.interpolate(normals, surface.faces)
    facing[seen] = _unit(found * np.where(side * found[:, 2:] < 0, -1, 1))
    colors = np.full((len(seen), 3), 0.5, np.float32)
    if surface.texture is None:
        colors[seen] = hits.interpolate(surface.colors, surface.faces)
    else:
        colors[seen] = linear_to_srgb(texture_at(surface, hits.face[seen], hits.barycentric[seen]))
    return Maps(seen.reshape(shape), depth.reshape(shape), facing.reshape(*shape, 3), colors.reshape(*shape, 3))


class Truth:
    """What is computed of a case once, for all methods."""

    def __init__(self, case: Case, settings: BenchmarkSettings) -> None:
        """See the class."""
        from a2v.geometry.rays import RayScene, face_normals

        self.case, self.settings = case, settings
        self.photo = (int(case.mask.shape[0]), int(case.mask.shape[1]))
        self.sides = tuple(surface_maps(case.surface, case.normals, case.camera, self.photo, settings.size, side) for side in (1, -1))
        faces = case.surface.faces[case.outer]
        self._outer, self._face_normals = RayScene(case.surface.vertices, faces), face_normals(case.surface.vertices, faces)

    def place(self, surface: Surface, camera: OrthographicCamera, subject: Subject) -> Placed:
        """A prediction in the true frame, with z shifted as the protocol says.

        Raises
        ------
        InputError
            Prediction and truth have no pixel in common.
        """
        case = self.case
        vertices = to_true_frame(np.asarray(surface.vertices, np.float64), camera, subject, case.camera)
        moved = dataclasses.replace(surface, vertices=vertices.astype(np.float32))
        normals = vertex_normals(moved.vertices, moved.faces).astype(np.float32)
        front = surface_maps(moved, normals, case.camera, self.photo, self.settings.size, 1)
        both = front.mask & self.sides[0].mask
        if not both.any():
            raise InputError(f"{case.name} {case.index}: the reconstruction lies beside the person; nothing can be compared")
        shift = float(np.median(self.sides[0].depth[both]) - np.median(front.depth[both]))
        vertices[:, 2] += shift
        return Placed(dataclasses.replace(surface, vertices=vertices.astype(np.float32)), normals, shift)

    def compare_shape(self, placed: Placed) -> dict[str, float]:
        """Chamfer distance and point to surface (cm), normal consistency, and IoU of the silhouettes."""
        from a2v.geometry.rays import RayScene

        surface, case, settings = placed.surface, self.case, self.settings
        points, normals = sample_surface(surface, settings.points, seed=settings.seed)
        there = self._outer.closest(points)
        back = RayScene(surface.vertices, surface.faces).closest(case.points)
        forth, return_ = float(there.distance.mean()), float(back.distance.mean())
        maps = [surface_maps(surface, placed.normals, case.camera, self.photo, settings.size, side) for side in (1, -1)]
        cosines = [(mine.normals * true.normals).sum(axis=-1)[mine.mask & true.mask] for mine, true in zip(maps, self.sides, strict=True)]
        mine, true = maps[0].mask, self.sides[0].mask
        return {
            "chamfer": 50 * (forth + return_),
            "p2s": 100 * forth,
            "normals": float(np.concatenate(cosines).mean()),
            "normals_nearest": float(np.abs((normals * self._face_normals[there.face]).sum(axis=1)).mean()),
            "iou": float((mine & true).sum() / (mine | true).sum()),
        }

    def compare_colors(self, placed: Placed) -> dict[str, float]:
        """PSNR (dB) and SSIM of the unlit front and back views, over the pixels that either surface covers."""
        values: dict[str, float] = {}
        for name, side, true in zip(("front", "back"), (1, -1), self.sides, strict=True):
            mine = surface_maps(placed.surface, placed.normals, self.case.camera, self.photo, self.settings.size, side)
            values[f"psnr_{name}"], values[f"ssim_{name}"] = image_scores(mine.colors, true.colors, mine.mask | true.mask)
        return values


@dataclass(frozen=True, eq=False)
class Placed:
    """A prediction in the true frame: its surface, the normals (V, 3) of its vertices, and how far z was shifted, metres."""

    surface: Surface
    normals: FloatArray
    shift: float


def sample_surface(surface: Surface, count: int, *, seed: int) -> tuple[FloatArray, FloatArray]:
    """Points (count, 3) float32 uniform by area, and the normals (count, 3) of their faces."""
    import trimesh

    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    points, face = trimesh.sample.sample_surface(mesh, count, seed=seed)
    return np.asarray(points, np.float32), np.asarray(mesh.face_normals[face], np.float32)


def image_scores(first: FloatArray, second: FloatArray, region: BoolArray) -> tuple[float, float]:
    """PSNR (dB, at most 100) and mean SSIM (Wang et al. 2004: Gaussian window, sigma 1.5) of pictures (H, W, 3) in [0, 1] over a region."""
    from skimage.metrics import structural_similarity

    error = float(((first - second)[region] ** 2).mean())
    _, similarity = structural_similarity(
        first, second, channel_axis=-1, data_range=1.0, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, full=True
    )
    return min(100.0, -10 * float(np.log10(max(error, 1e-10)))), float(similarity[region].mean())


@dataclass(frozen=True)
class Method:
    """A backend with a way to colour: ``body-prior``, or ``body-prior:mirrored`` for an ablation.

    `weights` is a folder of weights for backends that have some; "" for the shipped ones.
    """

    backend: str
    coloring: str = "ours"
    weights: str = ""

    @classmethod
    def parse(cls, text: str, weights: str = "") -> Method:
        """From its name.

        Raises
        ------
        InputError
            Unknown backend or colouring.
        """
        backend, _, coloring = text.partition(":")
        coloring = coloring or "ours"
        if backend not in BACKENDS:
            raise InputError(f"unknown backend '{backend}'; choose from {', '.join(BACKENDS)}")
        if coloring not in COLORINGS:
            raise InputError(f"unknown colouring '{coloring}'; choose from {', '.join(COLORINGS)}")
        return cls(backend, coloring, weights)

    @property
    def name(self) -> str:
        """As it is parsed."""
        return self.backend if self.coloring == "ours" else f"{self.backend}:{self.coloring}"


@dataclass(frozen=True)
class Outcome:
    """What came out of one photo, in numbers.

    Attributes
    ----------
    name, index, facts
        Of the `Case`.
    scores : mapping of method name to metric to value
    seconds : mapping of method name to stage to wall seconds
    made : mapping of method name to mapping
        Provenance of the surface: digest of the weights, iterations of Eq. 14...
    failure : str
        Why perception, the fit or a method gave up; "" if they did not. Such photos count for no method.
    """

    name: str
    index: int
    facts: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    scores: Mapping[str, Mapping[str, float]] = dataclasses.field(default_factory=dict)
    seconds: Mapping[str, Mapping[str, float]] = dataclasses.field(default_factory=dict)
    made: Mapping[str, Mapping[str, Any]] = dataclasses.field(default_factory=dict)
    failure: str = ""

    @property
    def identity(self) -> str:
        """The person, without the outfit."""
        return self.name.rpartition("_")[0]

    @property
    def outfit(self) -> str:
        """What the person wears."""
        return self.name.rpartition("_")[2]

    def with_others(self, later: Outcome) -> Outcome:
        """This one and what another run measured of the same photo."""
        return dataclasses.replace(
            later, scores={**self.scores, **later.scores}, seconds={**self.seconds, **later.seconds}, made={**self.made, **later.made}
        )


@dataclass(frozen=True, eq=False)
class Result:
    """An outcome with what there is to look at: surfaces by method in the true frame, and the subject (None if the photo failed)."""

    case: Case
    outcome: Outcome
    surfaces: Mapping[str, Surface] = dataclasses.field(default_factory=dict)
    subject: Subject | None = None


def evaluate_case(case: Case, methods: Sequence[Method], settings: BenchmarkSettings) -> Result:
    """One photo through perception, fit, and each method; the fit is shared, and the shape by methods that colour alone."""
    try:
        return _evaluate(case, methods, settings)
    except InputError as error:
        return Result(case, Outcome(case.name, case.index, case.facts, failure=str(error)))


def _evaluate(case: Case, methods: Sequence[Method], settings: BenchmarkSettings) -> Result:
    from a2v.body import fit_body
    from a2v.perception import find_person

    clock = _Clock()
    subject = find_person(case.image, mask=case.mask if settings.true_mask else None)
    clock.lap("perception")
    person, true = mask_in_photo(subject) > 0.5, case.mask > 127
    if (person & true).sum() < 0.5 * (person | true).sum():
        raise InputError("perception took something else for the person: its mask and the true one overlap by less than a half")
    clock.start()
    fit = fit_body(subject)
    clock.lap("fit")
    truth = Truth(case, settings)
    common = dict(clock.seconds)
    scores: dict[str, dict[str, float]] = {}
    seconds: dict[str, dict[str, float]] = {}
    surfaces: dict[str, Surface] = {}
    for backend in dict.fromkeys((method.backend, method.weights) for method in methods):
        clock = _Clock()
        shape = backend_of(*backend)(subject, fit.body, fit.camera)
        clock.lap("shape")
        geometry: dict[str, float] | None = None
        for method in methods:
            if (method.backend, method.weights) != backend:
                continue
            clock.start()
            colored = COLORINGS[method.coloring](shape, subject, fit.body, fit.camera)
            clock.lap("color")
            placed = truth.place(colored, fit.camera, subject)
            geometry = geometry or truth.compare_shape(placed)
            scores[method.name] = geometry | truth.compare_colors(placed)
            seconds[method.name] = common | clock.seconds
            surfaces[method.name] = placed.surface
    made = {name: dict(surface.provenance) for name, surface in surfaces.items()}
    return Result(case, Outcome(case.name, case.index, case.facts, scores, seconds, made), surfaces, subject)


class _Clock:
    """Wall seconds of named stages."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.start()

    def start(self) -> None:
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.seconds[name], self._last = now - self._last, now


class Measured:
    """A folder in which finished photos are kept, so that a run that was stopped, or that gets another method, goes on.

    Parameters
    ----------
    folder : path
    studio : Studio
    settings : BenchmarkSettings
        What was measured with another protocol, studio, or weights of the method does not count.
    """

    def __init__(self, folder: str | os.PathLike[str], studio: Studio, settings: BenchmarkSettings) -> None:
        """See the class."""
        from a2v.studio.settings import VERSION

        self.folder = Path(folder)
        protocol = {name: value for name, value in dataclasses.asdict(settings).items() if name != "views"}
        self._common = [protocol, VERSION, dataclasses.asdict(studio.settings)]

    def _path(self, index: int, method: Method) -> Path:
        key = sha256(json.dumps([*self._common, method.name, backend_digest(method.backend, method.weights)], sort_keys=True).encode())[:16]
        return self.folder / f"{index:06d}-{method.name.replace(':', '-')}-{key}"

    def load(self, index: int, methods: Sequence[Method]) -> Outcome | None:
        """What is known of a photo, None for nothing; failed photos are tried again."""
        known: Outcome | None = None
        for method in methods:
            path = self._path(index, method).with_suffix(".json")
            if path.exists():
                found = Outcome(**json.loads(path.read_text()))
                known = known.with_others(found) if known else found
        return known

    def save(self, result: Result, methods: Sequence[Method]) -> None:
        """Keep a result, with its pictures, method by method."""
        import cv2

        outcome, rows = result.outcome, picture_rows(result)
        if outcome.failure:
            return
        for method in methods:
            path, name = self._path(outcome.index, method), method.name
            own = dataclasses.replace(
                outcome, scores={name: outcome.scores[name]}, seconds={name: outcome.seconds[name]}, made={name: outcome.made[name]}
            )
            for suffix, picture in ((".png", rows[name]), (".truth.png", rows["truth"])):
                with atomic_path(path.with_suffix(suffix)) as temporary:
                    cv2.imwrite(str(temporary), picture[..., ::-1])
            with atomic_path(path.with_suffix(".json")) as temporary:
                temporary.write_text(json.dumps(dataclasses.asdict(own)))

    def sheet(self, index: int, methods: Sequence[Method]) -> ByteArray:
        """The pictures of a photo that is known for all of `methods`: the truth and each method, below each other."""
        import cv2

        paths = [self._path(index, method) for method in methods]
        files = [paths[0].with_suffix(".truth.png"), *(path.with_suffix(".png") for path in paths)]
        return stack_rows([np.asarray(cv2.imread(str(file)))[..., ::-1] for file in files])


def peak_memory(case: Case, method: Method, settings: BenchmarkSettings) -> float:
    """Most resident memory, MiB, of a fresh process that takes the photo all the way to the coloured surface (libraries included)."""
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    mask = case.mask if settings.true_mask else None
    with safe_children(), ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        return pool.submit(_peak_of_run, case.image, mask, method).result()


def _peak_of_run(image: ByteArray, mask: ByteArray | None, method: Method) -> float:
    import resource
    import sys

    from a2v.body import fit_body
    from a2v.perception import find_person

    subject = find_person(image, mask=mask)
    fit = fit_body(subject)
    COLORINGS[method.coloring](backend_of(method.backend, method.weights)(subject, fit.body, fit.camera), subject, fit.body, fit.camera)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1024 / (1024 if sys.platform == "darwin" else 1)  # macOS counts bytes


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9), np.float32)


# ------------------------------------------------------------------------------------------------------------------ reports


def picture_rows(result: Result, *, size: int = 200) -> dict[str, ByteArray]:
    """Pictures (size, W, 3) uint8 of an evaluated photo, "truth" and one for each method.

    Photo (mask in the rows of methods), front, left, back and right unlit, then front, left and back as clay.
    """
    import cv2

    from a2v.geometry.colors import to_bytes
    from a2v.rendering.preview import preview_surface

    case = result.case
    low, high = case.surface.vertices.min(axis=0), case.surface.vertices.max(axis=0)
    center, extent = (low + high) / 2, 1.1 * float((high - low).max())
    wide = min(1.0, 1.25 * float(np.hypot(*(high - low)[[0, 2]])) / extent)  # however the person is turned
    border = round((1 - wide) / 2 * size)

    def look(surface: Surface, azimuth: float, clay: bool = False) -> ByteArray:
        picture = preview_surface(surface, azimuth=azimuth, size=size, center=center, extent=extent, shaded=False, plain=clay)
        return picture[:, border : size - border]

    mask = np.zeros((size, size, 3), np.uint8)
    if result.subject is not None:
        small = cv2.resize(mask_in_photo(result.subject), (size, size), interpolation=cv2.INTER_AREA)
        mask[:] = to_bytes(small)[..., None]
    rows = {}
    for name, surface in {"truth": case.surface, **result.surfaces}.items():
        first = cv2.resize(case.image, (size, size), interpolation=cv2.INTER_AREA) if name == "truth" else mask
        turned = [look(surface, turn) for turn in (0, 90, 180, 270)] + [look(surface, turn, clay=True) for turn in (0, 90, 180)]
        rows[name] = np.hstack([first, *turned])
        label = f"{case.name} {case.index}" if name == "truth" else name
        cv2.putText(rows[name], label, (size + 4, 12), cv2.FONT_HERSHEY_SIMPLEX, 0.38, (40, 40, 40))
    return rows


def stack_rows(rows: Sequence[ByteArray]) -> ByteArray:
    """Pictures below each other, light grey beside narrower ones."""
    width = max(row.shape[1] for row in rows)
    return np.vstack([np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0)), constant_values=235) for row in rows])


def mask_in_photo(subject: Subject) -> FloatArray:
    """What perception took for the person, in the whole photo, (H, W) float32."""
    import cv2

    left, top, right, bottom = subject.crop
    width, height = subject.photo_size
    crop = cv2.resize(subject.mask, (right - left, bottom - top), interpolation=cv2.INTER_AREA)
    whole = np.zeros((height, width), np.float32)
    y, x = slice(max(0, top), min(height, bottom)), slice(max(0, left), min(width, right))
    whole[y, x] = crop[y.start - top : y.stop - top, x.start - left : x.stop - left]
    return whole


def _cell(values: Sequence[float], decimals: int, interval: bool = True) -> str:
    mean, half = confidence_interval(np.asarray(values))
    return f"{mean:.{decimals}f} ± {half:.{decimals}f}" if interval and len(values) > 1 else f"{mean:.{decimals}f}"


def method_table(outcomes: Sequence[Outcome], memory: Mapping[str, float]) -> str:
    """All metrics by method: mean ± half width of the 95 % interval over the photos; seconds by stage, and peak memory."""
    good = [outcome for outcome in outcomes if not outcome.failure]
    head = [label for label, _ in METRICS.values()]
    lines = [f"| Method | {' | '.join(head)} | Shape s | Colour s | All s | Peak MiB |", "|---" * (len(head) + 5) + "|"]
    for name in good[0].scores if good else ():
        cells = [_cell([outcome.scores[name][metric] for outcome in good], decimals) for metric, (_, decimals) in METRICS.items()]
        stages = [np.mean([outcome.seconds[name][stage] for outcome in good]) for stage in ("shape", "color")]
        whole = np.mean([sum(outcome.seconds[name].values()) for outcome in good])
        peak = f"{memory[name]:.0f}" if name in memory else "–"
        lines.append(f"| {name} | {' | '.join(cells)} | {stages[0]:.1f} | {stages[1]:.1f} | {whole:.1f} | {peak} |")
    return "\n".join(lines)


def group_table(outcomes: Sequence[Outcome], method: str, by: str) -> str:
    """Means of one method by "identity" (people who are held out; "others" wear the held-out outfit) or by "outfit"."""
    from a2v.studio.variation import VALIDATION_IDENTITIES

    groups: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        if not outcome.failure:
            key = outcome.outfit
            if by == "identity":
                key = outcome.identity if outcome.identity in VALIDATION_IDENTITIES else "others"
            groups.setdefault(key, []).append(outcome)
    lines = [f"| {by} | photos | {' | '.join(label for label, _ in METRICS.values())} |", "|---" * (len(METRICS) + 2) + "|"]
    for key, members in sorted(groups.items()):
        cells = [_cell([o.scores[method][metric] for o in members], decimals, interval=False) for metric, (_, decimals) in METRICS.items()]
        lines.append(f"| {key} | {len(members)} | {' | '.join(cells)} |")
    return "\n".join(lines)


def report(outcomes: Sequence[Outcome], memory: Mapping[str, float], settings: BenchmarkSettings, studio: Studio) -> dict[str, Any]:
    """Everything a reader needs to reproduce the tables, and every photo's values, as JSON."""
    from a2v.studio.settings import VERSION

    return {
        "protocol": dataclasses.asdict(settings) | {"split": SPLIT},
        "studio": {"version": VERSION, "settings": dataclasses.asdict(studio.settings)},
        "versions": {"a2v": __version__, "numpy": np.__version__},
        "peak_memory_mib": dict(memory),
        "failed": sum(bool(outcome.failure) for outcome in outcomes),
        "photos": [dataclasses.asdict(outcome) for outcome in outcomes],
    }
