"""Forgetting a photo removes everything computed from it, and nothing else."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest

from pipelines import cli
from pipelines.engine import forget as forget_module
from pipelines.engine.forget import forget, ref_of
from pipelines.engine.memo import memo
from pipelines.engine.refs import Ref
from pipelines.engine.store import IN_USE_SECONDS, Store, get, put, using
from pipelines.nodes.values import Blob


@memo()
def person(photo: Ref[Blob], mask: Ref[Blob] | None) -> Ref[Blob]:
    """A value made from a photo."""
    return put(Blob.of(b"person of " + bytes(get(photo, Blob))))


@memo()
def pose(number: int) -> Ref[Blob]:
    """A value made from no photo."""
    return put(Blob.of(b"pose %d" % number))


@memo()
def film(people: np.ndarray, poses: list[Ref[Blob]]) -> Ref[Blob]:
    """A value made from arrays of both."""
    return put(Blob.of(b" and ".join(bytes(get(ref, Blob)) for ref in [*people.ravel(), *poses])))


def array(*refs: Ref[Blob]) -> np.ndarray:
    found = np.empty(len(refs), dtype=object)
    found[:] = refs
    return found


@pytest.fixture
def store(tmp_path: Path) -> Store:
    """Two people's films, one with a mask, and a film of both."""
    store = Store(tmp_path / "store")
    with using(store):
        one, other = (put(Blob.of(name)) for name in (b"one", b"other"))
        people = [person(one, put(Blob.of(b"mask"))), person(other, None)]
        for who in (people[:1], people[1:], people):
            film(array(*who), [pose(1), pose(2)])
    return store


def texts(store: Store) -> set[bytes]:
    names = [path.parent.name + path.stem for path in (store.folder / "objects").glob("*/*.npz")]
    return {bytes(store.get(Ref[Blob](name), Blob)) for name in names}


def mentions(folder: Path, word: bytes) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file() and word in path.read_bytes()]


def test_what_depends_on_a_photo_goes_and_the_rest_stays(store: Store) -> None:
    gone = forget(store, [ref_of(Blob.of(b"one"))])
    assert texts(store) == {
        b"other",
        b"person of other",
        b"pose 1",
        b"pose 2",
        b"person of other and pose 1 and pose 2",
    }
    assert (gone.calls, gone.unknown, gone.values) == (
        3,
        0,
        5,
    )  # also the mask, which nobody else uses
    assert gone.bytes > 0
    with using(store):
        calls = set((store.folder / "calls").rglob("*.json"))
        film(array(person(Ref(ref_of(Blob.of(b"other")).digest), None)), [pose(1), pose(2)])
        assert set((store.folder / "calls").rglob("*.json")) == calls  # all of it was remembered
    assert forget(store, [ref_of(Blob.of(b"one"))]).values == 0


@pytest.mark.parametrize("steps", range(6))
def test_forgetting_that_was_cut_off_can_be_done_again(
    store: Store, monkeypatch: pytest.MonkeyPatch, steps: int
) -> None:
    """After any number of removed files the rest can still be found from the photo."""
    removed, remove = list[Path](), forget_module._remove

    def until_killed(store: Store, path: Path) -> None:
        if len(removed) == steps:
            raise KeyboardInterrupt
        removed.append(path)
        remove(store, path)

    with monkeypatch.context() as patched:
        patched.setattr(forget_module, "_remove", until_killed)
        with pytest.raises(KeyboardInterrupt):
            forget(store, [ref_of(Blob.of(b"one"))])
    forget(store, [ref_of(Blob.of(b"one"))], idle=-1.0)
    assert texts(store) == {
        b"other",
        b"person of other",
        b"pose 1",
        b"pose 2",
        b"person of other and pose 1 and pose 2",
    }


def test_what_a_stopped_run_left_goes_when_nobody_can_be_using_it(store: Store) -> None:
    left, photo = store.put(Blob.of(b"half of one")), store.put(Blob.of(b"waits"))
    torn = store.path(left).with_name(".torn-a2vabcdefgh.npz")
    torn.write_bytes(b"x")
    assert forget(store, [], keep=[photo]).values == 0
    assert not torn.exists()
    for ref in (left, photo):
        os.utime(store.path(ref), (time.time() - IN_USE_SECONDS - 1,) * 2)
    assert forget(store, [], keep=[photo]).values == 1
    assert store.has(photo)
    assert not store.has(left)


def test_records_that_do_not_say_what_they_are_of_go_too(store: Store) -> None:
    path = next((store.folder / "calls" / "film").rglob("*.json"))
    path.write_text(path.read_text().replace('"given"', '"taken"'))
    (store.folder / "calls" / "pose" / "zz").mkdir()
    (store.folder / "calls" / "pose" / "zz" / "y.json").write_text("[")
    gone = forget(store, [ref_of(Blob.of(b"nobody"))])
    assert (gone.calls, gone.unknown) == (0, 2)
    assert not path.exists()


def test_the_command_forgets_by_the_file(
    store: Store, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "me.jpg").write_bytes(b"one")
    assert (
        cli.main(["cache", "--forget", str(tmp_path / "me.jpg"), "--cache", str(store.folder)]) == 0
    )
    said = capsys.readouterr().out
    assert "3 results" in said
    assert "not removed" in said
    assert mentions(store.folder, b"person of one") == []
    assert b"person of other" in texts(store)
