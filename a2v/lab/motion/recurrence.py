"""Sequences whose own poses are fed back: the roll-out, and the gradient through the feedback.

Training a sequence without teacher forcing needs two passes frame by frame: a forward pass for the
poses that are fed back, and a backward pass, since a pose's gradient includes that of the next
frame. Both are implemented here, and compute only that. All other gradients (of weights, latents,
prior) come from a parallel pass over all frames, which uses the rolled-out poses like real ones.
With the complete gradient with respect to each pose, it gives the gradients of the whole
recurrence.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn

from a2v.kinematics.gradient import (
    Exponentials,
    bone_ends,
    bone_gradients,
    chain_frames,
    cross_matrices,
    joint_positions,
    rotvec_axes,
    rotvec_gradients,
)
from a2v.lab.motion.fused import (
    generator_entry,
    generator_exit,
    gru_inputs,
    gru_state,
    velocity_layers,
)
from a2v.lab.motion.networks import Generator, PoseDecoder

_tanh_back = torch.ops.aten.tanh_backward.grad_input
_sigmoid_back = torch.ops.aten.sigmoid_backward.grad_input


class GRUTrace:
    """One layer's pass over T frames, stored so that gradients can be propagated back frame by
    frame.

    Parameters
    ----------
    weight, bias : (3H, H), (3H,)
        Weight and bias of the state: nn.GRU's ``weight_hh`` and ``bias_hh`` (gates reset,
        update, candidate).
    frames, batch : int
    """

    def __init__(self, weight: Tensor, bias: Tensor, *, frames: int, batch: int) -> None:
        size = weight.shape[1]
        self.size, self.bias = size, bias
        self.states = weight.new_zeros(frames + 1, batch, size)
        self._forth, self._back = weight.T, torch.cat([weight[2 * size :], weight[: 2 * size]])
        self._products = weight.new_empty(frames, batch, 3 * size)
        self._gates = weight.new_empty(frames, batch, 2 * size)
        self._candidates = weight.new_empty(frames, batch, size)
        self._carried = torch.zeros_like(self.states[0])

    def step(self, frame: int, inputs: Tensor) -> Tensor:
        """Return the new state (B, H) at `frame`, given ``weight_ih @ x + bias_ih`` (B, 3H)."""
        both, state, product, gates = (
            2 * self.size,
            self.states[frame],
            self._products[frame],
            self._gates[frame],
        )
        torch.addmm(self.bias, state, self._forth, out=product)
        torch.add(inputs[:, :both], product[:, :both], out=gates).sigmoid_()
        reset, update = gates.chunk(2, 1)
        candidate = torch.addcmul(
            inputs[:, both:], reset, product[:, both:], out=self._candidates[frame]
        ).tanh_()
        return torch.lerp(candidate, state, update, out=self.states[frame + 1])

    def back(self, frame: int, gradient: Tensor) -> Tensor:
        """Return the gradient (B, 3H) with respect to the inputs of `frame`.

        `gradient` (B, H) is the gradient with respect to the state of `frame` from other layers.
        Call this once per frame, from the last to the first.
        """
        size, candidate = self.size, self._candidates[frame]
        reset, update = self._gates[frame].chunk(2, 1)
        # the state's part and the inputs' part are one slice each
        result = gradient.new_empty(len(gradient), 4 * size)
        by_product, by_reset, by_update, by_candidate = result.chunk(4, 1)
        gradient = self._carried.add_(gradient)
        kept = gradient * update
        _tanh_back(gradient - kept, candidate, grad_input=by_candidate)
        torch.mul(by_candidate, reset, out=by_product)
        _sigmoid_back(
            by_candidate * self._products[frame, :, 2 * size :], reset, grad_input=by_reset
        )
        _sigmoid_back((self.states[frame] - candidate).mul_(gradient), update, grad_input=by_update)
        torch.addmm(kept, result[:, : 3 * size], self._back, out=self._carried)
        return result[:, size:]


class RollOut:
    """Poses of sequences whose generated poses are fed back.

    Parameters
    ----------
    generator : Generator
    decoder : PoseDecoder
    condition : (B, T, A + 1)
        Action and time counter.
    latent : (B, T, Z)
    lengths : (B, J)
        Bone lengths, native units.

    Attributes
    ----------
    joints : (B, T, J, 3)
        The poses, without a graph.
    """

    @torch.no_grad()
    def __init__(
        self,
        generator: Generator,
        decoder: PoseDecoder,
        condition: Tensor,
        *,
        latent: Tensor,
        lengths: Tensor,
    ) -> None:
        self.decoder, (batch, self.frames) = decoder, latent.shape[:2]
        self.pose_size = size = 3 * decoder.skeleton.n_joints
        self.layers = [
            GRUTrace(*gru_state(generator.gru, layer), frames=self.frames, batch=batch)
            for layer in range(2)
        ]
        self.between, between_bias = gru_inputs(generator.gru, 1)
        entry, entry_bias = generator_entry(generator, decoder)
        self.entry = entry[:, :size].contiguous()
        known = (
            nn.functional.linear(torch.cat([condition, latent], -1), entry[:, size:], entry_bias)
            .transpose(0, 1)
            .contiguous()
        )
        self.exit, offset = generator_exit(generator, decoder)
        self.plan = decoder.plan
        if decoder.lie_output is not None:
            self.turns, self.bones = decoder.turns, size - 3
            self.lengths = lengths.T[self.plan.joints]
        if decoder.follows_trajectory:
            self.hidden, self.last, self.leak = velocity_layers(decoder)
        if decoder.velocity_gru is not None:
            self.trajectory = GRUTrace(
                *gru_state(decoder.velocity_gru, 0), frames=self.frames, batch=batch
            )
            self.into_trajectory, self.trajectory_offset = gru_inputs(
                decoder.velocity_gru, 0
            ).after(decoder.velocity_in)
        self.kept: list[dict[str, Tensor]] = []
        poses = latent.new_zeros(self.frames + 1, batch, size)
        low, high = self.layers
        for t in range(self.frames):
            hidden = low.step(t, torch.addmm(known[t], poses[t], self.entry.T))
            hidden = high.step(t, torch.addmm(between_bias, hidden, self.between.T))
            poses[t + 1] = self._decode(t, torch.addmm(offset, hidden, self.exit.T), poses[t])
        self.joints = _points(poses[1:].transpose(0, 1))

    def _decode(self, t: int, outputs: Tensor, previous: Tensor) -> Tensor:
        """Decode the outputs (B, D) to poses (B, 3J), as `PoseDecoder` does."""
        decoder = self.decoder
        joints = _points(previous)
        origin = joints[:, 0] if decoder.settings.relative else torch.zeros_like(joints[:, 0])
        if decoder.lie_output is None:
            return (_points(outputs) + origin[:, None]).flatten(1)
        bounded = torch.tanh(outputs[:, : self.turns])
        rotations = Exponentials.of((torch.pi * bounded).T.reshape(-1, 3, len(outputs)))
        count = self.bones // 3
        frames = chain_frames(Exponentials(*(part[:count] for part in rotations)), self.plan)
        bones = bone_ends(frames, self.lengths, self.plan)
        slope = torch.pi * (1 - bounded * bounded)
        kept = {"slope": slope, "frames": frames, "bones": bones} | rotations._asdict()
        self.kept.append(kept)
        placed = joint_positions(bones, self.plan)
        if decoder.settings.root_rotation:
            kept["body"] = body = Exponentials(*(part[count:] for part in rotations)).rotmats()[0]
            kept["placed"] = placed = (body[None] * placed[:, None]).sum(2)
        local = placed.flatten(0, 1).T
        if not decoder.follows_trajectory:
            return (_points(local) + (outputs[:, self.turns :] + origin)[:, None]).flatten(1)
        inputs = torch.cat(
            [local, (joints - joints[:, :1]).flatten(1), outputs[:, self.turns :]], 1
        )
        if decoder.velocity_gru is not None:
            inputs = self.trajectory.step(
                t, torch.addmm(self.trajectory_offset, inputs, self.into_trajectory.T)
            )
        else:
            for number, layer in enumerate(self.hidden):
                kept[f"hidden {number}"] = inputs = layer(inputs)
                inputs = nn.functional.leaky_relu(inputs, self.leak)
        velocity: Tensor = self.last(inputs)
        return (_points(local) + (joints[:, 0] + velocity)[:, None]).flatten(1)

    @torch.no_grad()
    def pull_back(self, joints: Tensor, velocity: Tensor | None) -> Tensor:
        """Return the gradients with respect to the poses, including their effect on all later ones.

        Call it once.

        Parameters
        ----------
        joints : (B, T, J, 3)
            Direct gradient of the loss with respect to the poses.
        velocity : (B, T, 3) or None
            Gradient with respect to GLMI's velocities.

        Returns
        -------
        (B, T, J, 3)
        """
        low, high = self.layers
        total = joints.transpose(0, 1).flatten(2).contiguous()
        self._prepare_backward()
        for t in range(self.frames - 1, -1, -1):
            outputs, fed = self._decode_back(
                t, total[t], None if velocity is None else velocity[:, t]
            )
            hidden = high.back(t, outputs @ self.exit)
            inputs = low.back(t, hidden @ self.between)
            if t:
                total[t - 1] += inputs @ self.entry
                if fed is not None:
                    total[t - 1] += fed
        return _points(total.transpose(0, 1))

    def _prepare_backward(self) -> None:
        """Prepare the parts of the backward pass that are known for all frames in advance."""
        if not self.kept:
            return
        whole = {name: torch.stack([kept[name] for kept in self.kept]) for name in self.kept[0]}
        rotations = Exponentials(*(whole[name] for name in Exponentials._fields))
        frames, slopes = whole["frames"], _points(whole["slope"]).permute(0, 2, 3, 1)
        if "body" in whole:
            self.body, self.placed = whole["body"], cross_matrices(whole["placed"])
            frames = torch.cat([frames, self.body[:, None]], 1)
        # (T, n, 3, ...) as T * n bones, W_0 the last one
        flat = Exponentials(*(part.flatten(0, 1) for part in rotations))
        self.axes = rotvec_axes(flat, frames.flatten(0, 1)).view_as(frames) * slopes[:, :, None]
        self.crosses = cross_matrices(whole["bones"])
        hidden = [part for name, part in whole.items() if name.startswith("hidden")]
        self.leaks = [(part > 0).to(frames) * (1 - self.leak) + self.leak for part in hidden]

    def _decode_back(
        self, t: int, pose: Tensor, velocity: Tensor | None
    ) -> tuple[Tensor, Tensor | None]:
        """Return the gradients with respect to the outputs (B, D) and the previous pose (B, 3J),
        from the `gradient` with respect to the pose (B, 3J)."""
        decoder = self.decoder
        root, fed = _points(pose).sum(1), None
        if decoder.settings.relative and not decoder.follows_trajectory:
            fed = torch.zeros_like(pose)
            fed[:, :3] = root
        if decoder.lie_output is None:
            return pose, fed
        local = pose
        if decoder.follows_trajectory:
            size = self.pose_size
            gradient = root if velocity is None else root + velocity
            gradient = gradient @ self.last.weight
            if decoder.velocity_gru is not None:
                gradient = self.trajectory.back(t, gradient) @ self.into_trajectory
            else:
                for layer, leaks in zip(reversed(self.hidden), reversed(self.leaks), strict=True):
                    gradient = gradient.mul_(leaks[t]) @ layer.weight
            local, fed, rest = (
                pose + gradient[:, :size],
                gradient[:, size : 2 * size],
                gradient[:, 2 * size :],
            )
            fed[:, :3] += root - _points(fed).sum(1)
        else:
            rest = root
        by_joints, axes = local.T.view(-1, 3, len(local)), self.axes[t]
        if decoder.settings.root_rotation:
            torque = (self.placed[t] * by_joints[:, None]).sum((0, 2))
            by_body = (axes[-1] * torque[:, None]).sum(0)
            by_joints, axes = (
                (self.body[t].transpose(0, 1)[None] * by_joints[:, None]).sum(2),
                axes[:-1],
            )
        by_rotvec = rotvec_gradients(
            bone_gradients(by_joints, self.plan), self.crosses[t], axes, self.plan
        )
        if decoder.settings.root_rotation:
            by_rotvec = torch.cat([by_rotvec, by_body[None]])
        return torch.cat([by_rotvec.flatten(0, 1).T, rest], 1), fed


def _points(poses: Tensor) -> Tensor:
    """Reshape (..., 3J) to (..., J, 3)."""
    return poses.view(*poses.shape[:-1], -1, 3)


class _Feedback(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, joints: Tensor, velocity: Tensor | None, rolled: RollOut
    ) -> tuple[Tensor, Tensor | None]:
        ctx.rolled = rolled
        return joints.clone(), None if velocity is None else velocity.clone()

    @staticmethod
    def backward(
        ctx: Any, joints: Tensor, velocity: Tensor | None
    ) -> tuple[Tensor, Tensor | None, None]:
        return ctx.rolled.pull_back(joints, velocity), velocity, None


def with_feedback(
    joints: Tensor, velocity: Tensor | None, rolled: RollOut
) -> tuple[Tensor, Tensor | None]:
    """Add the feedback's gradient to joints (B, T, J, 3) and velocities (B, T, 3) of the parallel
    pass over rolled-out poses.

    The gradient of any function of the results, including the prior's part, passes through the
    feedback before it reaches the arguments.
    """
    result: tuple[Tensor, Tensor | None] = _Feedback.apply(joints, velocity, rolled)  # type: ignore[no-untyped-call]
    return result
