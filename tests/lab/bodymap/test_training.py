"""Examples, losses and training of the body map, on synthetic views."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
import torch

from a2v.errors import InputError
from a2v.kinematics.names import BLAZEPOSE, MIRRORED_BLAZEPOSE
from a2v.lab.bodymap.examples import QuickViews, make_example, mirrored, stack
from a2v.lab.bodymap.losses import errors, losses, tensors
from a2v.lab.bodymap.networks import BodyMaps
from a2v.lab.bodymap.training import (
    FILE,
    BodyMapSettings,
    BodyMapTraining,
    load_network,
    train_bodymap,
)
from a2v.perception.bodymap import FILE as SHIPPED
from tests.support.quick_views import invented_view, write_invented

QUICK = BodyMapSettings(
    iterations=4, batch_size=2, log_every=1, measured=2, threads=1, device="cpu", half=False
)


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_invented(tmp_path_factory.mktemp("views"))


def truth(true: dict[str, torch.Tensor], shift: float = 0.0) -> BodyMaps:
    """Return the answer without errors, or with an error of `shift` in u of all landmarks."""
    log = torch.full_like(true["depths"][:, :1], -4.0)
    maps = torch.cat(
        [true["places"], true["depths"], log, log, log, 20 * true["seen"][:, :1].float() - 10],
        dim=1,
    )
    points = true["points"] + torch.tensor([shift, 0.0, 0.0])
    return BodyMaps(
        points=points, first=points, log_scales=torch.full_like(points[..., :2], -4.0), maps=maps
    )


def test_a_mirror_shown_in_a_mirror_is_the_thing_itself() -> None:
    example = make_example(invented_view(np.random.default_rng(0)))
    once = mirrored(example)
    left, right = BLAZEPOSE.index("left_knee"), BLAZEPOSE.index("right_knee")
    assert MIRRORED_BLAZEPOSE[left] == right
    np.testing.assert_allclose(
        once.points[left], example.points[right] * [-1, 1, 1] + [1, 0, 0], atol=1e-6
    )
    np.testing.assert_array_equal(once.places[0, :, 0], -example.places[0, :, -1])
    for item in fields(example):
        np.testing.assert_allclose(
            getattr(mirrored(once), item.name), getattr(example, item.name), atol=1e-6
        )


def test_examples_repeat_with_their_seed_and_keep_the_truth() -> None:
    view = invented_view(np.random.default_rng(1))
    plain = make_example(view)
    made = [
        [make_example(view, generator) for _ in range(30)]
        for generator in (np.random.default_rng(5), np.random.default_rng(5))
    ]
    for first, second in zip(*made, strict=True):
        np.testing.assert_array_equal(first.picture, second.picture)
        assert first.picture.min() >= 0
        assert first.picture.max() <= 1
        upright = first if np.allclose(first.points, plain.points) else mirrored(first)
        np.testing.assert_allclose(upright.points, plain.points, atol=1e-6)
        np.testing.assert_allclose(upright.depths, plain.depths, atol=1e-6)
    assert {bool(one.picture[3].any()) for one in made[0]} == {True, False}  # some have no mask
    assert abs(plain.points[[23, 24], 2].mean()) < 1e-6
    assert plain.depths[0][plain.seen[0]].min() > 0  # the front is before the hips


def test_what_a_thing_hides_is_not_seen_and_its_errors_do_not_count() -> None:
    plain = invented_view(np.random.default_rng(3))
    things = np.zeros_like(plain.mask)
    things[120:] = True
    view = replace(plain, things=things, mask=plain.mask & ~things)
    bare, example = make_example(plain), make_example(view)
    assert (bare.seen[0, 31:] & ~example.seen[0, 31:]).sum() > 100
    assert np.array_equal(example.seen[0, :30], bare.seen[0, :30])
    assert not example.seen[:, 31:].any()
    np.testing.assert_array_equal(example.points, bare.points)
    true = tensors(stack([example]), torch.device("cpu"))
    told = truth(true)
    told.maps[:, :, 31:] += torch.tensor([1.0, 1, 1, 1, 1, 0, 0, 0, 0])[
        None, :, None, None
    ]  # any value in unseen pixels
    wrong = losses(told, true)
    for name in ("place", "front", "back"):
        assert float(wrong[name]) < 1e-5
    # Sometimes segmentations include things: then the mask covers more than the visible person.
    made = [make_example(view, np.random.default_rng(seed)) for seed in range(40)]
    taken = [one.picture[3, 124:].sum() > 0.1 * things.sum() for one in made]
    assert 0.05 < np.mean(taken) < 0.7


def test_losses_and_errors_vanish_on_the_truth_alone() -> None:
    generator = np.random.default_rng(2)
    true = tensors(
        stack([make_example(invented_view(generator)) for _ in range(3)]), torch.device("cpu")
    )
    right, wrong = losses(truth(true), true), losses(truth(true, 0.01), true)
    for name in ("plane", "depth", "first", "place", "front", "back"):
        assert float(right[name]) < 1e-5
    assert float(right["inside"]) < 1e-3
    assert float(wrong["plane"]) == pytest.approx(
        10 * 0.005 * float(true["weights"].mean()), rel=1e-3
    )
    assert float(wrong["depth"]) < 1e-5
    assert float(wrong["likelihood"]) > float(right["likelihood"])
    # a hundredth of the picture's side, of which half a one is a meter
    assert float(errors(truth(true, 0.01), true)["limbs"].mean()) == pytest.approx(2.0, rel=1e-3)
    assert float(errors(truth(true), true)["front_depth"].max()) < 1e-3


def test_views_that_come_later_have_larger_numbers(tmp_path: Path) -> None:
    views = QuickViews(write_invented(tmp_path), "training")
    first = views.view(3).landmarks
    write_invented(tmp_path, training=2, validation=0)
    assert len(views) == 64
    views.refresh()
    assert len(views) == 128
    np.testing.assert_array_equal(views.view(3).landmarks, first)
    with pytest.raises(InputError, match="no quick views of the split 'training'"):
        QuickViews(tmp_path / "none", "training")


def test_a_run_resumes_and_refuses_other_settings(views: Path, tmp_path: Path) -> None:
    rows: list[dict[str, float]] = []
    train_bodymap(views, tmp_path / "whole", settings=QUICK, on_log=rows.append)
    assert rows[0]["held_out_limbs"] > 0

    class Stop(Exception):
        pass

    def stop(row: dict[str, float]) -> None:
        if row["iteration"] == 2:
            raise Stop

    with pytest.raises(Stop):
        train_bodymap(views, tmp_path / "halves", settings=QUICK, on_log=stop)
    again: list[dict[str, float]] = []
    train_bodymap(views, tmp_path / "halves", settings=QUICK, on_log=again.append)
    assert [row["iteration"] for row in again] == [3, 4]
    whole, halves = (load_network(tmp_path / name)[0].state_dict() for name in ("whole", "halves"))
    assert all(torch.allclose(whole[name], halves[name], atol=1e-5) for name in whole)
    start = BodyMapSettings(
        iterations=1,
        learning_rate=1e-9,
        batch_size=2,
        measured=0,
        threads=1,
        device="cpu",
        initial=str(tmp_path / "whole"),
    )
    network = train_bodymap(views, tmp_path / "more", settings=start)
    assert all(
        torch.allclose(whole[name], weight, atol=1e-5)
        for name, weight in network.named_parameters()
    )
    with pytest.raises(InputError, match="batch_size=2"):
        train_bodymap(views, tmp_path / "halves", settings=replace(QUICK, batch_size=3))
    with pytest.raises(InputError, match="does not exist; train first"):
        load_network(tmp_path / "none")
    assert (tmp_path / "whole" / FILE).is_file()


def test_the_shipped_network_comes_back_out_of_its_file(views: Path, tmp_path: Path) -> None:
    start = replace(QUICK, iterations=1, learning_rate=1e-12, measured=0, initial="shipped")
    training = BodyMapTraining(views, start)
    training.begin()
    network = training.average
    picture = torch.rand(1, 4, 256, 256, generator=torch.Generator().manual_seed(1))
    with torch.no_grad():
        told = network(picture)
    session = onnxruntime.InferenceSession(str(SHIPPED), providers=["CPUExecutionProvider"])
    points, log_scales, maps = session.run(
        ["points", "log_scales", "maps"], {"picture": picture.numpy()}
    )
    np.testing.assert_allclose(told.points, points, atol=1e-4)
    np.testing.assert_allclose(told.log_scales, log_scales, atol=1e-3)
    np.testing.assert_allclose(told.maps, maps, atol=5e-3)
    assert (
        max(
            float(layer.running_mean.abs().max())
            for layer in network.modules()
            if isinstance(layer, torch.nn.BatchNorm2d)
        )
        > 0.1
    )
    with pytest.raises(InputError, match="does not exist; give a run's folder"):
        train_bodymap(
            views, tmp_path / "nothing", settings=replace(start, initial=str(tmp_path / "none"))
        )


def test_training_makes_the_losses_smaller(views: Path, tmp_path: Path) -> None:
    rows: list[dict[str, float]] = []
    settings = replace(QUICK, iterations=16, measured=0, learning_rate=4e-3)
    train_bodymap(views, tmp_path, settings=settings, on_log=rows.append)
    for name in ("place", "inside", "front"):
        assert np.mean([row[name] for row in rows[-4:]]) < 0.8 * np.mean(
            [row[name] for row in rows[:4]]
        )


@pytest.mark.parametrize("bad", [{"iterations": 0}, {"average": 1.0}, {"measured": -1}])
def test_bad_settings_are_refused(bad: dict) -> None:  # type: ignore[type-arg]
    with pytest.raises(InputError):
        BodyMapSettings(**bad)
