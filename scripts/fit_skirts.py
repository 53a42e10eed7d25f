"""Train the network that finds skirts (`a2v.reconstruction.reading.skirt`).

    python scripts/fit_skirts.py --data ../shared/data --out runs/skirts

The studio's people of the training split are photographed at 256 pixels (`a2v.lab.studio.quick`):
42 % as they are, 13 % with bare legs below a drawn height, 30 % in a drawn skirt, 15 % in a drawn
coat (`a2v.lab.studio.drawn_skirts`). The only dress of the split, of White_F_3_Casual, is left out.
Every eighth file validates. ``runs/skirts`` keeps the views (``views``) and gets
``person_skirts.onnx``.
"""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor, nn
from tqdm import tqdm

from a2v.body.parts import PARTS
from a2v.body.places import canonical_places
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.drawn_skirts import draw_cloth, draw_skirt, leg_heights, rgb_of, with_skirt
from a2v.lab.studio.posing import SIDES, Pose, joint_noise, natural_pose, without_heading
from a2v.lab.studio.quick.people import QuickStudio
from a2v.lab.studio.quick.photo import places_of, quick_view, softened
from a2v.lab.studio.quick.settings import QuickSettings
from a2v.lab.studio.quick.views import QuickView
from a2v.lab.studio.solid import weld
from a2v.lab.studio.stand import Outfit, PreparedAvatar
from a2v.lab.studio.things.clutter import Clutter
from a2v.lab.studio.variation import Build, Wardrobe, part_map, rebuild, recolor
from a2v.reconstruction.reading.legs_chart import ALONG, legs_chart
from a2v.reconstruction.reading.skirt import FILE, FORMAT
from a2v.tracing import to_onnx
from export.storage import round_to_stored, save_model, shrink

SETTINGS = QuickSettings(
    seed=29, facing=0.85, yaw=28.0, cut=0.04, things=0.15, furniture=0.06, others=0.0,
    distance=(2.0, 10.0), height=(0.7, 1.9),
)  # fmt: skip
DRESSED = "White_F_3_Casual"
ROWS = 24
PLACES = torch.from_numpy(ALONG.reshape(ROWS, -1).mean(1).astype(np.float32))
LEGS = [
    [LANDMARK_INDEX[f"{side}_{name}"] for name in ("hip", "knee", "ankle")]
    for side in ("left", "right")
]


class SkirtNetwork(nn.Module):
    """A chart (B, 6, 96, 96) to the logits of a skirt (B,), and of cloth at 24 places (B, 24)."""

    def __init__(self) -> None:
        super().__init__()

        def block(inner: int, outer: int, stride: int | tuple[int, int]) -> nn.Module:
            return nn.Sequential(
                nn.Conv2d(inner, outer, 3, stride, 1), nn.BatchNorm2d(outer), nn.ReLU()
            )

        self.a = nn.Sequential(
            block(6, 24, 2), block(24, 32, 2), block(32, 48, (1, 2)), block(48, 48, (1, 2))
        )
        self.r = nn.Sequential(
            nn.Conv1d(96, 64, 3, 1, 1), nn.BatchNorm1d(64), nn.ReLU(), nn.Dropout(0.2),
            nn.Conv1d(64, 64, 5, 1, 4, dilation=2), nn.BatchNorm1d(64), nn.ReLU(),
        )  # fmt: skip
        self.row, self.whole = nn.Conv1d(64, 1, 1), nn.Linear(128, 1)

    def forward(self, charts: Tensor) -> tuple[Tensor, Tensor]:
        """See the class."""
        seen = self.a(charts)
        seen = self.r(torch.cat([seen.mean(3), seen.amax(3)], 1))
        return self.whole(torch.cat([seen.mean(2), seen.amax(2)], 1))[:, 0], self.row(seen)[:, 0]


class Graph(nn.Module):
    """The computation of the file: probabilities."""

    def __init__(self, network: SkirtNetwork) -> None:
        super().__init__()
        self.network = network

    def forward(self, chart: Tensor) -> tuple[Tensor, Tensor]:
        """See the class."""
        whole, rows = self.network(chart)
        return torch.sigmoid(whole), torch.sigmoid(rows)


def lab_of(colors: np.ndarray) -> np.ndarray:
    """CIELAB (n, 3) of sRGB colors (n, 3) uint8."""
    return cv2.cvtColor(np.float32(colors)[None] / 255, cv2.COLOR_RGB2LAB)[0]


