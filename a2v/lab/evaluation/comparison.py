"""The same video by several methods, side by side on one page (the journal paper's Fig. 6, 16 and
19 to 24) and as a user study (Tables 5 and 6)."""

from __future__ import annotations

import base64
import html
import io
import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.lab.evaluation.survey import Film, SurveySettings, write_survey
from a2v.types import ByteArray

Films = Mapping[str, Mapping[str, Sequence[ByteArray]]]
"""Frames (S, S, 3) uint8 by method and view."""

STYLE = (
    ":root{color-scheme:light dark;--ink:#222;--page:#fff}"
    "@media(prefers-color-scheme:dark){:root{--ink:#e8edf2;--page:#161b21}}"
    "body{font-family:system-ui,sans-serif;margin:1.5em;background:var(--page);color:var(--ink)}"
    ".table{overflow-x:auto}table{border-collapse:collapse}"
    "td,th{padding:2px;font-weight:normal;text-align:center}th.m{text-align:right;padding-right:.7em}"
    "img,video{width:180px;display:block}"
    ":focus-visible{outline:3px solid #3d7fd6;outline-offset:2px}"
)


def write_comparison(
    path: str | os.PathLike[str],
    films: Films,
    *,
    action: str,
    fps: float,
    shown: int = 5,
    about: str = "",
) -> None:
    """Write one self-contained page: every method's videos, then the same frames of all of them,
    view by view.

    Parameters
    ----------
    path
        Ends in ``.html``.
    films : Films
        Every method has the same views and number of frames.
    shown : int
        Number of frames of each view that are shown as pictures, evenly spread.
    about : str
        A line below the heading.

    Raises
    ------
    InputError
        No film, films of several lengths or views, or `path` does not end in .html.
    """
    if Path(path).suffix.lower() != ".html":
        raise InputError(f"cannot write {path}; expected a name that ends in .html")
    lengths = {len(frames) for views in films.values() for frames in views.values()}
    names = {tuple(views) for views in films.values()}
    if len(lengths) != 1 or len(names) != 1 or not shown >= 1:
        raise InputError(
            f"{len(films)} methods have films of {sorted(lengths)} frames; expected "
            "equal lengths and views, and at least 1 shown frame"
        )
    views, count = next(iter(names)), next(iter(lengths))
    chosen = np.unique(np.linspace(0, count - 1, min(shown, count)).round().astype(int))
    parts = [
        f"<h1>{html.escape(action)}</h1><p>{html.escape(about)}</p>",
        _table(
            "videos",
            views,
            {m: [_video(f[v], fps, f"{m}, {v}") for v in views] for m, f in films.items()},
        ),
    ]
    for view in views:
        rows = {
            method: [
                _picture(own[view][index], f"{method}, {view}, frame {index + 1}")
                for index in chosen
            ]
            for method, own in films.items()
        }
        parts.append(_table(view, [f"frame {index + 1}" for index in chosen], rows))
    page = (
        "<!doctype html><html lang=en><meta charset=utf-8>"
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(action)}</title><style>{STYLE}</style>"
        f"<main>{''.join(parts)}</main></html>"
    )
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def write_comparison_survey(
    path: str | os.PathLike[str],
    films: Films,
    *,
    action: str,
    fps: float,
    settings: SurveySettings | None = None,
) -> Path:
    """Write the user study about the same films, a ranking of all methods for each view; returns
    the key's path. Errors as of `write_survey`."""
    sources = {
        method: {
            f"{action}, {view}": [Film(action, film_bytes(frames, fps))]
            for view, frames in own.items()
        }
        for method, own in films.items()
    }
    asked = settings or SurveySettings(
        preference=len(next(iter(films.values()))), real_or_fake=0, title="Which video looks right?"
    )
    return write_survey(path, sources, asked)


def film_bytes(frames: Sequence[ByteArray], fps: float) -> bytes:
    """Frames (S, S, 3) as the bytes of an MP4."""
    from a2v.rendering.video import write_video

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        write_video(path, frames, fps, crf=23)
        return path.read_bytes()


def _table(heading: str, columns: Sequence[str], rows: Mapping[str, Sequence[str]]) -> str:
    head = "".join(f"<th>{html.escape(name)}</th>" for name in columns)
    body = "".join(
        (
            "<tr><th "
            f"class=m>{html.escape(name)}</th>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"
        )
        for name, cells in rows.items()
    )
    name = html.escape(heading)
    return (
        f'<h2>{name}</h2><div class=table tabindex=0 role=region aria-label="{name}">'
        f"<table><tr><th>method</th>{head}</tr>{body}</table></div>"
    )


def _video(frames: Sequence[ByteArray], fps: float, name: str) -> str:
    data = base64.b64encode(film_bytes(frames, fps)).decode()
    return (
        f'<video controls autoplay loop muted playsinline aria-label="{html.escape(name)}" '
        f'src="data:video/mp4;base64,{data}"></video>'
    )


def _picture(frame: ByteArray, name: str) -> str:
    import PIL.Image

    buffer = io.BytesIO()
    PIL.Image.fromarray(frame).save(buffer, "jpeg", quality=90)
    data = base64.b64encode(buffer.getvalue()).decode()
    return f'<img src="data:image/jpeg;base64,{data}" alt="{html.escape(name)}">'
