"""Several photos of one person: requests, shared results with one photo, and a character."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
from PIL import Image, ImageOps

import a2v
from a2v.errors import InputError
from a2v.types import Body, Character, Surface
from pipelines.commands import reconstruct
from pipelines.commands.video import caption_of
from pipelines.engine.graph import build
from pipelines.engine.store import Store
from pipelines.graph import video_graph
from pipelines.options import parse
from pipelines.requests.person import MOST_PHOTOS, PersonRequest
from pipelines.run import run

SAMPLE = Path(__file__).resolve().parents[2] / "a2v" / "samples" / "person.jpg"


@pytest.fixture(scope="module")
def photos(tmp_path_factory) -> list[str]:
    """The sample's person at half size, and its mirror image unchanged and half as bright."""
    folder, whole = tmp_path_factory.mktemp("photos"), Image.open(SAMPLE)
    plain = whole.resize((whole.width // 2, whole.height // 2))
    plain.save(folder / "plain.jpg", quality=95)
    picture = ImageOps.mirror(plain)
    picture.save(folder / "mirrored.jpg", quality=95)
    picture.point([value // 2 for value in range(256)] * 3).save(folder / "dark.jpg", quality=95)
    return [str(folder / f"{name}.jpg") for name in ("plain", "mirrored", "dark")]


def asked(*words: str) -> PersonRequest:
    return parse(
        reconstruct.Options,
        [*words, "--out", "o.glb"],
        command="reconstruct",
        about="",
        examples="",
    ).person


def test_an_option_that_is_given_again_means_a_further_photo():
    assert asked("--photo", "a.jpg").more is None
    several = asked("--photo", "a.jpg", "--photo=b.jpg", "--photo", "c.jpg")
    assert (several.photo, several.more) == ("a.jpg", "b.jpg,c.jpg")
    assert several == asked("--photo", "a.jpg", "--more", "b.jpg,c.jpg")


def test_the_order_of_the_further_photos_means_nothing(photos, tmp_path):
    one, two, three = photos
    store = Store(tmp_path)
    first = PersonRequest.of(photo=one, more=f"{two},{three}").resolve(store)
    assert [ref.digest for ref in first["other"]] == [
        ref.digest
        for ref in PersonRequest.of(photo=one, more=f"{three},{two}").resolve(store)["other"]
    ]
    assert (
        first["photo"] != PersonRequest.of(photo=two, more=f"{one},{three}").resolve(store)["photo"]
    )


def test_one_photo_is_asked_for_as_before(photos, tmp_path):
    assert "other" not in PersonRequest.of(photo=photos[0]).resolve(Store(tmp_path))
    assert not any("other" in (step.mapspec or "") for step in video_graph())


def test_too_many_photos_and_one_twice_are_refused(photos, tmp_path):
    with pytest.raises(InputError, match=f"at most {MOST_PHOTOS}"):
        PersonRequest.of(
            photo="0.jpg", more=",".join(f"{number}.jpg" for number in range(MOST_PHOTOS))
        ).resolve(Store(tmp_path))
    with pytest.raises(InputError, match="given twice"):
        PersonRequest.of(photo=photos[0], more=photos[0]).resolve(Store(tmp_path))
    with pytest.raises(InputError, match="no photo given"):
        a2v.make_character()


def test_both_graphs_are_sound_and_give_the_same_values(tmp_path):
    for recorded in (False, True):
        build(video_graph(recorded=recorded, several=True), store=Store(tmp_path))
    outputs = [
        {name for step in video_graph(several=several) for name in step.outputs}
        for several in (False, True)
    ]
    assert (
        outputs[0]
        - {
            "reading",
            "surface_with_hands",
            "face_draft",
            "color_draft",
            "color_with_face",
        }
        <= outputs[1]
    )


def test_a_character_is_made_of_two_photos_and_a_third_one_finds_their_people_known(
    photos, tmp_path
):
    store, quick = (
        Store(tmp_path),
        {
            "backend": "body-prior",
            "fit.rounds": 1,
            "fit.steps": 20,
            "fit.starts": 0,
            "shape.resolution": 200,
            "shape.vertices": 25_000,
            "color.texture": 256,
            "color.synthesis": False,
        },
    )
    given = PersonRequest.of(photo=photos[0], more=photos[1], **quick).resolve(store)
    made = run(["character", "body", "colored_surface"], store=store, executor="serial", **given)
    character, colored = made.get("character", Character), made.get("colored_surface", Surface)
    assert character.surface.texture is not None
    assert colored.provenance["photos"] == 2
    assert len(colored.provenance["exposures"]) == 1
    assert made.get("body", Body).model == "anny"
    again = run(
        ["subject", "other_subject", "each_fit"],
        store=store,
        executor="serial",
        **PersonRequest.of(photo=photos[0], more=",".join(photos[1:]), **quick).resolve(store),
    )
    assert again.nodes["subject"].cached == 1
    assert (again.nodes["other_subject"].calls, again.nodes["other_subject"].cached) == (2, 1)
    assert (again.nodes["each_fit"].calls, again.nodes["each_fit"].cached) == (3, 2)


@pytest.mark.parametrize("node", ["photo_body", "joint_fit"])
def test_the_sheet_names_camera_limbs_and_second_photo_of_the_final_fit(node):
    camera = {"distance": 2.5, "distance_from": "given", "field_of_view": 50.2}
    told = {"camera": camera, "limb_errors": {"left_arm": 0.2}, "second_photo": "left"}
    nodes = {node: SimpleNamespace(measures=told), "each_fit": SimpleNamespace(measures={})}
    lines = caption_of(SimpleNamespace(nodes=nodes))
    assert lines == [
        "camera 2.5 m away, 50 degrees wide (given)",
        "expected error in depth: left arm 20 cm",
        "best second photo: left",
    ]
    assert caption_of(SimpleNamespace(nodes={})) == []


def test_several_photos_need_the_canonical_character(photos, tmp_path):
    for values in ({"character": "fused"}, {"fit.model": "SMPLX_NEUTRAL.npz"}):
        with pytest.raises(InputError, match="canonical"):
            PersonRequest.of(photo=photos[0], more=photos[1], **values).resolve(Store(tmp_path))
