"""Steer the windows of a motion (`a2v.motion.steer`) to its constraints
(`a2v.motion.direction`).

Paths and headings are soft constraints at intervals. Keyframes are exact: the error of a window is
added to its constraints, and the window is generated again. A held hand is constrained by the bones
of an arm that reaches it.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field

import numpy as np

from a2v.errors import InputError
from a2v.kinematics.ground import heading, yaw_to_rotmat
from a2v.kinematics.limbs import bend_to, limb_of
from a2v.motion.direction import Direction, Hold, Keyframe
from a2v.motion.limbs import held_at
from a2v.motion.steer import CodeReader, SoftConstraint, Steering, between_frames, steer
from a2v.motion.ways import Way
from a2v.types import FloatArray

PATH_SIGMA = 0.15
"""Tolerance of the root's distance from the path, meters (docs/results/motion_direction.md)."""
SIDE_SIGMA = 0.1
"""Tolerance of the hips' line against the normal of the path (unit vectors)."""
ASK_SECONDS = 0.66
"""Seconds between the constraints of a path or a heading."""
POSE_SIGMA = 0.02
"""Tolerance of the bone directions of a given pose (unit vectors)."""
PLACE_SIGMA = 0.005
"""Tolerance of its positions, meters."""
HELD_SIGMA = 0.05
"""Tolerance of held joints, like `POSE_SIGMA`; `hold_limbs` does the rest."""
HELD_SECONDS = 0.25
"""Seconds between the constraints of a held joint."""
PASSES = 4
"""Number of times that a window with exact constraints is generated."""
CALM_FRAMES = 12
"""Frames between the beginning of a window's own frames and the first exact constraint. There the
window still blends from the previous one."""


@dataclass(frozen=True)
class _MeasuredConstraint:
    """A constraint, and a function that reads its value from joints (W, J, 3) in the window's axes;
    None if its error is not fed back."""

    constraint: SoftConstraint
    seen: Callable[[FloatArray], FloatArray] | None = None


