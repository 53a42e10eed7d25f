"""Compare the speed of motion models: training with a plain loop over frames, sampling with the
rate of the matrix products alone and with a plain PyTorch loop.

    python benchmarks/motion.py [--threads 2] [--repeats 5] [--decoder glmi-m] [--out
    out/motion_speed.json]

The plain loops are the obvious implementation, and that of the published trainer and sampler: for
every frame posterior, prior, generator and forward kinematics chain by chain and joint by joint.
They share the weights of our model, and their results are compared with ours before anything is
timed. Speed does not depend on what was learned, so weights are random and no data set is needed.

The bars: training at least 5 times the plain loop's iterations a second (batch 128, 60 frames); one
clip of 60 frames in at most 15 ms; 1,000 clips at 50 % or more of the rate of their matrix products
alone; one clip at 20 times the speed of the plain PyTorch loop; import of export/sample.py and
first sample in less than 1.5 s, without torch. Runs of ours and of the other are taken in turns,
and medians are shown, so that other work on the machine counts for both.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib.metadata
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import Tensor, nn

from a2v.io import atomic_path
from a2v.kinematics import HUMANACT12, Skeleton, forward_kinematics
from a2v.lab.datasets import ActionDataset, ClipSampler
from a2v.lab.motion.losses import gaussian_kl
from a2v.lab.motion.networks import DECODERS, GaussianGRU, VAESettings
from a2v.lab.motion.training import TrainSettings, start
from a2v.lab.motion.vae import MotionVAE
from a2v.motion import BUNDLED
from a2v.processes import python_command
from a2v.sessions import WEIGHTS
from export.motion import export_motion
from export.sample import CLIPS_AT_ONCE, Model

ROOT = Path(__file__).resolve().parent.parent
BATCH, FRAMES, CLIPS = 128, 60, 1000


# ------------------------------------------------------------------------------------------------------- the plain loops


def plain_rotmat(rotvec: Tensor) -> Tensor:
    """Rodrigues' formula for rotation vectors (B, 3)."""
    angle = torch.sqrt((rotvec * rotvec).sum(-1) + 1e-12)
    x, y, z = (rotvec / angle[:, None]).unbind(-1)
    zero = torch.zeros_like(x)
    cross = torch.stack(
        [
            torch.stack([zero, -z, y], -1),
            torch.stack([z, zero, -x], -1),
            torch.stack([-y, x, zero], -1),
        ],
        -2,
    )
    return (
        torch.eye(3)
        + torch.sin(angle)[:, None, None] * cross
        + (1 - torch.cos(angle))[:, None, None] * cross @ cross
    )


def plain_kinematics(
    rotations: Tensor, root: Tensor, lengths: Tensor, skeleton: Skeleton, rest: Tensor
) -> Tensor:
    """Joints (B, J, 3): a loop over chains, and over the joints of each."""
    joints: list[Tensor] = [root] * skeleton.n_joints
    for chain in skeleton.chains:
        turned = torch.eye(3).expand(len(root), 3, 3)
        for parent, joint in pairwise(chain):
            turned = turned @ plain_rotmat(rotations[:, joint])
            joints[joint] = joints[parent] + (turned @ rest[joint]) * lengths[:, joint, None]
    return torch.stack(joints, 1)


