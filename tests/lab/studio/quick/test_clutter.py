"""Quick views with things: occlusion is marked, and occluded ground truth is kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from a2v.body.places import canonical_places
from a2v.errors import InputError
from a2v.io import write_npz
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.guide import Guide, guide_key, stack_guides
from a2v.lab.studio.quick.bank import make_pose_bank
from a2v.lab.studio.quick.people import QuickStudio
from a2v.lab.studio.quick.photo import places_of, quick_view, softened
from a2v.lab.studio.quick.settings import QuickSettings
from a2v.lab.studio.quick.views import MAP, QuickShard, QuickView
from a2v.lab.studio.stances import draw_stance
from a2v.lab.studio.stand import PreparedAvatar, draw_outfit, prepare_avatar
from a2v.lab.studio.things.backgrounds import Backgrounds
from a2v.lab.studio.things.clutter import NOTHING, Clutter, CutOut

PLAIN = QuickSettings(
    people="avatars",
    cut=0.0,
    shift=0.0,
    fill=(0.8, 0.8),
    things=0.0,
    furniture=0.0,
    others=0.0,
    photographs=0.0,
)


@pytest.fixture(scope="module")
def prepared(data: Path, avatar: Avatar) -> PreparedAvatar:
    return prepare_avatar(str(data / "avatars" / f"{avatar.name}.glb"))


def views(prepared: PreparedAvatar, guide: Guide, clutter: Clutter, seed: int) -> list[QuickView]:
    """Return up to ten pictures of a standing person.

    Build, clothes, poses and cameras are the same for the same seed.
    """
    places = places_of(prepared, guide, canonical_places())
    made = []
    for number in range(10):
        generator = np.random.default_rng([seed, number])
        outfit = draw_outfit(prepared, generator)
        outfit = replace(outfit, texture=softened(outfit.texture))
        pose = draw_stance("standing", generator)[0]
        view = quick_view(outfit, guide, places, pose, PLAIN, generator, clutter)
        if view is not None:
            made.append(view)
    return made


def by_size(made: list[QuickView]) -> dict[float, QuickView]:
    """Return views by their scale, which identifies cameras."""
    return {view.scale: view for view in made}


def test_furniture_hides_and_the_truth_stays(prepared: PreparedAvatar, guide: Guide) -> None:
    alone, among = (
        by_size(views(prepared, guide, clutter, 4))
        for clutter in (Clutter(), Clutter(furniture=True))
    )
    both = sorted(set(alone) & set(among))
    assert len(both) >= 4  # the others are framed by what is seen
    for scale in both:
        bare, behind = alone[scale], among[scale]
        for name in ("front", "back", "places", "landmarks"):
            np.testing.assert_array_equal(getattr(bare, name), getattr(behind, name))
        assert not bare.things.any()
        assert not bare.hidden.any()
        assert not (behind.mask & behind.things).any()
        assert (behind.mask & ~bare.mask).sum() < 40  # nobody grows; pixels at rims may
        lost = bare.mask & ~behind.mask
        assert (behind.things[lost]).mean() > 0.9 if lost.sum() > 100 else True
        step = 256 // MAP
        share = lost.reshape(MAP, step, MAP, step).mean(axis=(1, 3))
        assert behind.hidden[share > 0.9].all()
        assert not behind.hidden[(share == 0) & np.isfinite(behind.front)].sum() > 30
    assert max(among[scale].hidden.sum() for scale in both) > 50


def test_others_hide_in_front_and_show_behind(prepared: PreparedAvatar, guide: Guide) -> None:
    plain = views(prepared, guide, Clutter(), 1)
    people = [CutOut.of(view.image, view.mask) for view in plain]
    assert all(0.2 < one.alpha.mean() < 0.9 for one in people)
    bare, crowded = by_size(plain), by_size(views(prepared, guide, Clutter(others=people[:3]), 1))
    assert bare.keys() == crowded.keys()
    covered = []
    for scale, view in crowded.items():
        assert not (view.mask & view.things).any()
        left = (view.mask & bare[scale].mask).sum() / bare[scale].mask.sum()
        assert left > 0.4
        covered.append(1 - left)
        assert np.abs(view.image.astype(int) - bare[scale].image).mean() > 2
    assert max(covered) > 0.02
    assert min(covered) < 0.3


def test_a_photograph_replaces_the_drawn_background_alone(
    prepared: PreparedAvatar, guide: Guide
) -> None:
    plain, before = (
        views(prepared, guide, clutter, 2)
        for clutter in (Clutter(), Clutter(photographs=Backgrounds()))
    )
    for one, other in zip(plain, before, strict=True):
        np.testing.assert_array_equal(one.mask, other.mask)
        assert not other.things.any()
        assert np.abs(one.image.astype(int) - other.image)[~one.mask].mean() > 10
    assert {one.photo.tobytes() for one in plain}.isdisjoint(
        {one.photo.tobytes() for one in before}
    )


def test_shares_are_drawn_and_none_draws_nothing() -> None:
    somebody = CutOut(np.zeros((9, 5, 3), np.float32), np.ones((9, 5), np.float32))
    given = {"people": [somebody], "backgrounds": Backgrounds()}
    clutter = Clutter.draw(
        np.random.default_rng(0), things=1.0, furniture=1.0, others=1.0, photographs=1.0, **given
    )
    assert clutter.held is not None
    assert clutter.furniture
    assert clutter.others
    assert clutter.photographs is not None
    generator = np.random.default_rng(0)
    assert vars(Clutter.draw(generator, **given)) == vars(NOTHING)
    assert (
        generator.random() == np.random.default_rng(0).random()
    )  # so that a seed gives the same view as before things existed
    with pytest.raises(InputError, match="things is 2"):
        QuickSettings(things=2)


@pytest.mark.slow
def test_a_block_with_everything_repeats_and_comes_back_from_its_file(
    data: Path, avatar: Avatar, guide: Guide, tmp_path: Path
) -> None:
    make_pose_bank(avatar, data, clips=10, step=4).save(tmp_path / "bank.npz")
    write_npz(tmp_path / "guide.npz", stack_guides({guide_key(avatar.name): guide}))
    settings = QuickSettings(people="avatars", things=0.5, furniture=0.5, others=0.5)
    first, second = (
        QuickStudio.open(tmp_path, data, settings).block("training", 0, outfits=2) for _ in range(2)
    )
    assert [view.photo.tobytes() for view in first] == [view.photo.tobytes() for view in second]
    assert any(view.things.any() for view in first)
    shard = QuickShard.of(first)
    shard.save(tmp_path / "shard.npz")
    read = QuickShard.load(tmp_path / "shard.npz")
    for number, view in enumerate(first):
        np.testing.assert_array_equal(read.view(number).things, view.things)
    old = {
        name: value for name, value in shard.to_arrays().items() if name != "things"
    }  # as files of version 1 are
    assert not QuickShard.from_arrays(old).view(0).things.any()