@dataclass
class DirectionSteerer:
    """`a2v.motion.steer.Steerer` of a `Direction`.

    Attributes
    ----------
    direction : Direction
    reader : CodeReader
    fps : float
        Frame rate of the model.
    frame_of : callable
        Maps a time of the result, seconds, to a (fractional) frame of the model.
    way : Way or None
        Positions along the path at the model's frames.
    """

    direction: Direction
    reader: CodeReader
    fps: float
    frame_of: Callable[[float], float]
    way: Way | None = None
    start: tuple[FloatArray, float] = field(init=False)
    _keys: list[tuple[float, Keyframe]] = field(init=False)

    def __post_init__(self) -> None:
        self._keys = sorted(
            ((self.frame_of(key.time), key) for key in self.direction.keyframes),
            key=lambda pair: pair[0],
        )
        self.start = self._start()

    def _start(self) -> tuple[FloatArray, float]:
        """Return the start of the clip. The height is a guess until the clip has begun."""
        tall = float(self.reader.lengths[self._leg()].sum())
        place, yaw = np.array([0.0, tall, 0.0]), self.direction.heading
        if self.way is not None:
            place[[0, 2]] = self.way.points[0]
            yaw = float(self.way.heading[0]) if yaw is None else yaw
        for frame, key in self._keys[:1]:
            if key.joints is not None:
                yaw = float(heading(key.joints, self.reader.skeleton)) if yaw is None else yaw
                place = key.joints[0].astype(np.float64) if frame < 0.5 else place
            elif frame < 0.5 and key.at is not None:
                place[[0, 2]] = key.at
            if key.heading is not None and yaw is None:
                yaw = key.heading
        return place, yaw or 0.0

    def _leg(self) -> list[int]:
        skeleton, joint, chain = self.reader.skeleton, max(self.reader.skeleton.feet, default=0), []
        while joint > 0:
            chain.append(joint)
            joint = int(skeleton.parents[joint])
        return chain

    def begin(self, joints: FloatArray) -> FloatArray:
        """See `Steerer`."""
        place, yaw = self.start
        turned = joints.astype(np.float64) @ yaw_to_rotmat(np.array(yaw)).T
        moved = turned - turned[:, :1, :1] + place
        posed = self._keys and self._keys[0][0] < 0.5 and self._keys[0][1].joints is not None
        if not posed:
            moved[..., 1] -= moved[..., 1].min()
        return moved.astype(np.float32)

    def until(self, first: int, end: int) -> int:
        """See `Steerer`. A window ends early if the next one would otherwise have a keyframe too
        near to its beginning."""
        soon = [frame for frame, _ in self._keys if end <= frame < end + CALM_FRAMES]
        early = int(soon[0]) - CALM_FRAMES if soon else end
        return early if early >= first + CALM_FRAMES else end

    def window(
        self, first: int, taken: tuple[int, int], place: FloatArray, yaw: float
    ) -> Generator[Steering | None, FloatArray, None]:
        """See `Steerer`."""
        back = yaw_to_rotmat(np.array(-yaw))
        soft = self._soft(first, taken, place, yaw)
        # The blend from the previous window is not in the code. If a window is no longer than the
        # blend, its error is fed back as well.
        again = soft if 0 < taken[0] >= taken[1] - CALM_FRAMES else []
        made: FloatArray | None = None
        missed: dict[int, FloatArray] = {}
        for turn in range(PASSES):
            exact = self._exact(first, taken, place, yaw, made)
            wanted = [*soft, *exact]
            if not wanted:
                yield None
                return
            for number, item in enumerate(wanted):
                if made is not None and item.seen is not None and (again or number >= len(soft)):
                    off = item.constraint.value - item.seen((made - place) @ back.T).ravel()
                    missed[number] = missed[number] + off if number in missed else off
            given = [
                missed.get(number, np.zeros(len(item.constraint.value)))
                for number, item in enumerate(wanted)
            ]
            made = yield steer([item.constraint for item in wanted], np.concatenate(given))
            place = made[0, 0]
            if not exact and turn >= bool(again):
                return

    def _soft(
        self, first: int, taken: tuple[int, int], place: FloatArray, yaw: float
    ) -> list[_MeasuredConstraint]:
        """Return the constraints of path and heading, every `ASK_SECONDS` up to the last used
        frame."""
        begin, end = taken
        every = max(1, round(ASK_SECONDS * self.fps))
        asked = np.arange(end - 1, begin + 2 if begin else -1, -every)[::-1].astype(np.float64)
        if not len(asked):
            return []
        at = np.clip(first + asked, 0, None)
        constraints: list[_MeasuredConstraint] = []
        if self.way is not None:
            constraints.append(
                self._placed(
                    asked,
                    between_frames(self.way.points, np.minimum(at, len(self.way.points) - 1)),
                    place,
                    yaw,
                    PATH_SIGMA,
                )
            )
        elif towards := self._towards(first + end - 1, place, first):
            constraints.append(
                self._placed(asked[-1:], np.array([towards]), place, yaw, PATH_SIGMA)
            )
        if self.direction.heading is not None:
            constraints.append(
                self._faced(asked, np.full(len(asked), self.direction.heading), yaw, SIDE_SIGMA)
            )
        elif self.way is not None:
            constraints.append(
                self._faced(
                    asked,
                    between_frames(self.way.heading, np.minimum(at, len(self.way.heading) - 1)),
                    yaw,
                    SIDE_SIGMA,
                )
            )
        return constraints

    def _towards(self, frame: int, place: FloatArray, first: int) -> tuple[float, float] | None:
        """Return the target of the root at `frame` on the straight line to the next given place;
        None without one."""
        for later, key in self._keys:
            goal = key.at if key.joints is None else tuple(key.joints[0, [0, 2]])
            if later > frame and goal is not None:
                share = (frame - first) / (later - first)
                x, z = (1 - share) * place[[0, 2]] + share * np.array(goal)
                return float(x), float(z)
        return None

    def _exact(
        self,
        first: int,
        taken: tuple[int, int],
        place: FloatArray,
        yaw: float,
        made: FloatArray | None,
    ) -> list[_MeasuredConstraint]:
        """Return the constraints of keyframes and held joints within the window's own frames."""
        begin, end = taken
        found: list[_MeasuredConstraint] = []
        back = yaw_to_rotmat(np.array(-yaw))
        for frame, key in self._keys:
            local = np.array([frame - first])
            if not begin - 1 < local[0] <= end - 1 + 1e-6:
                continue
            if key.joints is not None:
                found += self._posed(local, (key.joints.astype(np.float64) - place) @ back.T)
                continue
            if key.at is not None:
                found.append(self._placed(local, np.array([key.at]), place, yaw, PLACE_SIGMA))
            if key.heading is not None:
                found.append(self._faced(local, np.array([key.heading]), yaw, POSE_SIGMA))
        every = max(1, round(HELD_SECONDS * self.fps))
        for hold in self.direction.holds:
            frames = np.arange(
                max(self.frame_of(hold.start) - first, begin),
                min(self.frame_of(hold.end) - first, end - 1) + 1e-6,
                every,
            )
            if len(frames):
                found.append(self._held(hold, frames, place, yaw, made))
        return found

    def _placed(
        self, frames: FloatArray, points: FloatArray, place: FloatArray, yaw: float, sigma: float
    ) -> _MeasuredConstraint:
        """Constrain the root to `points` (F, 2) on the ground."""
        rows, offset = self.reader.root(frames)
        level = np.stack(
            [points[:, 0] - place[0], np.zeros(len(points)), points[:, 1] - place[2]], axis=-1
        )
        value = level @ yaw_to_rotmat(np.array(-yaw)).T
        return _MeasuredConstraint(
            SoftConstraint.of(rows[:, [0, 2]], offset[:, [0, 2]], value[:, [0, 2]], sigma),
            lambda joints: between_frames(joints[:, 0], frames)[:, [0, 2]],
        )

    def _faced(
        self, frames: FloatArray, headings: FloatArray, yaw: float, sigma: float
    ) -> _MeasuredConstraint:
        """Constrain the line of the hips to be perpendicular to the `headings` (F,)."""
        skeleton = self.reader.skeleton
        if skeleton.hips is None:
            raise InputError(f"skeleton '{skeleton.name}' does not say which joints are hips")
        left, right = skeleton.hips
        rows, offset = self.reader.joints(frames, skeleton.hips)
        width = float(self.reader.lengths[[left, right]].sum())
        away = headings - yaw
        side = np.stack([np.cos(away), -np.sin(away)], axis=-1) * width
        rows, offset = (
            rows[:, 0, [0, 2]] - rows[:, 1, [0, 2]],
            offset[:, 0, [0, 2]] - offset[:, 1, [0, 2]],
        )
        return _MeasuredConstraint(
            SoftConstraint.of(rows, offset, side, sigma),
            lambda joints: between_frames(joints[:, left] - joints[:, right], frames)[:, [0, 2]],
        )

    def _posed(self, frames: FloatArray, joints: FloatArray) -> Sequence[_MeasuredConstraint]:
        """Constrain the root and all bones to one pose (J, 3), in the window's axes."""
        parents = self.reader.skeleton.parents[1:]

        def bones(poses: FloatArray) -> FloatArray:
            vectors = poses[..., 1:, :] - poses[..., parents, :]
            unit: FloatArray = vectors / np.maximum(
                np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9
            )
            return unit

        root, bone = self.reader.root(frames), self.reader.directions(frames)
        return (
            _MeasuredConstraint(
                SoftConstraint.of(*root, joints[None, 0], PLACE_SIGMA),
                lambda made: between_frames(made[:, 0], frames),
            ),
            _MeasuredConstraint(
                SoftConstraint.of(*bone, bones(joints)[None], POSE_SIGMA),
                lambda made: between_frames(bones(made), frames),
            ),
        )

    def _held(
        self, hold: Hold, frames: FloatArray, place: FloatArray, yaw: float, made: FloatArray | None
    ) -> _MeasuredConstraint:
        """Constrain a joint to its place. After the first generation the directions of a limb that
        reaches it are constrained."""
        skeleton, back = self.reader.skeleton, yaw_to_rotmat(np.array(-yaw))
        joint = skeleton.index(hold.joint)
        limb = limb_of(skeleton, joint)
        rows, offset = (part[:, 0] for part in self.reader.joints(frames, [joint]))
        if not hold.body:  # the root moves nearer as well
            to, from_ = self.reader.root(frames)
            value = np.broadcast_to((np.array(hold.at) - place) @ back.T, offset.shape)
            return _MeasuredConstraint(
                SoftConstraint.of(rows + to, offset + from_, value, PLACE_SIGMA),
                lambda joints: between_frames(joints[:, joint], frames),
            )
        if made is None or limb is None:
            turned = (
                np.zeros(len(frames))
                if made is None
                else between_frames(np.unwrap(heading(made, skeleton)), frames) - yaw
            )
            value = np.einsum("fab,b->fa", yaw_to_rotmat(turned), np.array(hold.at))
            return _MeasuredConstraint(SoftConstraint.of(rows, offset, value, HELD_SIGMA))
        now = between_frames(made, frames)
        top, middle, end = (now[:, part] for part in limb)
        new_middle, new_end = bend_to(
            top, middle, end, held_at(hold, now, skeleton) - now[:, joint] + end
        )
        bones = np.stack([new_middle - top, new_end - new_middle], axis=1) @ back.T
        unit = bones / np.maximum(np.linalg.norm(bones, axis=-1, keepdims=True), 1e-9)
        rows, offset = (
            part[:, [limb[1] - 1, limb[2] - 1]] for part in self.reader.directions(frames)
        )
        return _MeasuredConstraint(SoftConstraint.of(rows, offset, unit, HELD_SIGMA))
