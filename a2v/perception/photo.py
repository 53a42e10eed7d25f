"""Decoding of photos and masks: bounded, upright, always 8 bits of sRGB."""

from __future__ import annotations

import io
import warnings
from typing import TYPE_CHECKING

import numpy as np

from a2v.errors import InputError
from a2v.io import shorten
from a2v.types import ByteArray, FloatArray

if TYPE_CHECKING:
    from PIL.Image import Image as PillowImage

MIN_SIDE = 128
"""Smallest width and height of a photo, pixels."""
MAX_PIXELS = 60_000_000
"""Largest photo, pixels; checked on the header, before anything is decoded."""
MAX_JPEG_PIXELS = 250_000_000
"""Largest JPEG, pixels: phones have 108 and 200 megapixels. One over `MAX_PIXELS` is decoded at a
half or a quarter of its size, which takes the memory of the smaller one."""
MAX_BYTES = 512 << 20
"""Largest encoded photo, bytes."""

_HEIF = (b"heic", b"heix", b"hevc", b"heim", b"heis", b"mif1", b"msf1")
"""Brands of HEIC, the photos of iPhones, at bytes 8 to 12."""
_EXIF = 0x8769
"""EXIF's own directory."""
_FOCAL_35 = 0xA405
"""The tag FocalLengthIn35mmFilm in EXIF's directory."""
_FOCAL = (8.0, 1200.0)
"""Smallest and largest possible focal length, millimeters."""

_FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP", "GIF", "PPM", "JPEG2000", "AVIF")
"""Pillow's names of the formats that are read. None starts another program; MPO is opened as JPEG;
old versions of Pillow have no AVIF."""


def decode_photo(data: bytes, name: str = "photo") -> ByteArray:
    """Decode an encoded photo to upright 8-bit sRGB.

    Gray, palette, CMYK, 16-bit and float images are converted; an embedded color profile is
    applied; EXIF orientation is applied; of an animation the first frame is taken.

    Parameters
    ----------
    data : bytes
        The file's content (JPEG, PNG, WebP, TIFF, BMP, GIF, PPM; HEIC where pillow-heif is
        installed). A JPEG over `MAX_PIXELS` is reduced.
    name : str
        Name in error messages, usually the file's.

    Returns
    ------- (H, W, 3) uint8, or (H, W, 4) if the photo has an alpha channel that is not fully
    opaque; row 0 is the top.

    Raises
    ------
    InputError
        The data is not an image, damaged or truncated, or its size is under `MIN_SIDE` or over
        `MAX_PIXELS`, or it is a HEIC and pillow-heif is not installed.
    """
    pixels = _decode(data, name, minimum=MIN_SIDE)
    if pixels.shape[2] == 4 and (pixels[..., 3] == 255).all():
        pixels = pixels[..., :3]
    return np.ascontiguousarray(pixels)


