"""Checkpoints in the layouts of PIFu, PIFuHD, PaMIR and Liquid Warping GAN.

Every name and shape is spelled out; weights are random or chosen.
"""

from __future__ import annotations

import argparse
import itertools
from pathlib import Path

import torch
from torch import Tensor

State = dict[str, Tensor]


class Writer:
    """Names tensors; `weights` are small random numbers, biases 0, norms 1 and 0."""

    def __init__(self, seed: int = 0) -> None:
        self.state: State = {}
        self.draws = torch.Generator().manual_seed(seed)

    def conv(
        self, name: str, *shape: int, bias: bool = True, scale: float = 0.05, outputs: int = 0
    ) -> None:
        self.state[f"{name}.weight"] = scale * torch.randn(*shape, generator=self.draws)
        if bias:
            self.state[f"{name}.bias"] = torch.zeros(outputs or shape[0])

    def norm(self, name: str, width: int) -> None:
        self.state[f"{name}.weight"], self.state[f"{name}.bias"] = (
            torch.ones(width),
            torch.zeros(width),
        )

    def block(self, name: str, before: int, after: int) -> None:
        half, quarter = after // 2, after // 4
        for index, (inputs, outputs) in enumerate(
            ((before, half), (half, quarter), (quarter, quarter)), 1
        ):
            self.conv(f"{name}.conv{index}", outputs, inputs, 3, 3, bias=False)
            self.norm(f"{name}.bn{index}", inputs)
        self.norm(f"{name}.bn4", before)
        if before != after:
            self.norm(f"{name}.downsample.0", before)
            self.conv(f"{name}.downsample.2", after, before, 1, 1, bias=False)

    def hourglasses(
        self, prefix: str, *, inputs: int, stacks: int, features: int, depth: int = 2
    ) -> None:
        self.conv(f"{prefix}conv1", 64, inputs, 7, 7)
        self.norm(f"{prefix}bn1", 64)
        for name, before, after in (("conv2", 64, 128), ("conv3", 128, 128), ("conv4", 128, 256)):
            self.block(prefix + name, before, after)
        for index in range(stacks):
            for level in range(1, depth + 1):
                for name in ("b1", "b2", "b3", *(("b2_plus",) if level == 1 else ())):
                    self.block(f"{prefix}m{index}.{name}_{level}", 256, 256)
            self.block(f"{prefix}top_m_{index}", 256, 256)
            self.conv(f"{prefix}conv_last{index}", 256, 256, 1, 1)
            self.norm(f"{prefix}bn_end{index}", 256)
            self.conv(f"{prefix}l{index}", features, 256, 1, 1)
            if index < stacks - 1:
                self.conv(f"{prefix}bl{index}", 256, 256, 1, 1)
                self.conv(f"{prefix}al{index}", 256, features, 1, 1)

    def points(
        self,
        prefix: str,
        widths: tuple[int, ...],
        again: tuple[int, ...],
        style: str = "conv",
        norms: bool = False,
    ) -> None:
        for index, (before, after) in enumerate(itertools.pairwise(widths)):
            self.conv(f"{prefix}{style}{index}", after, before + widths[0] * (index in again), 1)
            if norms and index < len(widths) - 2:
                self.norm(f"{prefix}norms.{index}", after)

    def residual(
        self,
        prefix: str,
        *,
        inputs: int,
        width: int,
        halvings: int,
        blocks: int,
        outputs: int = 0,
        learned: bool = False,
    ) -> None:
        """A residual network with `outputs`: PIFuHD's normals, or PIFu's colors if `learned`.

        PIFu's has group norms and no biases.
        """
        self.conv(f"{prefix}model.1", width, inputs, 7, 7, bias=not learned)
        at = 1
        for step in range(halvings + 1):
            if step:
                self.conv(f"{prefix}model.{at}", 2 * width, width, 3, 3, bias=not learned)
                width *= 2
            if learned:
                self.norm(f"{prefix}model.{at + 1}", width)
            at += 3
        for block in range(blocks):
            for conv in (1, 5):
                self.conv(
                    f"{prefix}model.{at}.conv_block.{conv}", width, width, 3, 3, bias=not learned
                )
                if learned and (conv == 1 or outputs or block < blocks - 1):
                    self.norm(f"{prefix}model.{at}.conv_block.{conv + 1}", width)
            at += 1
        if outputs:
            for _ in range(halvings):
                self.conv(f"{prefix}model.{at}", width, width // 2, 3, 3, outputs=width // 2)
                width //= 2
                at += 3
            self.conv(f"{prefix}model.{at + 1}", outputs, width, 7, 7)


PIFU_WIDTHS = (257, 1024, 512, 256, 128, 1)
NARROW = (257, 8, 8, 8, 8, 1)
"""Widths of point layers if many points are evaluated."""


def pifu_geometry(stacks: int = 4, widths: tuple[int, ...] = PIFU_WIDTHS, seed: int = 0) -> State:
    """``net_G``."""
    writer = Writer(seed)
    writer.hourglasses("image_filter.", inputs=3, stacks=stacks, features=256)
    writer.points("surface_classifier.", widths, (1, 2, 3, 4))
    return writer.state


def pifu_color(widths: tuple[int, ...] = (513, 1024, 512, 256, 128, 3), seed: int = 1) -> State:
    """``net_C``."""
    writer = Writer(seed)
    writer.residual("image_filter.", inputs=3, width=64, halvings=2, blocks=6, learned=True)
    writer.points("surface_classifier.", widths, (1, 2, 3, 4))
    return writer.state


def pifuhd(
    *, stacks: int = 4, normals: int = 64, blocks: int = 9, seed: int = 2
) -> dict[str, object]:
    """PIFuHD's file; `normals` is the first width of the networks of normals."""
    writer = Writer(seed)
    for side in ("netF", "netB"):
        writer.residual(
            f"netG.{side}.", inputs=3, width=normals, halvings=4, blocks=blocks, outputs=3
        )
    writer.hourglasses("netG.image_filter.", inputs=9, stacks=stacks, features=256)
    writer.points("netG.mlp.", PIFU_WIDTHS, (2, 3, 4), "filters.", norms=True)
    writer.hourglasses("image_filter.", inputs=6, stacks=1, features=16)
    writer.points("mlp.", (272, 512, 256, 128, 1), (1, 2), "filters.", norms=True)
    options = argparse.Namespace(loadSizeBig=1024, loadSizeLocal=512)
    return {"model_state_dict": writer.state, "opt": options, "opt_netG": options, "epoch": 9}


def _pamir_points(writer: Writer, widths: tuple[int, ...]) -> None:
    for index, (before, after) in enumerate(itertools.pairwise(widths)):
        again = widths[0] if 0 < index < len(widths) - 2 else 0
        writer.conv(f"mlp.conv{index}.0", after, before + again, 1, 1)


def _pamir_volume(writer: Writer) -> None:
    for name, after, before in (("conv1", 8, 3), ("conv2", 32, 8)):
        writer.conv(f"ve.{name}", after, before, 5, 5, 5)
    writer.norm("ve.bn1", 8)
    writer.norm("ve.bn2", 32)
    for name in ("conv_out1", "conv_out2"):
        writer.conv(f"ve.{name}", 32, 32, 3, 3, 3)
    for block in ("r1", "r2", "r3"):
        _pamir_wide(writer, f"ve.{block}", 32, 3, 3, 3)


def _pamir_wide(writer: Writer, name: str, width: int, *kernel: int) -> None:
    for part in ("bn", "bn1", "bn2"):
        writer.norm(f"{name}.{part}", width)
    for part in ("conv1", "conv2", "conv3"):
        writer.conv(f"{name}.{part}", width, width, *kernel)


def pamir_geometry(
    stacks: int = 4,
    modules: int = 3,
    depth: int = 4,
    widths: tuple[int, ...] = (288, 1024, 512, 256, 128, 1),
) -> State:
    """``pamir_net``."""
    writer = Writer(4)

    def block(name: str, before: int, after: int) -> None:
        writer.norm(f"hg.{name}.bn", before)
        writer.norm(f"hg.{name}.bn2", after // 2)
        writer.conv(f"hg.{name}.conv1", after // 2, before, 3, 3)
        writer.conv(f"hg.{name}.conv3", after, after // 2, 3, 3)
        if before != after:
            writer.conv(f"hg.{name}.conv4", after, before, 1, 1)

    writer.conv("hg.conv1_", 64, 3, 7, 7)
    writer.norm("hg.bn1", 64)
    for name, before in (("r1", 64), ("r4", 128), ("r5", 128)):
        block(name, before, 128)
    for stack in range(stacks):
        for level in range(depth):
            inner = f"hourglass.{stack}." + level * "low2."
            for index in range(modules):
                for part in ("up1_", "low1_", "low3_", *(("low2_",) if level == depth - 1 else ())):
                    block(f"{inner}{part}.{index}", 128, 128)
        for index in range(modules):
            block(f"Residual.{stack * modules + index}", 128, 128)
        writer.conv(f"hg.lin_.{stack}.0", 128, 128, 1, 1)
        writer.norm(f"hg.lin_.{stack}.1", 128)
        writer.conv(f"hg.tmpOut.{stack}", 256, 128, 1, 1)
        if stack < stacks - 1:
            writer.conv(f"hg.ll_.{stack}", 128, 128, 1, 1)
            writer.conv(f"hg.tmpOut_.{stack}", 128, 256, 1, 1)
    _pamir_volume(writer)
    _pamir_points(writer, widths)
    return writer.state


def pamir_texture(widths: tuple[int, ...] = (544, 1024, 512, 256, 128, 4)) -> State:
    """``pamir_tex_net``."""
    writer = Writer(5)
    for index, (after, before, kernel) in enumerate(((64, 3, 7), (128, 64, 3), (256, 128, 3)), 1):
        writer.conv(f"cg.conv{index}", after, before, kernel, kernel)
        writer.norm(f"cg.bn{index}", after)
    for index in range(1, 7):
        _pamir_wide(writer, f"cg.r{index}", 256, 3, 3)
    _pamir_volume(writer)
    _pamir_points(writer, widths)
    return writer.state


def saved(content: object, path: Path) -> str:
    """Write `content` to a file and return its path."""
    torch.save(content, path)
    return str(path)


def slab(front: float, back: float, inside: float) -> State:
    """``net_G`` of a slab: bright pixels between two depths are the person.

    The depths `back` and `front` are in the network's units.

    Blocks without their convolutions pass on what they are given, so the features are the blurred
    picture: `inside` is their value there.
    """
    state = {
        name: torch.zeros_like(value) if value.ndim > 1 else value
        for name, value in pifu_geometry(1, NARROW).items()
    }
    for index in range(64):  # each channel beside its negative: group norms then only scale
        state["image_filter.conv1.weight"][index, 0, 3, 3] = 1 - 2 * (index % 2)
    for name, before in (("conv2", 64), ("conv4", 128)):
        state[f"image_filter.{name}.downsample.2.weight"].fill_(1 / before)
    for name in ("conv_last0", "l0"):
        state[f"image_filter.{name}.weight"] = torch.eye(256)[:, :, None, None]
    point = {name: value for name, value in state.items() if name.startswith("surface_classifier")}
    for value in point.values():
        value.zero_()
    first, bias = point["surface_classifier.conv0.weight"], point["surface_classifier.conv0.bias"]
    first[0, 0, 0], bias[0] = 1, -inside / 2  # bright
    first[3, 0, 0], bias[3] = (
        -1,
        inside / 2,
    )  # dark: the difference of both is linear, whatever the rectifier leaks
    first[1, 256, 0], bias[1] = 1, -front  # before the front
    first[2, 256, 0], bias[2] = -1, back  # behind the back
    second = point["surface_classifier.conv1.weight"]
    second[0, 0, 0], second[0, 3, 0], second[0, 1:3, 0] = 16 / inside, -16 / inside, -800
    for index in (2, 3, 4):
        point[f"surface_classifier.conv{index}.weight"][0, 0, 0] = 1
    point["surface_classifier.conv1.bias"][0], point["surface_classifier.conv4.bias"][0] = (
        100,
        -100,
    )  # on the way nothing is negative
    return state


def liquid_warping(
    *, width: int = 8, depth: int = 3, blocks: int = 2, inputs: int = 6, seed: int = 3
) -> State:
    """Liquid Warping GAN's ``net_epoch_30_id_G.pth``, by default of a small width.

    In the published file `width` is 64 and there are 6 blocks.
    """
    writer = Writer(seed)

    def normed(name: str, *shape: int, at: int = 0, outputs: int = 0) -> None:
        writer.conv(f"{name}.{at}", *shape, bias=False)
        writer.norm(f"{name}.{at + 1}", outputs or shape[0])

    def block(name: str, wide: int) -> None:
        for at in (0, 3):
            normed(f"{name}.main", wide, wide, 3, 3, at=at)

    wide = width * 2**depth
    normed("bg_model.model", width, 4, 7, 7)
    for level in range(depth):
        normed("bg_model.model", width * 2 ** (level + 1), width * 2**level, 3, 3, at=3 + 3 * level)
    first = 3 + 3 * depth
    for index in range(blocks):
        block(f"bg_model.model.{first + index}", wide)
    for level in range(depth):
        near = wide // 2**level
        normed(
            "bg_model.model",
            near,
            near // 2,
            3,
            3,
            at=first + blocks + 3 * level,
            outputs=near // 2,
        )
    writer.conv(f"bg_model.model.{first + blocks + 3 * depth}", 3, width, 7, 7, bias=False)
    for stream in ("src_model", "tsf_model"):
        normed(f"{stream}.encoders.0", width, inputs, 7, 7)
        for level in range(depth):
            normed(
                f"{stream}.encoders.{level + 1}", width * 2 ** (level + 1), width * 2**level, 3, 3
            )
            near = wide // 2**level
            normed(f"{stream}.decoders.{level}", near, near // 2, 3, 3, outputs=near // 2)
            normed(f"{stream}.skippers.{level}", near // 2, near, 3, 3)
        for index in range(blocks):
            block(f"{stream}.resnets.{index}", wide)
        writer.conv(f"{stream}.img_reg.0", 3, width, 7, 7, bias=False)
        writer.conv(f"{stream}.attetion_reg.0", 1, width, 7, 7, bias=False)
    return writer.state