def texel_heights(avatar: Avatar, clothes: Wardrobe) -> np.ndarray:
    """Heights (n,) at rest of the texels of clothes, meters; NaN above the waist."""
    height, width = avatar.texture.shape[:2]
    rest = avatar.skin(avatar.rest_transforms)[avatar.faces, 1]
    low, high = rest.min(), rest.max()
    corners = np.rint(
        np.stack([avatar.uv[..., 0] * width, (1 - avatar.uv[..., 1]) * height], -1)
    ).astype(np.int32)
    painted, below = (
        np.full((height, width), -1, np.int16),
        rest.mean(1) < low + 0.62 * (high - low),
    )
    for corner, value in zip(corners[below], rest.mean(1)[below], strict=True):
        cv2.fillConvexPoly(painted, corner, int(1000 * (value - low)))
    found = painted[clothes.rows, clothes.columns].astype(np.float64)
    return np.where(found < 0, np.nan, found / 1000 + low)


def draw_legs(studio: QuickStudio, generator: np.random.Generator) -> Pose:
    """A quarter stand naturally, half have legs together, apart or in a step, a quarter act."""
    kind = generator.random()
    if kind < 0.25:
        return joint_noise(natural_pose(generator), generator)
    if kind >= 0.75:
        pose = studio.bank.draw("training", generator, 1.0)
        pose["Hips"] = without_heading(pose["Hips"])
        return joint_noise(pose, generator, 0.5)
    pose = natural_pose(generator)
    pose["Hips"] = pose["Hips"] * 0.3
    legs = generator.random()
    for side, sign in SIDES:
        if legs < 0.4:
            out, ahead = np.radians(generator.uniform(-6, 3)), np.radians(generator.normal(0, 5))
            bend = abs(generator.normal(0, 0.05))
        elif legs < 0.7:
            out, ahead = np.radians(generator.uniform(-2, 28)), np.radians(generator.normal(0, 8))
            bend = abs(generator.normal(0, 0.15))
        else:
            out, ahead = np.radians(generator.normal(1, 4)), np.radians(generator.uniform(-28, 32))
            bend = generator.uniform(0, 0.8) * (generator.random() < 0.7)
        pose[f"{side}UpLeg"] = np.array([-ahead, generator.normal(0, 0.1), sign * out])
        pose[f"{side}Leg"] = np.array([bend, 0, 0])
        pose[f"{side}Foot"] = np.array([0.5 * (ahead - bend), 0, 0])
    return joint_noise(pose, generator, 0.35)


def bared(
    texture: np.ndarray,
    clothes: Wardrobe,
    legs: np.ndarray,
    skin: np.ndarray,
    generator: np.random.Generator,
) -> np.ndarray:
    """Paint skin, or stockings, on the texels of `legs` (n,)."""
    if not legs.any():
        return texture
    lab = skin + np.zeros((legs.sum(), 3))
    if generator.random() < 0.2:
        lab = (
            np.array([generator.uniform(5, 60), generator.normal(0, 4), generator.normal(2, 5)])
            + 0 * lab
        )
    lab = lab + generator.normal(0, 1.2, (len(lab), 1)) * [1, 0.2, 0.2]
    lab = lab + np.array(
        [generator.normal(-2, 3), generator.normal(0, 1.5), generator.normal(0, 1.5)]
    )
    rows, columns, result = clothes.rows[legs], clothes.columns[legs], texture.copy()
    old = texture[rows, columns].astype(float)
    result[rows, columns] = old + clothes.opacity[legs][:, None] * (rgb_of(lab[None])[0] - old)
    return result


def cloth_color(
    texture: np.ndarray, clothes: Wardrobe, coat: bool, generator: np.random.Generator
) -> np.ndarray:
    """The color of a skirt, CIELAB: its own, or that of the shirt or the trousers."""
    alike = generator.random() < (0.9 if coat else 0.45)
    color = (
        np.array([generator.uniform(6, 92), generator.normal(0, 20), generator.normal(0, 20)])
        if generator.random() < 0.7
        else np.array([generator.uniform(5, 95), generator.normal(0, 3), generator.normal(0, 4)])
    )
    region = None
    if alike and (clothes.region == 0).sum() > 50:
        region = 0 if generator.random() < 0.7 else None
    elif generator.random() < 0.25 and (clothes.region == 1).sum() > 50:
        region = 1
    if region is None:
        return color
    own = clothes.region == region
    return np.median(lab_of(texture[clothes.rows[own], clothes.columns[own]]), axis=0)