def focal_length(data: bytes) -> float | None:
    """Return the focal length in a photo's EXIF data, 35 mm equivalent, millimeters; None if it is
    missing or impossible."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            with _opened(data, "photo") as image:
                focal = float(image.getexif().get_ifd(_EXIF).get(_FOCAL_35) or 0)
        except (
            Exception
        ):  # Pillow raises many kinds of errors for damaged tags; a photo is valid without them
            return None
    return focal if _FOCAL[0] <= focal <= _FOCAL[1] else None


def decode_mask(data: bytes, name: str = "mask") -> FloatArray:
    """Decode an encoded mask to (H, W) float32 in [0, 1]: its alpha channel if present, else its
    brightness.

    Raises
    ------
    InputError
        See `decode_photo`.
    """
    pixels = _decode(data, name, minimum=1)
    if pixels.shape[2] == 4 and (pixels[..., 3] != 255).any():
        return pixels[..., 3].astype(np.float32) / np.float32(255)
    return np.asarray(pixels[..., :3].max(axis=2) / np.float32(255), np.float32)


def _decode(data: bytes, name: str, minimum: int) -> ByteArray:
    from PIL import Image, ImageOps

    if not isinstance(data, bytes | bytearray | memoryview):
        raise TypeError(f"decode_photo takes the file's bytes, not {type(data).__name__}")
    if len(data) == 0:
        raise InputError(f"{name} is empty (0 bytes); expected a JPEG, PNG or WebP photo")
    if len(data) > MAX_BYTES:
        raise InputError(f"{name} has {len(data) >> 20} MB; expected at most {MAX_BYTES >> 20} MB")
    too_large = f"expected at most {MAX_PIXELS // 1_000_000} megapixels; shrink the photo first"
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore"
        )  # Pillow warns about sizes that are refused below, and about unusual metadata
        try:
            image = _opened(data, name)
        except InputError:
            raise
        except Image.DecompressionBombError:
            raise InputError(f"{name} is far too large; {too_large}") from None
        except Exception:  # Pillow's plug-ins raise many kinds of errors for damaged headers
            raise InputError(
                f"{name} is not an image that can be read; expected a JPEG, PNG or WebP photo"
            ) from None
        width, height = image.size
        if image.format == "JPEG" and MAX_PIXELS < width * height <= MAX_JPEG_PIXELS:
            image.draft("RGB", (width // 2, height // 2))
        if image.size[0] * image.size[1] > MAX_PIXELS:
            raise InputError(f"{name} has {width} x {height} pixels; {too_large}")
        if min(width, height) < minimum:
            raise InputError(
                f"{name} has {width} x {height} pixels; expected at least {minimum} on each side; "
                "use a larger photo"
            )
        try:
            image.load()
            return _to_bytes(ImageOps.exif_transpose(_to_srgb(image)))
        except (MemoryError, KeyboardInterrupt):
            raise
        except Exception as error:
            raise InputError(
                f"{name} is damaged or truncated ({shorten(error)}); copy or export the photo again"
            ) from None


def _opened(data: bytes, name: str) -> PillowImage:
    """Open an image; only its header is read."""
    from PIL import Image, JpegImagePlugin

    if data[4:8] == b"ftyp" and data[8:12] in _HEIF:
        try:
            import pillow_heif
        except ImportError:
            raise InputError(
                f"{name} is a HEIC photo, as iPhones make them; read it after: pip install "
                "'a2v[heic]', or save it as JPEG"
            ) from None
        opened: PillowImage = pillow_heif.HeifImageFile(io.BytesIO(data))
        return opened
    if data[:3] == b"\xff\xd8\xff":  # without Pillow's bound, which is below `MAX_JPEG_PIXELS`
        return JpegImagePlugin.JpegImageFile(io.BytesIO(data))
    Image.init()
    formats = [form for form in _FORMATS if form in Image.OPEN]
    return Image.open(io.BytesIO(data), formats=formats)


def _to_srgb(image: PillowImage) -> PillowImage:
    """Apply an embedded profile (phones save Display P3, print shops CMYK); a broken profile is
    ignored."""
    from PIL import ImageCms

    profile = image.info.get("icc_profile")
    if not profile or image.mode not in ("RGB", "RGBA", "CMYK"):
        return image
    try:
        source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        mode = "RGBA" if image.mode == "RGBA" else "RGB"
        converted = ImageCms.profileToProfile(
            image, source, ImageCms.createProfile("sRGB"), outputMode=mode
        )
    except (ImageCms.PyCMSError, OSError, ValueError):
        return image
    if converted is None:
        return image
    converted.info = {key: value for key, value in image.info.items() if key != "icc_profile"}
    converted.getexif().update(image.getexif())
    return converted


def _white_value(highest: float) -> float:
    """Return the value of white for whole numbers up to `highest`: that of 8, 16 or 32 bits."""
    return 255.0 if highest <= 255 else 65535.0 if highest <= 65535 else 2147483647.0


def _to_bytes(image: PillowImage) -> ByteArray:
    if image.mode in ("I", "F") or image.mode.startswith("I;16"):
        values = np.asarray(image, dtype=np.float32)
        if not np.isfinite(values).all():
            raise ValueError("it holds NaN or infinite values")
        if image.mode == "F":
            top = 1.0 if values.max(initial=0) <= 1 else 255.0 if values.max() <= 255 else 65535.0
        else:
            top = _white_value(values.max(initial=0)) if image.mode == "I" else 65535.0
        gray = (np.clip(values / np.float32(top), 0, 1) * 255 + 0.5).astype(np.uint8)
        return np.repeat(gray[..., None], 3, axis=2)
    alpha = image.mode in ("RGBA", "LA", "PA", "La", "RGBa") or "transparency" in image.info
    return np.asarray(image.convert("RGBA" if alpha else "RGB"))
