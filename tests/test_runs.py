"""What every training shares: checkpoints that cannot be mixed up, and rates."""

from __future__ import annotations

from dataclasses import dataclass

import pytest
import torch

from a2v.errors import InputError
from a2v.runs import Run, RunSettings, cosine_decay, identity, read_checkpoint


@dataclass(frozen=True)
class Settings:
    width: int = 3
    threads: int = 1


def run_in(folder, *, width=3, threads=1, digest="abc"):
    return Run(folder / "x.pt", identity(Settings(width, threads), digest=digest), every=1e9)


def test_a_run_finds_what_it_saved(tmp_path):
    first = run_in(tmp_path)
    assert first.resume(["model"]) is None
    first._began -= 50
    first.save({"model": {"w": torch.arange(3)}}, [{"iteration": 1.0}, {"iteration": 2.0, "loss": 0.5}])
    second = run_in(tmp_path, threads=2)  # threads do not change what is learned
    content = second.resume(["model"])
    assert content is not None
    assert torch.equal(content["model"]["w"], torch.arange(3))
    assert 50 <= second.seconds < 60
    assert (tmp_path / "log.csv").read_text().split() == ["iteration,loss", "1.0,", "2.0,0.5"]


@pytest.mark.parametrize(("other", "reason"), [({"width": 4}, "width=3, not 4"), ({"digest": "x"}, "dataset_digest=abc, not x")])
def test_other_settings_or_data_are_refused(tmp_path, other, reason):
    run_in(tmp_path).save({"model": {}})
    with pytest.raises(InputError, match=reason):
        run_in(tmp_path, **other).resume(["model"])


@pytest.mark.parametrize("content", [b"", b"not a checkpoint", b"\x80\x04cos\nsystem\n(S'true'\ntR."])
def test_foreign_checkpoints_are_refused(tmp_path, content):
    (tmp_path / "checkpoint.pt").write_bytes(content)
    with pytest.raises(InputError, match=r"checkpoint\.pt cannot be read"):
        read_checkpoint(tmp_path / "checkpoint.pt", ["model"])


def test_checkpoints_of_another_training_are_refused(tmp_path):
    run_in(tmp_path).save({"model": {}})
    with pytest.raises(InputError, match="lacks codec"):
        read_checkpoint(tmp_path / "x.pt", ["model", "codec"])
    with pytest.raises(InputError, match="does not exist"):
        read_checkpoint(tmp_path / "y.pt", ["model"])


def test_the_rate_falls_along_half_a_cosine():
    assert cosine_decay(0, 0.1) == 1
    assert cosine_decay(1, 0.1) == pytest.approx(0.1)
    assert cosine_decay(0.5, 0.1) == pytest.approx(0.55)


@pytest.mark.parametrize("quick", [True, False])
def test_products_are_what_they_were_after_a_training(quick: bool) -> None:
    matmul = torch.backends.mkldnn.matmul  # type: ignore[attr-defined]
    before = matmul.fp32_precision

    def fail() -> None:
        with RunSettings(quick_products=quick).products():
            assert (matmul.fp32_precision != before) is quick
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert matmul.fp32_precision == before
