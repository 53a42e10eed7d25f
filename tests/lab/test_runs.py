"""Common parts of trainings: checkpoints that cannot be mixed up, and rates."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
import torch

from a2v.errors import InputError
from a2v.lab.checkpoints import read_checkpoint
from a2v.lab.runs import NEWER, RateSchedule, Run, RunSettings, Training, carry_on, identity


@dataclass(frozen=True)
class Settings:
    width: int = 3
    threads: int = 1
    bold: bool = field(default=False, metadata=NEWER)


def run_in(folder, *, width=3, threads=1, bold=False, digest="abc"):
    return Run(folder / "x.pt", identity(Settings(width, threads, bold), digest=digest), every=1e9)


def test_a_run_from_before_a_setting_goes_on_with_its_default_alone(tmp_path):
    (old := run_in(tmp_path)).save({"model": {}})
    assert "bold" not in old.made_with
    assert run_in(tmp_path).resume(["model"]) is not None
    with pytest.raises(InputError, match="bold=its default, not True"):
        run_in(tmp_path, bold=True).resume(["model"])
    run_in(tmp_path, bold=True).save({"model": {}})
    assert run_in(tmp_path, bold=True).resume(["model"]) is not None
    with pytest.raises(InputError, match="bold=True, not its default"):
        run_in(tmp_path).resume(["model"])


def test_a_run_finds_what_it_saved(tmp_path):
    first = run_in(tmp_path)
    assert first.resume(["model"]) is None
    first._began -= 50
    first.save(
        {"model": {"w": torch.arange(3)}}, [{"iteration": 1.0}, {"iteration": 2.0, "loss": 0.5}]
    )
    second = run_in(tmp_path, threads=2)  # threads do not change the result
    content = second.resume(["model"])
    assert content is not None
    assert torch.equal(content["model"]["w"], torch.arange(3))
    assert 50 <= second.seconds < 60
    assert (tmp_path / "log.csv").read_text().split() == ["iteration,loss", "1.0,", "2.0,0.5"]


@pytest.mark.parametrize(
    ("other", "reason"),
    [({"width": 4}, "width=3, not 4"), ({"digest": "x"}, "dataset_digest=abc, not x")],
)
def test_other_settings_or_data_are_refused(tmp_path, other, reason):
    run_in(tmp_path).save({"model": {}})
    with pytest.raises(InputError, match=reason):
        run_in(tmp_path, **other).resume(["model"])


@pytest.mark.parametrize(
    "content", [b"", b"not a checkpoint", b"\x80\x04cos\nsystem\n(S'true'\ntR."]
)
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
    rate = RateSchedule(peak=2.0, span=100, floor=0.1)
    assert rate(0) == 2
    assert rate(100) == pytest.approx(0.2)
    assert rate(50) == pytest.approx(1.1)
    assert {RateSchedule(peak=2.0, span=100, floor=1.0)(iteration) for iteration in range(101)} == {
        2.0
    }


def test_the_rate_rises_along_a_line():
    rising, whole = (
        RateSchedule(peak=2.0, span=100, floor=0.1, warm_up=count) for count in (10, 1)
    )
    assert [rising(iteration) / whole(iteration) for iteration in range(12)] == pytest.approx(
        [*np.linspace(0.1, 1, 10), 1, 1]
    )


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


class Falling(Training):
    """Learns one number; its loss is not finite from iteration `diverges` on."""

    STORED = ("number",)
    REMEDY = "give up"

    def __init__(self, diverges: int = 10**6) -> None:
        super().__init__()
        self.number = torch.tensor([8.0], requires_grad=True)
        self.optimizer = torch.optim.Adam([self.number])
        self.rate = RateSchedule(peak=0.5, span=20, floor=0.1)
        self.diverges, self.begun, self.rates = diverges, 0, []

    def begin(self) -> None:
        self.begun += 1

    def step(self) -> dict[str, float]:
        self.rates.append(self.optimizer.param_groups[0]["lr"])
        loss = self.number.square().sum() * (float("nan") if self.iteration >= self.diverges else 1)
        self.descend(loss)
        return {"loss": float(loss.detach()), "place": float(self.iteration)}

    def measure(self) -> dict[str, float]:
        return {"measured": float(self.number.detach())}

    def content(self) -> dict[str, torch.Tensor]:
        return {"number": self.number.detach().clone()}

    def restore(self, content) -> None:
        self.number.data.copy_(content["number"])


def carry(training, folder, iterations=20, on_log=None):
    carry_on(
        training,
        run_in(folder),
        RunSettings(log_every=8, device="cpu"),
        iterations=iterations,
        on_log=on_log,
    )
    return training


def test_a_training_logs_means_and_what_it_measures(tmp_path):
    rows = []
    training = carry(
        Falling(), tmp_path, on_log=lambda row: rows.append(row) or row.update(more=1.0)
    )
    assert [row["iteration"] for row in rows] == [8, 16, 20]
    assert [row["place"] for row in rows] == [3.5, 11.5, 17.5]
    assert rows[-1]["measured"] == float(training.number.detach())
    assert training.log == rows
    assert training.begun == 1
    assert training.rates == [training.rate(iteration) for iteration in range(20)]
    assert (tmp_path / "log.csv").read_text().splitlines()[
        0
    ] == "iteration,seconds,loss,place,measured,more"


def test_a_group_of_weights_may_have_a_share_of_the_rate(tmp_path):
    training = Falling()
    training.optimizer.add_param_group(
        {"params": [torch.tensor([1.0], requires_grad=True)], "share": 0.25}
    )
    carry(training, tmp_path, iterations=5)
    assert [group["lr"] for group in training.optimizer.param_groups] == [
        training.rate(4),
        0.25 * training.rate(4),
    ]


def test_a_stopped_training_goes_on_as_if_it_had_not(tmp_path):
    def stop(row):
        if row["iteration"] == 8:
            raise KeyboardInterrupt

    whole = carry(Falling(), tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        carry(Falling(), tmp_path / "parts", on_log=stop)
    resumed = carry(Falling(), tmp_path / "parts")
    assert torch.equal(whole.number, resumed.number)
    assert whole.begun + resumed.begun == 1
    assert [row["loss"] for row in resumed.log] == [row["loss"] for row in whole.log]


def test_a_complete_training_stays_as_it_is(tmp_path):
    first = carry(Falling(), tmp_path)
    before = (tmp_path / "x.pt").read_bytes()
    again = carry(Falling(), tmp_path)
    assert torch.equal(first.number, again.number)
    assert (tmp_path / "x.pt").read_bytes() == before


def test_divergence_is_an_error_with_a_remedy(tmp_path):
    with pytest.raises(InputError, match="training diverged at iteration 16; give up"):
        carry(Falling(diverges=9), tmp_path)
    assert read_checkpoint(tmp_path / "x.pt", ["number"])["iteration"] == 16


def test_the_gradient_is_limited():
    training = Falling()
    training.optimizer = torch.optim.SGD([training.number], lr=1.0)
    training.descend(training.number.square().sum(), largest_gradient=0.25)
    assert training.number.item() == pytest.approx(8 - 0.25)
