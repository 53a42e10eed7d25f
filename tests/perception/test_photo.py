from __future__ import annotations

import io
import sys

import numpy as np
import pytest
from PIL import Image

from a2v.errors import InputError
from a2v.perception import decode_mask, decode_photo
from a2v.perception.photo import focal_length
from a2v.system import peak_memory


def encode(image: Image.Image, kind: str = "PNG", **options: object) -> bytes:
    stream = io.BytesIO()
    image.save(stream, kind, **options)
    return stream.getvalue()


@pytest.fixture(scope="module")
def ramp() -> np.ndarray:
    x, y = np.meshgrid(np.linspace(0, 255, 160), np.linspace(0, 255, 200))
    return np.stack([x, y, 255 - x], axis=-1).astype(np.uint8)


def test_rgb_is_returned_as_it_is(ramp: np.ndarray) -> None:
    assert np.array_equal(decode_photo(encode(Image.fromarray(ramp))), ramp)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_exif_orientation_is_applied(ramp: np.ndarray, orientation: int) -> None:
    # stored pixels that the tag turns back into `ramp`
    undo = {
        1: lambda a: a,
        2: lambda a: a[:, ::-1],
        3: lambda a: a[::-1, ::-1],
        4: lambda a: a[::-1],
        5: lambda a: a.swapaxes(0, 1),
        6: lambda a: np.rot90(a, 1),
        7: lambda a: np.rot90(a[:, ::-1], 3)[:, :] if False else np.rot90(a, 2).swapaxes(0, 1),
        8: lambda a: np.rot90(a, 3),
    }[orientation]
    exif = Image.Exif()
    exif[0x0112] = orientation
    data = encode(Image.fromarray(np.ascontiguousarray(undo(ramp))), exif=exif)
    assert np.array_equal(decode_photo(data), ramp)


def test_the_focal_length_is_read_where_there_is_one(ramp: np.ndarray) -> None:
    exif = Image.Exif()
    exif[0x8769] = {0xA405: 26}
    assert focal_length(encode(Image.fromarray(ramp), exif=exif)) == 26
    assert focal_length(encode(Image.fromarray(ramp))) is None
    exif[0x8769] = {0xA405: 0}  # what cameras write that do not know
    assert focal_length(encode(Image.fromarray(ramp), exif=exif)) is None
    assert focal_length(b"no picture") is None


def test_sixteen_bit_gray_keeps_its_tones() -> None:
    values = np.linspace(0, 65535, 160 * 160).reshape(160, 160)
    photo = decode_photo(encode(Image.fromarray(values.astype(np.uint16))))
    assert photo.shape == (160, 160, 3)
    assert np.abs(photo[..., 0] - values / 257).max() <= 1


def test_gray_palette_cmyk_and_bilevel(ramp: np.ndarray) -> None:
    image = Image.fromarray(ramp)
    assert (np.ptp(decode_photo(encode(image.convert("L"))), axis=2) == 0).all()
    assert np.abs(decode_photo(encode(image.quantize(256))).astype(int) - ramp).mean() < 12
    assert np.abs(decode_photo(encode(image.convert("CMYK"), "TIFF")).astype(int) - ramp).mean() < 3
    assert set(np.unique(decode_photo(encode(image.convert("1"))))) == {0, 255}


def test_alpha_is_kept_only_where_it_says_something(ramp: np.ndarray) -> None:
    alpha = np.full(ramp.shape[:2], 255, np.uint8)
    assert decode_photo(encode(Image.fromarray(np.dstack([ramp, alpha])))).shape[2] == 3
    alpha[:50] = 0
    photo = decode_photo(encode(Image.fromarray(np.dstack([ramp, alpha]))))
    assert np.array_equal(photo[..., 3], alpha)
    assert np.array_equal(
        decode_mask(encode(Image.fromarray(np.dstack([ramp, alpha])))), alpha / np.float32(255)
    )


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "WEBP"])
def test_truncated_files_are_named(ramp: np.ndarray, kind: str) -> None:
    data = encode(Image.fromarray(ramp), kind)
    with pytest.raises(InputError, match=r"holiday\.jpg is"):
        decode_photo(data[: len(data) // 2], "holiday.jpg")


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"hello",
        b"%PDF-1.4 nothing",
        b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 200 200\n",
        b"\x89PNG\r\n\x1a\n",
    ],
)
def test_what_is_no_image_is_refused(data: bytes) -> None:
    with pytest.raises(InputError, match="x is") as caught:
        decode_photo(data, "x")
    assert "\n" not in str(caught.value)


def test_size_is_bounded_before_decoding() -> None:
    with pytest.raises(InputError, match="at least 128"):
        decode_photo(encode(Image.new("RGB", (127, 400))))
    # 64 megapixels that unpack to a few hundred MB: the header alone must be enough
    with pytest.raises(InputError, match="60 megapixels"):
        decode_photo(encode(Image.new("1", (8000, 8000))))
    with pytest.raises(InputError, match=r"large|megapixels"):
        decode_photo(encode(Image.new("1", (30000, 30000))))


def test_large_photos_of_phones_are_reduced_while_they_are_decoded() -> None:
    """200 megapixels were refused; at a half of each side they take the memory of 50."""
    image = Image.new("L", (16320, 12240), 90)
    image.paste(200, (0, 0, 8160, 12240))
    data = encode(image, "JPEG")
    with peak_memory() as peak:
        before = peak()
        found = decode_photo(data)
        assert peak() - before < 700 << 20
    assert found.shape == (6120, 8160, 3)
    assert abs(int(found[:, :4000].mean()) - 200) <= 1
    assert abs(int(found[:, 4200:].mean()) - 90) <= 1
    with pytest.raises(InputError, match="large"):  # nothing else may be as large
        decode_photo(encode(Image.new("1", (16320, 12240))))


def test_photos_of_iphones(monkeypatch: pytest.MonkeyPatch) -> None:
    """HEIC is read where pillow-heif is installed; else the sentence says what it is."""
    data = b"\0\0\0\x1cftypheic" + bytes(200)
    with pytest.raises(InputError, match="x is"):  # damaged
        decode_photo(data, "x")
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "pillow_heif", None)
        with pytest.raises(InputError, match=r"x is a HEIC photo.*pip install 'a2v\[heic\]'"):
            decode_photo(data, "x")
    pillow_heif = pytest.importorskip("pillow_heif")
    image = Image.new("RGB", (300, 200), (200, 40, 40))
    image.paste((40, 40, 200), (0, 0, 150, 200))
    stream = io.BytesIO()
    pillow_heif.from_pillow(image).save(stream, quality=95)
    found = decode_photo(stream.getvalue())
    assert found.shape == (200, 300, 3)
    np.testing.assert_allclose(found[100, [20, 280]], [[40, 40, 200], [200, 40, 40]], atol=12)
    with pytest.raises(InputError, match=r"damaged|can be read"):
        decode_photo(stream.getvalue()[: len(stream.getvalue()) // 2])
