"""The page that generates motions, in a real browser without network, agrees with Python."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
import pytest
from playwright.sync_api import Browser, Page, expect

from a2v import Character, InputError, MissingDependencyError
from a2v.animation import RetargetSettings, retarget
from a2v.animation.life import STILL
from a2v.animation.rig import rig_of
from a2v.formats import read_motion
from a2v.formats.gltf import write_glb
from a2v.formats.gltf.reading import read_glb
from a2v.motion import MotionModel
from a2v.motion.model import MotionModel as Model
from a2v.motion.page import PACKAGES, page_graph, write_motion_page
from a2v.motion.placement import place_on_ground
from pipelines.cli import main
from tests.support.browser import SOFTWARE, calm, chromium
from tests.support.npm import npm_folder
from tests.support.page import CONTRAST, NAMELESS


@pytest.fixture(scope="module")
def model() -> Model:
    return MotionModel.load("cmu-fine")


@pytest.fixture(scope="module")
def packages() -> Iterator[Path]:
    """onnxruntime-web from npm, in an ignored folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("A2V_PAGE", str(npm_folder("page", *PACKAGES.packages)))
        yield PACKAGES.modules


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium("--no-sandbox", *SOFTWARE) as opened:
        yield opened


@pytest.fixture(scope="module")
def visit(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Open a file; at the end nothing has failed and nothing was requested."""
    asked: list[str] = []
    errors: list[str] = []

    def opened(path: Path, query: str = "", **how: Any) -> Page:
        page = browser.new_page(**how)
        calm(page)
        page.on("request", lambda request: asked.append(request.url))
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda line: errors.append(line.text))
        page.set_default_timeout(120_000)  # a busy machine
        page.goto(f"{path.as_uri()}#{query}")
        page.wait_for_selector("body:not([data-state=loading])")
        expect(page.locator("body")).to_have_attribute("data-state", "ready")
        return page

    yield opened
    assert [url for url in asked if not url.startswith(("file:", "blob:", "data:"))] == []
    assert errors == []


@pytest.fixture(scope="module")
def path(packages: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("page") / "motions.html"
    assert (
        main(
            [
                "motion-page",
                "--out",
                str(target),
                "--action",
                "run",
                "--seed",
                "4",
                "--seconds",
                "2",
            ]
        )
        == 0
    )
    return target


@pytest.fixture(scope="module")
def page(path: Path, visit: Callable[..., Page]) -> Page:
    return visit(path, "time=0.5", viewport={"width": 1000, "height": 700})


SAMPLE = """async ([labels, noise, guidance]) => {
  const parts = noise.map(part => Float32Array.from(part));
  return Array.from(await a2v.sample({ labels, draw: () => parts.shift(), ...(guidance ? { guidance } : {}) }));
}"""


PLAYED = """([poses, names, parents]) => {
  a2v.figure().begin({ joints: Float32Array.from(poses.flat()), parents });
  return poses.map(pose => { a2v.figure().pose(pose); return names.map(name => a2v.figure().placeOf(name).toArray()); });
}"""


def sampled(
    page: Page,
    model: Model,
    labels: np.ndarray,
    noise: list[np.ndarray],
    guidance: float | None = None,
) -> np.ndarray:
    """Return the joints (T, J, 3) that the page generates from given noise."""
    given = [labels.tolist(), [part.ravel().tolist() for part in noise], guidance]
    return np.array(page.evaluate(SAMPLE, given), np.float32).reshape(len(labels), -1, 3)


def expected(model: Model, labels: np.ndarray, noise: list[np.ndarray]) -> np.ndarray:
    """Return those of Python."""
    parts = list(noise)
    joints, _ = model.generate(
        labels[None], model.bone_lengths[None], lambda shape, at: parts.pop(0).reshape(shape)
    )
    return place_on_ground(joints, model.card.frames)[0]


@pytest.mark.slow
def test_the_same_noise_gives_the_same_motion(page: Page, model: Model) -> None:
    noise = list(
        np.random.default_rng(0).standard_normal((12, model.card.latent_size), dtype=np.float32)
    )
    for labels in (
        np.full(60, model.label("Salsa")),
        np.full(260, model.label("Walk")),
        np.repeat([model.label("Run"), 3], 40),
    ):
        found, ours = sampled(page, model, labels, noise), expected(model, labels, noise)
        np.testing.assert_allclose(found, ours, atol=1e-3)
        assert np.ptp(ours[:, 0], axis=0).max() > 0.05  # they move


@pytest.mark.slow
def test_a_seed_means_what_it_means_in_python(page: Page, model: Model) -> None:
    for seed in (0, 4, 2**40 + 17):
        drawn = page.evaluate(
            "seed => { const draw = normalNoise(seed); return [...draw(3001), ...draw(1000)]; }",
            seed,
        )
        np.testing.assert_allclose(
            drawn, np.random.default_rng(seed).standard_normal(4001, dtype=np.float32), atol=1e-6
        )
    label = model.label("Jump")
    found = page.evaluate(
        f"async () => Array.from(await a2v.sample({{ labels: new Array(50).fill({label}), seed: 7 "
        f"}}))"
    )
    np.testing.assert_allclose(
        np.reshape(found, (50, -1, 3)), model.sample("Jump", frames=50, seed=7).joints, atol=1e-3
    )


@pytest.mark.slow
def test_what_is_chosen_is_made(page: Page, path: Path) -> None:
    told = page.locator("#told")
    expect(told).to_contain_text("Run, made in")
    expect(told).to_contain_text(
        "a2v motion --model cmu-fine --action Run --seed 4 --seconds 2 --out clip.bvh"
    )
    page.locator("#search").focus()
    page.keyboard.type("salsa")
    page.keyboard.press("Enter")
    expect(told).to_contain_text("Salsa, made in")
    page.keyboard.press("Control+A")
    page.keyboard.type("walk")
    assert page.locator("#actions label:visible").count() > 5
    page.keyboard.press("ArrowDown")
    expect(told).to_contain_text("Walk, made in")
    page.keyboard.press("ArrowDown")  # on in the list
    expect(told).to_contain_text("Walk on uneven terrain, made in")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.id") == "seed"
    page.keyboard.press("ArrowUp")
    expect(told).to_contain_text("--seed 5")
    page.locator("#guidance").focus()
    page.keyboard.press("End")
    expect(told).to_contain_text("Guidance is not the model's own")


def saved(page: Page, button: str, folder: Path) -> Path:
    with page.expect_download() as download:
        page.get_by_role("button", name=button).click()
    path = folder / download.value.suggested_filename
    download.value.save_as(path)
    return path


POSES = "async () => { const clip = await a2v.clip(); return framesOf(clip, clip.fps).map(pose => Array.from(pose)); }"


@pytest.mark.slow
def test_a_clip_is_saved_as_bvh_and_glb(
    path: Path, model: Model, visit: Callable[..., Page], tmp_path: Path
) -> None:
    page = visit(
        path, "action=salsa&seed=3&seconds=3&time=1", viewport={"width": 900, "height": 700}
    )
    poses = np.array(page.evaluate(POSES)).reshape(-1, len(model.card.joint_names), 3)
    motion = read_motion(saved(page, "Save BVH", tmp_path))
    assert motion.fps == pytest.approx(30)
    assert set(motion.joint_names) == set(model.card.joint_names)
    order = [motion.joint_names.index(name) for name in model.card.joint_names]
    np.testing.assert_allclose(
        motion.joints[:, order], poses, atol=2e-3
    )  # every joint where the page has it
    glb = read_glb(saved(page, "Save GLB", tmp_path))
    assert [clip["name"] for clip in glb.items("animations")] == ["Salsa"]
    assert len(glb.items("nodes")) == len(model.card.joint_names) - 1
    assert len(glb.items("animations")[0]["channels"]) == 2 * len(glb.items("nodes"))


@pytest.mark.slow
def test_several_actions_and_an_address_that_tells_them(
    path: Path, visit: Callable[..., Page], model: Model
) -> None:
    page = visit(path, "time=0.5", viewport={"width": 900, "height": 700})
    page.locator("#search").fill("walk for 2 s, then jump for 1 s")
    page.keyboard.press("Enter")
    expect(page.locator("#told")).to_contain_text("2 actions, made in")
    expect(page.locator("#parts button")).to_have_text(["Walk 2 s ×"])
    frames = page.evaluate(
        "async () => { const clip = await a2v.clip(); return clip.joints.length / 3 / "
        "clip.parents.length; }"
    )
    assert frames == 3 * model.card.fps
    joints = page.evaluate("async () => Array.from((await a2v.clip()).joints)")
    again = visit(path, page.url.split("#")[1], viewport={"width": 900, "height": 700})
    assert again.evaluate("async () => Array.from((await a2v.clip()).joints)") == joints
    again.locator("#parts button").click()
    expect(again.locator("#told")).to_contain_text("Jump, made in")
    again.get_by_role("button", name="Then another action").click()
    expect(again.locator("#parts button")).to_have_text(["Jump 1 s ×"])
    again.locator("#search").fill("walk, then qwertz")
    again.keyboard.press("Enter")
    expect(again.locator("#told")).to_have_text('No action of this page is called "qwertz".')


@pytest.mark.slow
def test_it_is_readable_on_a_phone(page: Page) -> None:
    before = page.viewport_size
    page.set_viewport_size({"width": 360, "height": 740})
    assert page.evaluate("document.scrollingElement.scrollWidth") <= 360
    assert page.evaluate(CONTRAST) == []
    assert page.evaluate(NAMELESS) == []
    assert before is not None
    page.set_viewport_size(before)


@pytest.mark.slow
def test_a_character_plays_what_a_vae_makes(
    character: Character, packages: Path, visit: Callable[..., Page], tmp_path: Path
) -> None:
    model = MotionModel.load("cmu-glmi-m")
    write_glb(tmp_path / "c.glb", character)
    write_motion_page(tmp_path / "c.html", model, tmp_path / "c.glb", action="Walk", seconds=2)
    page = visit(tmp_path / "c.html", "time=1", viewport={"width": 400, "height": 300})
    labels, noise = (
        np.zeros(24, np.int64),
        [np.random.default_rng(1).standard_normal((24, model.card.latent_size), dtype=np.float32)],
    )
    joints = sampled(page, model, labels, noise)
    np.testing.assert_allclose(joints, expected(model, labels, noise), atol=1e-3)
    made = model.to_motion(
        joints[None],
        np.zeros_like(joints[None]),
        lengths=model.bone_lengths,
        names=["Walk"],
        seed=0,
    )[0]
    rig = rig_of(character.body)
    names = [
        name
        for name in rig.bones
        if not name.startswith("spine") and not name.endswith(("thumb", "hand"))
    ]
    ours = retarget(
        made,
        character.body,
        settings=RetargetSettings(raw=True, align=False, limits=False, smoothing=0, life=STILL),
    )
    ours = ours[..., :3, 3][:, [rig.bones[name] for name in names]]
    theirs = np.array(
        page.evaluate(PLAYED, [made.joints.reshape(24, -1).tolist(), names, made.parents.tolist()])
    )
    assert np.linalg.norm(theirs - ours, axis=-1).mean() < 0.035
    assert np.linalg.norm(theirs - theirs[:1], axis=-1).max() > 0.3
    glb, whole = read_glb(saved(page, "Save GLB", tmp_path)), read_glb(tmp_path / "c.glb")
    assert len(glb.items("animations")) == 1
    assert len(glb.items("nodes")) == len(whole.items("nodes"))
    assert glb.items("meshes") == whole.items("meshes")
    assert {channel["target"]["path"] for channel in glb.items("animations")[0]["channels"]} == {
        "rotation",
        "translation",
    }


@pytest.mark.parametrize(
    ("name", "guided"), [("cmu-fine", True), ("humanact12", True), ("cmu-glmi-m", False)]
)
def test_the_graph_takes_guidance_and_is_otherwise_the_file(name: str, guided: bool) -> None:
    model = MotionModel.load(name)
    graph, has = page_graph(model.path)
    assert has == guided
    session = onnxruntime.InferenceSession(graph, providers=["CPUExecutionProvider"])
    assert [item.name for item in session.get_outputs()] == ["joints"]
    if not guided:
        return
    card, rng = model.card, np.random.default_rng(0)
    feed = {
        "noise": rng.standard_normal((1, card.latent_size), dtype=np.float32),
        "actions": np.ones(1, np.int64),
        "active": np.ones(1, np.float32),
        "context": np.zeros((1, card.context_frames, len(card.joint_names), 3), np.float32),
        "has_context": np.zeros(1, np.float32),
        "bone_lengths": model.bone_lengths[None],
    }
    ours = model.sampler.run(
        feed["actions"], active=feed["active"], noise=feed["noise"], lengths=feed["bone_lengths"]
    )[0]
    strength = {"cmu-fine": 3.0, "humanact12": 1.5}[name]
    made = {
        by: session.run(["joints"], feed | {"guidance": np.array([by], np.float32)})[0]
        for by in (strength, 1.0)
    }
    np.testing.assert_allclose(made[strength], ours, atol=1e-4)
    assert np.abs(made[1.0] - ours).max() > 0.01


def test_what_a_page_cannot_be_is_told(
    model: Model,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("A2V_PAGE", str(tmp_path / "none"))
    with pytest.raises(
        MissingDependencyError, match=r"npm install --prefix .*none onnxruntime-web@"
    ):
        write_motion_page(tmp_path / "p.html", model)
    with pytest.raises(InputError, match="1 to 30 seconds"):
        write_motion_page(tmp_path / "p.html", model, seconds=90)
    with pytest.raises(InputError, match="unknown action"):
        write_motion_page(tmp_path / "p.html", model, action="qwertz")
    for given, words in (
        (["--count", "2"], "unknown option --count"),
        (["--action", "walk, then run"], "one action"),
    ):
        assert main(["motion-page", "--out", os.fspath(tmp_path / "p.html"), *given]) == 2
        assert words in capsys.readouterr().err
    assert main(["motion-page", "--out", os.fspath(tmp_path / "p.pdf")]) == 2
    assert main(["motion", "--action", "Walk"]) == 2
    assert list(tmp_path.iterdir()) == []