class PlainGaussian(nn.Module):
    """Posterior or prior, one frame at a time."""

    def __init__(self, parts: GaussianGRU) -> None:
        super().__init__()
        self.parts, self.cell = parts, plain_cell(parts.gru, 0)

    def forward(self, inputs: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Mean, log variance and state of one frame."""
        state = self.cell(self.parts.encoder(inputs), state)
        return self.parts.mu_net(state), self.parts.logvar_net(state), state


def plain_cell(gru: nn.GRU, layer: int) -> nn.GRUCell:
    """A cell with the weights of one layer."""
    cell = nn.GRUCell(getattr(gru, f"weight_ih_l{layer}").shape[1], gru.hidden_size)
    for name in ("weight_ih", "weight_hh", "bias_ih", "bias_hh"):
        getattr(cell, name).data.copy_(getattr(gru, f"{name}_l{layer}").data)
    return cell


class PlainVAE(nn.Module):
    """The papers' model as a loop over frames, with the weights of `model`."""

    def __init__(self, model: MotionVAE) -> None:
        super().__init__()
        self.model, self.skeleton, self.settings = model, model.skeleton, model.settings
        self.posterior, self.prior = PlainGaussian(model.posterior), PlainGaussian(model.prior)
        self.low, self.high = plain_cell(model.generator.gru, 0), plain_cell(model.generator.gru, 1)
        gru = model.pose_decoder.velocity_gru
        self.velocity = None if gru is None else plain_cell(gru, 0)
        self.rest = torch.from_numpy(model.skeleton.rest_directions.astype(np.float32))

    def pose(
        self, hidden: Tensor, previous: Tensor, lengths: Tensor, state: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Joints (B, J, 3) of one frame, and GLMI-R's state."""
        decoder, n = self.model.pose_decoder, self.skeleton.n_joints
        outputs = self.model.generator.decoder(hidden)
        if decoder.lie_output is None:
            return outputs.reshape(-1, n, 3), state
        bones = 3 * (n - 1)
        turns = torch.pi * torch.tanh(decoder.lie_output(outputs[:, :bones]))
        rotations = torch.cat([torch.zeros_like(turns[:, :3]), turns], -1).reshape(-1, n, 3)
        if not decoder.follows_trajectory:
            return plain_kinematics(
                rotations, outputs[:, bones:], lengths, self.skeleton, self.rest
            ), state
        local = plain_kinematics(
            rotations, torch.zeros_like(turns[:, :3]), lengths, self.skeleton, self.rest
        )
        inputs = torch.cat(
            [local.flatten(1), (previous - previous[:, :1]).flatten(1), outputs[:, bones:]], -1
        )
        if self.velocity is not None:
            state = inputs = self.velocity(decoder.velocity_in(inputs), state)
        assert decoder.velocity_net is not None
        return local + (previous[:, 0] + decoder.velocity_net(inputs))[:, None], state

    def forward(
        self,
        joints: Tensor | None,
        actions: Tensor,
        lengths: Tensor,
        noise: Tensor,
        *,
        forced: bool = False,
    ) -> tuple[Tensor, Tensor]:
        """Joints (B, T, J, 3) and the mean KL term; without real `joints` z comes from the prior
        (sampling)."""
        batch, frames = noise.shape[:2]
        size = self.settings.hidden_size
        posterior, prior, low, high, velocity = (noise.new_zeros(batch, size) for _ in range(5))
        previous = noise.new_zeros(batch, self.skeleton.n_joints, 3)
        poses, divergence = [], noise.new_zeros(())
        for t in range(frames):
            condition = torch.cat([actions, noise.new_full((batch, 1), (t + 1) / frames)], -1)
            context = torch.cat([previous.flatten(1), condition], -1)
            prior_mean, prior_logvar, prior = self.prior(context, prior)
            mean, logvar = prior_mean, prior_logvar
            if joints is not None:
                mean, logvar, posterior = self.posterior(
                    torch.cat([joints[:, t].flatten(1), condition], -1), posterior
                )
                divergence = divergence + gaussian_kl(mean, logvar, prior_mean, prior_logvar).mean()
            latent = mean + torch.exp(0.5 * logvar) * noise[:, t]
            low = self.low(self.model.generator.encoder(torch.cat([context, latent], -1)), low)
            high = self.high(low, high)
            pose, velocity = self.pose(high, previous, lengths, velocity)
            poses.append(pose)
            previous = joints[:, t] if forced and joints is not None else pose
        return torch.stack(poses, 1), divergence / frames


def plain_train_step(
    plain: PlainVAE,
    optimizers: list[torch.optim.Optimizer],
    batch: tuple[Tensor, ...],
    forced: bool,
) -> None:
    """One iteration as published: a loss per frame, three optimizers, the whole batch with or
    without teacher forcing."""
    joints, actions, lengths, noise = batch
    for optimizer in optimizers:
        optimizer.zero_grad()
    made, divergence = plain(joints, actions, lengths, noise, forced=forced)
    loss = (
        sum(((made[:, t] - joints[:, t]) ** 2).mean() for t in range(joints.shape[1]))
        / joints.shape[1]
        + 0.01 * divergence
    )
    loss.backward()
    for optimizer in optimizers:
        optimizer.step()


# ------------------------------------------------------------------------------------------------------------- measuring


CLOCKS: dict[str, Callable[[], float]] = {"wall": time.perf_counter, "cpu": time.process_time}


def in_turns(
    works: dict[str, Callable[[], object]], repeats: int, clock: str
) -> dict[str, list[float]]:
    """Return the seconds of each task. The tasks run in turns, after one run of each that does not
    count."""
    for work in works.values():
        work()
    now = CLOCKS[clock]
    seconds: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(repeats):
        for name, work in works.items():
            began = now()
            work()
            seconds[name].append(now() - began)
    return seconds


def dataset_like_humanact12() -> ActionDataset:
    """Return clips of 60 frames with 24 joints and 12 actions, of any content."""
    generator = np.random.default_rng(0)
    lengths = np.full(24, 0.25)
    clips = []
    for _ in range(200):
        turns = np.cumsum(generator.normal(scale=0.05, size=(FRAMES, 24, 3)), axis=0)
        root = np.cumsum(generator.normal(scale=0.02, size=(FRAMES, 3)), axis=0)
        clips.append(forward_kinematics(turns, root, lengths, HUMANACT12).astype(np.float32))
    names = tuple(map(str, range(len(clips))))
    return ActionDataset(
        name="benchmark",
        skeleton=HUMANACT12,
        actions=tuple(f"action {i}" for i in range(12)),
        joints=tuple(clips),
        labels=np.arange(len(clips)) % 12,
        clip_names=names,
        subjects=names,
        fps=20.0,
        length=FRAMES,
    )


def batch_of(
    dataset: ActionDataset, model: MotionVAE, size: int
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Joints, actions, bone lengths and noise."""
    generator = np.random.default_rng(1)
    joints, labels, lengths = ClipSampler(dataset, FRAMES).batch(size, generator)
    noise = generator.standard_normal((size, FRAMES, model.settings.latent_size), dtype=np.float32)
    actions = torch.eye(model.n_actions)[torch.from_numpy(labels)]
    return torch.from_numpy(joints), actions, torch.from_numpy(lengths), torch.from_numpy(noise)


def demand_equal(ours: Tensor, plain: Tensor, what: str) -> float:
    """Return the largest difference; the times are comparable only if the loops compute the
    same."""
    difference = float((ours - plain).abs().max())
    if difference > 2e-3:
        raise SystemExit(
            f"{what}: the plain loop differs by {difference:.2g}; it is not the same model"
        )
    return difference


def training(options: argparse.Namespace) -> dict[str, Any]:
    """Return iterations per second of our training and of the plain loop."""
    dataset = dataset_like_humanact12()
    settings = TrainSettings(batch_size=BATCH, length=FRAMES, device="cpu", iterations=10**6)
    vae = VAESettings(decoder=options.decoder)
    state = start(dataset, vae, settings)
    plain = PlainVAE(state.model)
    batch = batch_of(dataset, state.model, BATCH)
    with torch.no_grad():
        difference = 0.0
        for forced in (True, False):
            made, _ = plain(*batch, forced=forced)
            ours = state.model.reconstruct(*batch, torch.full((BATCH,), forced)).pose.joints
            difference = max(difference, demand_equal(ours, made, "training"))
    groups = [
        [plain.posterior],
        [plain.prior],
        [plain.low, plain.high, plain.model.generator, plain.model.pose_decoder],
    ]
    optimizers: list[torch.optim.Optimizer] = [
        torch.optim.Adam(
            {id(p): p for part in group for p in part.parameters()}.values(),
            lr=2e-4,
            weight_decay=1e-5,
        )
        for group in groups
    ]

    def ours(**changes: Any) -> None:
        chosen = dataclasses.replace(settings, **changes)
        with chosen.products():
            state.settings = chosen
            state.step()
            state.iteration += 1

    works: dict[str, Callable[[], object]] = {
        "plain loop": lambda: plain_train_step(plain, optimizers, batch, False),
        "ours, p_tf 0.6": ours,
        "ours, p_tf 0.6, products by MKL": lambda: ours(quick_products=False),
        "ours, all teacher-forced": lambda: ours(teacher_forcing=1.0),
    }
    return {
        "seconds": in_turns(works, options.repeats, options.clock),
        "largest_difference": difference,
    }


def exported(decoder: str, folder: Path) -> tuple[MotionVAE, Path]:
    """A model with random weights and its ONNX file."""
    dataset = dataset_like_humanact12()
    state = start(dataset, VAESettings(decoder=decoder), TrainSettings(device="cpu"))  # type: ignore[arg-type]
    path = folder / f"{decoder}.onnx"
    export_motion(state.model, dataset, path, license="none")
    return state.model.eval(), path


PROBE = 101
"""Clips of the run in which products are counted: a prime above every small size, so that it tells
rows of clips from columns."""


def matrix_products(path: Path, threads: int) -> Counter[tuple[int, int, int]]:
    """Return how often one run computes each product of (rows per clip, inner size, columns) with a
    matrix that is the same for all clips. The numbers are from onnxruntime's profile of a run,
    after its optimizations.
    """
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads, options.enable_profiling = threads, True
    found: Counter[tuple[int, int, int]] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        options.profile_file_prefix = str(Path(folder) / "products")
        model = Model(path, threads=threads)
        model.session = onnxruntime.InferenceSession(
            str(path), options, providers=["CPUExecutionProvider"]
        )
        model.sample(model.metadata["actions"][0], FRAMES, PROBE)
        events = json.loads(Path(model.session.end_profiling()).read_text())
    for event in events:
        about = event.get("args", {})
        if not event["name"].endswith("kernel_time") or about.get("op_name") not in (
            "MatMul",
            "Gemm",
            "FusedGemm",
            "FusedMatMul",
        ):
            continue
        # weights that are laid out beforehand are not in the record
        first, result = (
            next(iter(about[f"{side}_type_shape"][0].values())) for side in ("input", "output")
        )
        rows = int(np.prod(result[:-1]))
        if rows % PROBE == 0 and result[-1] % PROBE:
            found[rows // PROBE, first[-1], result[-1]] += 1
    return found


def products_session(
    products: Counter[tuple[int, int, int]], clips: int, threads: int
) -> Callable[[], object]:
    """One onnxruntime graph of only these products, each as often as it was counted, for the
    sampler's number of clips.

    Results are written to the same place each time, and nothing is optimized away: the products are
    all that is timed.
    """
    import onnxruntime

    generator = np.random.default_rng(0)
    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads = threads
    settings.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_DISABLE_ALL
    parts = -(-clips // CLIPS_AT_ONCE)
    nodes, weights, places = [], [], {}
    for kind, ((rows, inner, columns), times) in enumerate(products.items()):
        shapes = {
            f"x{kind}": [clips // parts * rows, inner],
            f"y{kind}": [clips // parts * rows, columns],
        }
        places |= {
            name: generator.standard_normal(shape, dtype=np.float32)
            for name, shape in shapes.items()
        }
        weights.append(
            numpy_helper.from_array(
                generator.standard_normal((inner, columns), dtype=np.float32), f"w{kind}"
            )
        )
        nodes += [
            helper.make_node("MatMul", [f"x{kind}", f"w{kind}"], [f"y{kind}_{time}"])
            for time in range(times)
        ]

    def value(name: str) -> onnx.ValueInfoProto:
        return helper.make_tensor_value_info(
            name, TensorProto.FLOAT, places[name.partition("_")[0]].shape
        )

    inputs, outputs = (
        [name for name in places if name.startswith("x")],
        [node.output[0] for node in nodes],
    )
    graph = helper.make_graph(
        nodes, "products", list(map(value, inputs)), list(map(value, outputs)), initializer=weights
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=10)
    session = onnxruntime.InferenceSession(
        model.SerializeToString(), settings, providers=["CPUExecutionProvider"]
    )
    binding, stored = (
        session.io_binding(),
        {name: onnxruntime.OrtValue.ortvalue_from_numpy(array) for name, array in places.items()},
    )
    for name in inputs:
        binding.bind_ortvalue_input(name, stored[name])
    for name in outputs:
        binding.bind_ortvalue_output(name, stored[name.partition("_")[0]])

    def work() -> None:
        for _ in range(parts):
            session.run_with_iobinding(binding)

    return work


def sampling(options: argparse.Namespace) -> dict[str, Any]:
    """Measure one clip and 1,000 clips of the shipped models and of the papers' model."""
    results: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        vae, vae_path = exported(options.decoder, Path(folder))
        plain = PlainVAE(vae)
        files = {f"shipped {name}": WEIGHTS / file for name, file in BUNDLED.items()} | {
            f"VAE {options.decoder}": vae_path
        }
        for name, path in files.items():
            model = Model(path, threads=options.threads)
            action = model.metadata["actions"][0]
            counted = matrix_products(path, options.threads)
            stated = sum(
                2 * CLIPS * rows * inner * columns * times
                for (rows, inner, columns), times in counted.items()
            )
            products = products_session(counted, CLIPS, options.threads)
            one = in_turns(
                {"one": lambda: model.sample(action, FRAMES, 1)},  # noqa: B023
                max(20, options.repeats),
                options.clock,
            )["one"]
            many = in_turns(
                {
                    "clips": lambda: model.sample(action, FRAMES, CLIPS),  # noqa: B023
                    "products": products,
                },
                options.repeats,
                options.clock,
            )
            results[name] = {
                "one_clip": one,
                "clips": many["clips"],
                "products": many["products"],
                "flop": stated,
            }
        noise = torch.randn(1, FRAMES, vae.settings.latent_size)
        actions, lengths = (
            torch.eye(vae.n_actions)[:1],
            torch.full((1, vae.skeleton.n_joints), 0.25),
        )
        with torch.no_grad():
            ours = vae.sample(actions[:, None].expand(-1, FRAMES, -1), lengths, noise).joints
            difference = demand_equal(ours, plain(None, actions, lengths, noise)[0], "sampling")
            loop = in_turns(
                {"loop": lambda: plain(None, actions, lengths, noise)},
                options.repeats,
                options.clock,
            )["loop"]
    return {"models": results, "plain_loop_one_clip": loop, "largest_difference": difference}


FIRST = """
import sys, time
began = time.perf_counter()
sys.path.insert(0, {folder!r})
import sample
model = sample.Model({model!r}, threads={threads})
model.sample(model.metadata["actions"][0])
print(time.perf_counter() - began, "torch" in sys.modules)
"""


def first_sample(options: argparse.Namespace) -> dict[str, Any]:
    """Return the seconds of import and first sample of export/sample.py in new processes, without
    and with the interpreter's start."""
    results: dict[str, Any] = {}
    for name, file in BUNDLED.items():
        inside, whole, torch_there = [], [], False
        for _ in range(max(3, options.repeats)):
            code = FIRST.format(
                folder=str(ROOT / "export"), model=str(WEIGHTS / file), threads=options.threads
            )
            began = time.perf_counter()
            shown = subprocess.run(
                python_command(code),
                capture_output=True,
                text=True,
                check=True,
                cwd=tempfile.gettempdir(),
            )
            whole.append(time.perf_counter() - began)
            seconds, there = shown.stdout.split()
            inside.append(float(seconds))
            torch_there |= there == "True"
        results[f"shipped {name}"] = {
            "seconds": inside,
            "whole_process": whole,
            "torch": torch_there,
        }
    return results


# --------------------------------------------------------------------------------------------------------------- printing


def middle(values: list[float]) -> float:
    """Median."""
    return float(np.median(values))


def spread(values: list[float], factor: float = 1.0, digits: str = ".3g") -> str:
    """Median and range."""
    low, mid, high = np.min(values) * factor, np.median(values) * factor, np.max(values) * factor
    return f"{mid:{digits}} ({low:{digits}}–{high:{digits}})"


def tables(results: dict[str, Any], options: argparse.Namespace) -> str:
    """Everything as Markdown."""
    machine = results["machine"]
    lines = [
        f"{machine['processor']}, {options.threads} thread{'s' if options.threads > 1 else ''}; "
        f"torch {machine['torch']}, onnxruntime "
        f"{machine['onnxruntime']}; {'CPU seconds' if options.clock == 'cpu' else 'wall clock'}, "
        f"medians (least–most) of {options.repeats} runs in turns; load average before: "
        f"{machine['load']:.1f}",
        "",
    ]
    if "training" in results:
        seconds = results["training"]["seconds"]
        base = middle(seconds["plain loop"])
        lines += [
            f"Training of {options.decoder}, batch {BATCH}, {FRAMES} frames (largest difference of "
            f"the poses {results['training']['largest_difference']:.1g}):",
            "",
            "| | s an iteration | iterations/s | × plain loop |",
            "|---|---|---|---|",
        ]
        lines += [
            f"| {name} | {spread(values)} | {1 / middle(values):.3g} | {base / middle(values):.1f} "
            "|"
            for name, values in seconds.items()
        ]
        lines.append("")
    if "sampling" in results:
        loop = middle(results["sampling"]["plain_loop_one_clip"])
        lines += [
            f"Sampling of {FRAMES} frames with onnxruntime; a plain PyTorch loop over frames, "
            "chains and joints takes "
            f"{spread(results['sampling']['plain_loop_one_clip'], 1000)} ms for one clip of "
            f"{options.decoder}:",
            "",
            f"| | one clip, ms | × plain loop | {CLIPS:,} clips, s | GFLOP/s | products alone, s | "
            "GFLOP/s | share of that rate |",
            "|---|---|---|---|---|---|---|---|",
        ]
        for name, row in results["sampling"]["models"].items():
            clips, products = middle(row["clips"]), middle(row["products"])
            lines.append(
                f"| {name} | {spread(row['one_clip'], 1000)} | "
                f"{loop / middle(row['one_clip']):.0f} | {spread(row['clips'])} | "
                f"{row['flop'] / clips / 1e9:.1f} | {spread(row['products'])} | "
                f"{row['flop'] / products / 1e9:.1f} | {100 * products / clips:.0f} % |"
            )
        lines.append("")
    if "first_sample" in results:
        lines += [
            "export/sample.py in a new process, import and first sample:",
            "",
            "| | s | whole process, s | torch in the process |",
            "|---|---|---|---|",
        ]
        lines += [
            f"| {name} | {spread(row['seconds'])} | {spread(row['whole_process'])} | "
            f"{'yes' if row['torch'] else 'no'} |"
            for name, row in results["first_sample"].items()
        ]
        lines.append("")
    return "\n".join(lines)


def processor() -> str:
    """The CPU's name."""
    try:
        names = [
            line.split(":", 1)[1].strip()
            for line in Path("/proc/cpuinfo").read_text().splitlines()
            if line.startswith("model name")
        ]
    except OSError:
        names = []
    return names[0] if names else platform.machine()


def main() -> int:
    """Run and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument(
        "--clock",
        choices=list(CLOCKS),
        default="wall",
        help="cpu counts this process alone: with --threads 1, for a machine that is busy",
    )
    parser.add_argument(
        "--decoder", choices=DECODERS, default="glmi-m", help="of the papers' model"
    )
    parser.add_argument("--only", choices=["training", "sampling", "first_sample"], default=None)
    parser.add_argument("--out", type=Path, default=None, help="also write every time as .json")
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    torch.manual_seed(0)
    results: dict[str, Any] = {
        "machine": {
            "processor": processor(),
            "cores": os.cpu_count(),
            "load": os.getloadavg()[0],
            "torch": str(torch.__version__),
            "onnxruntime": importlib.metadata.version("onnxruntime"),
        }
    }
    for name, measure in (
        ("first_sample", first_sample),
        ("sampling", sampling),
        ("training", training),
    ):
        if options.only in (None, name):
            results[name] = measure(options)
    print(tables(results, options))
    if options.out is not None:
        with atomic_path(options.out) as temporary:
            temporary.write_text(
                json.dumps(
                    {name: value for name, value in vars(options).items() if name != "out"}
                    | results,
                    indent=1,
                )
                + "\n"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
