"""Store finished photos in a folder."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from a2v.io import atomic_path, sha256
from a2v.lab.evaluation.reconstruction.methods import Method, Outcome, Result
from a2v.lab.evaluation.reconstruction.pictures import picture_rows, stack_rows
from a2v.lab.evaluation.reconstruction.settings import METRICS, BenchmarkSettings
from a2v.lab.studio.settings import VERSION
from a2v.lab.studio.studio import Studio
from a2v.reconstruction.backends import backend_digest
from a2v.types import ByteArray


class Measured:
    """A folder of finished photos, so that a run that was stopped, or that gets another method,
    continues.

    The truths are in `cases`, a folder beside it, which other runs share.

    Parameters
    ----------
    folder : path
    studio : Studio
    settings : BenchmarkSettings
        Results of another protocol, studio, or weights of the method are not used.
    """

    def __init__(
        self, folder: str | os.PathLike[str], studio: Studio, settings: BenchmarkSettings
    ) -> None:
        """See the class."""
        self.folder = Path(folder)
        self.cases = self.folder.parent / "cases"
        protocol = {
            name: value
            for name, value in dataclasses.asdict(settings).items()
            if name not in ("views", "panel")
        }
        self._common = [protocol, VERSION, dataclasses.asdict(studio.settings), list(METRICS)]

    def _path(self, index: int, method: Method) -> Path:
        key = sha256(
            json.dumps(
                [*self._common, method.name, backend_digest(method.backend, method.weights)],
                sort_keys=True,
            ).encode()
        )[:16]
        return self.folder / f"{index:06d}-{method.name.replace(':', '-')}-{key}"

    def load(self, index: int, methods: Sequence[Method]) -> Outcome | None:
        """The stored result of a photo, None without one; failed photos are tried again."""
        known: Outcome | None = None
        for method in methods:
            path = self._path(index, method).with_suffix(".json")
            if path.exists():
                found = Outcome(**json.loads(path.read_text(encoding="utf-8")))
                known = known.with_others(found) if known else found
        return known

    def save(self, result: Result, methods: Sequence[Method]) -> None:
        """Store a result with its pictures, one file per method."""
        import cv2

        outcome, rows = result.outcome, picture_rows(result)
        if outcome.failure:
            return
        for method in methods:
            path, name = self._path(outcome.index, method), method.name
            own = dataclasses.replace(
                outcome,
                scores={name: outcome.scores[name]},
                seconds={name: outcome.seconds[name]},
                made={name: outcome.made[name]},
            )
            for suffix, picture in ((".png", rows[name]), (".truth.png", rows["truth"])):
                with atomic_path(path.with_suffix(suffix)) as temporary:
                    cv2.imwrite(str(temporary), picture[..., ::-1])
            with atomic_path(path.with_suffix(".json")) as temporary:
                temporary.write_text(json.dumps(dataclasses.asdict(own)), encoding="utf-8")

    def sheet(self, index: int, methods: Sequence[Method]) -> ByteArray:
        """The pictures of a photo that is stored for all of `methods`: the truth and each method,
        below each other."""
        import cv2

        paths = [self._path(index, method) for method in methods]
        files = [paths[0].with_suffix(".truth.png"), *(path.with_suffix(".png") for path in paths)]
        return stack_rows([np.asarray(cv2.imread(str(file)))[..., ::-1] for file in files])