def dressed(
    prepared: PreparedAvatar, skin: np.ndarray, generator: np.random.Generator
) -> tuple[Outfit, float]:
    """Draw what a person wears, and the hem of the skirt on the legs (0 hip, 2 ankle; -1: none)."""
    base, clothes = prepared.avatar, prepared.clothes
    build = Build.draw(generator)
    texture = recolor(base.texture, clothes, generator)
    kind = generator.random()
    skirt, coat, shorts = kind >= 0.55, kind >= 0.85, 0.42 <= kind < 0.55
    along = generator.uniform(0.3, 1.7 if coat else 1.95)
    if skirt and not coat and generator.random() < 0.3:
        along = generator.uniform(0.12, 0.6)
    if shorts:
        along = generator.uniform(0.2, 1.9)
    heights = leg_heights(base)
    hem = float(np.interp(along, [0, 1, 2], heights))
    if shorts or (skirt and not coat and generator.random() < 0.7):
        below = texel_heights(base, clothes) < (hem if shorts else heights[0] - 0.02)
        texture = bared(texture, clothes, (clothes.region == 1) & below, skin, generator)
    if skirt:
        color = cloth_color(texture, clothes, coat, generator)
        drawn = draw_skirt(base, hem, generator, coat=coat)
        cloth = draw_cloth(texture.shape[1], max(64, len(texture) // 4), color, generator)
        base = with_skirt(base, texture, drawn, cloth)
        texture = base.texture
        prepared = PreparedAvatar(base, clothes, weld(base.skin(base.rest_transforms)))
    own = dataclasses.replace(rebuild(base, build), texture=texture)
    return Outfit(prepared, build, own, softened(texture)), along if skirt else -1.0


def make_views(studio: QuickStudio, number: int) -> tuple[list[QuickView], np.ndarray]:
    """64 views of four people in four outfits each, and the hems (64,)."""
    generator = np.random.default_rng([SETTINGS.seed, number])
    views: list[QuickView] = []
    hems: list[float] = []
    for block in range(4 * number, 4 * number + 4):
        prepared, guide = studio._person("training", block, generator)
        if prepared.avatar.name == DRESSED:
            prepared, guide = studio._person("training", block + 10007, generator)
        places = places_of(prepared, guide, canonical_places())
        hands = np.isin(
            part_map(prepared.avatar), [PARTS.index("left_hand"), PARTS.index("right_hand")]
        )
        skin = np.array([65, 12, 16.0])
        if hands.any():
            skin = lab_of(np.median(prepared.avatar.texture[hands], 0)[None])[0]
        for _ in range(4):
            outfit, hem = dressed(prepared, skin, generator)
            more = len(outfit.avatar.weights) - len(places)
            own = np.concatenate([places, np.zeros((more, 3), places.dtype)])
            while len(views) < len(hems) + 4:
                pose = draw_legs(studio, generator)
                clutter = Clutter.draw(
                    generator, things=SETTINGS.things, furniture=SETTINGS.furniture, others=0, people=[],
                    photographs=SETTINGS.photographs, backgrounds=studio._photographs,
                )  # fmt: skip
                made = quick_view(
                    outfit, guide, own, pose | clutter.grip, SETTINGS, generator, clutter
                )
                views += [made] if made is not None else []
            hems += 4 * [hem]
    return views, np.array(hems, np.float32)


def chart_of(
    view: dict[str, np.ndarray], index: int, generator: np.random.Generator | None
) -> np.ndarray:
    """The chart of a view; with a generator, with errors of fits, masks and cameras."""
    legs = view["landmarks"][index].astype(np.float64)[LEGS] * 256
    mask = view["masks"][index].astype(np.float32)
    if generator is None:
        return legs_chart(view["images"][index], mask, legs)
    height = np.linalg.norm(np.diff(legs, axis=1), axis=2).sum(1).mean() / 0.47
    legs[..., :2] += height * (
        generator.normal(0, 0.008, (2, 3, 2)) + generator.normal(0, 0.005, 2)
    )
    if generator.random() < 0.4:
        mask = np.maximum(mask, view["things"][index])
    chart = legs_chart(view["images"][index], mask, legs)
    if generator.random() < 0.5:
        chart = chart[:, :, ::-1].copy()
    generator.random()
    if generator.random() < 0.2:  # background between the legs is taken for the person
        for row in range(*sorted(generator.integers(20, 96, 2))):
            inside = np.flatnonzero(chart[3, row] > 0.5)
            if len(inside) > 2:
                chart[3, row, inside[0] : inside[-1]] = 1
    if generator.random() < 0.15:
        (row, column), (high, wide) = generator.integers(0, 96, 2), generator.integers(3, 14, 2)
        chart[3, row : row + high, column : column + wide] = generator.integers(0, 2)
    if generator.random() < 0.3:
        change = cv2.dilate if generator.random() < 0.5 else cv2.erode
        chart[3] = change(chart[3], np.ones((3, 3), np.uint8))
    colors = chart[:3]
    if generator.random() < 0.25:
        colors = colors[generator.permutation(3)]
    colors = colors ** np.exp(generator.normal(0, 0.25))
    colors = colors * np.exp(generator.normal(0, 0.12, (3, 1, 1))) + generator.normal(
        0, 0.03, (3, 1, 1)
    )
    if generator.random() < 0.3:
        colors = colors + generator.normal(0, generator.uniform(0, 0.04), colors.shape)
    if generator.random() < 0.3:
        colors = np.stack(
            [
                cv2.GaussianBlur(np.float32(one), (0, 0), generator.uniform(0.4, 1.3))
                for one in colors
            ]
        )
    chart[:3] = np.clip(colors, 0, 1)
    return chart.astype(np.float32)


def loss_of(told: tuple[Tensor, Tensor], hems: Tensor) -> Tensor:
    skirt, used = (hems > 0).float(), (PLACES > 0.1).float()
    rows = (hems[:, None] > PLACES).float() * skirt[:, None]
    cross = nn.functional.binary_cross_entropy_with_logits
    each = cross(told[1], 0.97 * rows + 0.015, reduction="none")
    return cross(told[0], 0.97 * skirt + 0.015) + (each * used).sum(1).mean() / used.sum()


def train(files: list[Path], epochs: int) -> SkirtNetwork:
    parts = [dict(np.load(path).items()) for path in files]
    views = [(part, at) for part in parts for at in range(len(part["hems"]))]
    torch.manual_seed(0)
    generator, network = np.random.default_rng(0), SkirtNetwork()
    optimizer = torch.optim.AdamW(network.parameters(), 1e-3, weight_decay=0.02)
    steps = epochs * (len(views) // 64)
    rate = torch.optim.lr_scheduler.OneCycleLR(optimizer, 4e-3, total_steps=steps)
    for _ in tqdm(range(epochs)):
        order = generator.permutation(len(views))
        for start in range(0, len(order) - 63, 64):
            chosen = [views[at] for at in order[start : start + 64]]
            charts = torch.from_numpy(np.stack([chart_of(*view, generator) for view in chosen]))
            loss = loss_of(
                network(charts), torch.tensor([float(part["hems"][at]) for part, at in chosen])
            )
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            rate.step()
    return network.eval()


def export(network: SkirtNetwork, path: Path, *, views: int) -> None:
    """Write the network as ONNX, large weights as float16."""
    round_to_stored(network)
    batch = torch.export.Dim("batch", min=1)
    with torch.no_grad():
        proto = to_onnx(
            Graph(network).eval(),
            (torch.zeros(2, 6, 96, 96),),
            ("chart",),
            ("whole", "rows"),
            [{0: batch}],
        )
    shrink(proto)
    facts = {"format": FORMAT, "license": "Apache-2.0", "views": views, "seed": SETTINGS.seed}
    save_model(proto, facts, path)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--files", type=int, default=50, help="files of 64 views")
    parser.add_argument("--epochs", type=int, default=16)
    options = parser.parse_args()
    torch.set_num_threads(1)
    (options.out / "views").mkdir(parents=True, exist_ok=True)
    paths = [options.out / "views" / f"{number:05d}.npz" for number in range(options.files)]
    if missing := [number for number, path in enumerate(paths) if not path.exists()]:
        studio = QuickStudio.open(options.out, options.data, SETTINGS)
        for number in tqdm(missing):
            views, hems = make_views(studio, number)
            names = ("image", "mask", "things", "landmarks")
            parts = {
                f"{name}s".replace("ss", "s"): np.stack([getattr(view, name) for view in views])
                for name in names
            }
            np.savez_compressed(paths[number], hems=hems, **parts)
    network = train([path for number, path in enumerate(paths) if number % 8 != 7], options.epochs)
    right = []
    for path in paths[7::8]:
        part = dict(np.load(path).items())
        with torch.no_grad():
            told = network(
                torch.from_numpy(
                    np.stack([chart_of(part, at, None) for at in range(len(part["hems"]))])
                )
            )
        right.append(((told[0] > 0).numpy() == (part["hems"] > 0)).mean())
    print(f"validation: {np.mean(right):.3f} right")
    export(network, options.out / FILE.name, views=64 * options.files)


if __name__ == "__main__":
    main()
