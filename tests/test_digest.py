"""The one kind of digest."""

from __future__ import annotations

import pytest

from a2v.digest import Digest
from a2v.io import sha256
from a2v.motion.plan import plan_motion
from pipelines.engine.memo import plain, refs_within
from pipelines.engine.refs import File, Ref


def test_a_digest_holds_forty_digits_and_nothing_else(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"content")
    assert Digest.of_file(path) == Digest.of(b"content") == Digest.of("con", b"tent")
    assert File.of(path).digest == Digest.of_file(path)
    for other in (sha256(path), "", "0" * 39, "G" * 40, "0" * 40 + "\n"):
        with pytest.raises(ValueError, match="no digest"):
            Digest(other)


@pytest.mark.parametrize("words", ["Wave", "walk, then wave", "Walk"])
def test_a_plan_is_named_by_a_digest_that_the_store_takes(words):
    plan = plan_motion(words)
    assert isinstance(plan.digest, Digest)
    assert list(refs_within(File(plan.path, plan.digest))) == [Ref(plan.digest)]


def test_a_key_holds_plain_text():
    assert type(plain(Digest.of(b""))) is str
