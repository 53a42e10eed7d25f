"""Write and execute notebooks, and keep what git stores of them small.

    python scripts/make_notebooks.py                             all of notebooks/*.py
    python scripts/make_notebooks.py notebooks/05_*.py           some
    python scripts/make_notebooks.py --shrink notebooks/05_*.py  only shrink the stored outputs

A picture of a stored output takes at most `PICTURE_BYTES`, a notebook at most `NOTEBOOK_BYTES`:
pictures become JPEG or lose pixels, and views that can be turned, widgets and finished progress
bars are left out of the stored copy.
"""

from __future__ import annotations

import argparse
import base64
import io
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from PIL import Image

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
PICTURE_BYTES = 60_000
"""Of a picture, as base64 in the notebook's file."""
NOTEBOOK_BYTES = 600_000
"""Of a notebook's file."""
VIEW_BYTES = 200_000
"""Of a piece of HTML, such as a video that plays; a larger one is left out."""
QUALITY = 82
"""Of JPEG; lines of plots stay clear at it."""
WIDGET = "application/vnd.jupyter.widget-view+json"
"""Kind of outputs that need a running kernel."""
LEFT_OUT = "<p><i>A view of {megabytes:.1f} MB stands here once the cell is run.</i></p>"


def encoded(picture: Image.Image, kind: str) -> str:
    """The picture in the file format `kind` ("png" or "jpeg") as base64."""
    stream = io.BytesIO()
    how = {"png": {"optimize": True}, "jpeg": {"quality": QUALITY, "subsampling": 0}}[kind]
    picture.save(stream, kind, **how)
    return base64.b64encode(stream.getvalue()).decode()


def smaller(text: str, limit: int) -> tuple[str, str]:
    """A picture (base64) that takes at most `limit` bytes, and its kind: "png" or "jpeg"."""
    with Image.open(io.BytesIO(base64.b64decode(text))) as opened:
        kept = "png" if opened.format == "PNG" else "jpeg"
        picture = Image.new("RGB", opened.size, "white")
        picture.paste(opened, mask=opened.convert("RGBA").getchannel("A"))
    if len(text) <= limit:
        return text, kept
    scale = 1.0
    while True:
        size = max(1, round(picture.width * scale)), max(1, round(picture.height * scale))
        shown = picture.resize(size, Image.Resampling.LANCZOS) if scale < 1 else picture
        found = min(
            ((encoded(shown, kind), kind) for kind in ("jpeg", "png")), key=lambda x: len(x[0])
        )
        if len(found[0]) <= limit:
            return found
        scale *= 0.9


def joined(value: str | list[str]) -> str:
    """Text of an output, which files keep whole or by line."""
    return value if isinstance(value, str) else "".join(value)


def is_bar(output: dict[str, Any]) -> bool:
    """Whether an output is a progress bar of tqdm, or the line of a run."""
    if output.get("name") == "stderr" and joined(output["text"]).startswith("\r"):
        return True
    data = output.get("data", {})
    return WIDGET in data and "% |" in joined(data.get("text/plain", ""))


def shrink(notebook: dict[str, Any], limit: int = PICTURE_BYTES) -> None:
    """Bring pictures and views of a notebook below their limits, in place."""
    notebook["metadata"].pop("widgets", None)
    for cell in notebook["cells"]:
        if "outputs" in cell:
            cell["outputs"] = [one for one in cell["outputs"] if not is_bar(one)]
        for output in cell.get("outputs", []):
            data = output.get("data", {})
            data.pop(WIDGET, None)
            for kind in ("png", "jpeg"):
                if f"image/{kind}" in data:
                    text, now = smaller(joined(data.pop(f"image/{kind}")).replace("\n", ""), limit)
                    data[f"image/{now}"] = text
            if len(page := joined(data.get("text/html", ""))) > VIEW_BYTES:
                data["text/html"] = LEFT_OUT.format(megabytes=len(page) / 1e6)


def shrink_file(path: Path) -> int:
    """Bring a notebook's file below its limits; return its bytes."""
    stored = path.read_text(encoding="utf-8")
    for limit in (PICTURE_BYTES, 50_000, 40_000, 30_000, 20_000):
        notebook = json.loads(stored)
        shrink(notebook, limit)
        text = json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"
        if len(text.encode()) <= NOTEBOOK_BYTES:
            break
    path.write_text(text, encoding="utf-8")
    return len(text.encode())


def main() -> None:
    """Execute and shrink."""
    parser = argparse.ArgumentParser(description="Write, execute and shrink notebooks.")
    parser.add_argument("sources", nargs="*", type=Path, metavar="FILE.py")
    parser.add_argument("--shrink", action="store_true", help="only shrink what is stored")
    options = parser.parse_args()
    for source in options.sources or sorted(FOLDER.glob("[0-9]*.py")):
        if not options.shrink:
            command = ["jupytext", "--to", "ipynb", "--execute", str(source)]
            subprocess.run([sys.executable, "-m", *command], check=True)
        path = source.with_suffix(".ipynb")
        size = shrink_file(path)
        print(f"{path.name}: {size / 1e3:.0f} kB", flush=True)
        if size > NOTEBOOK_BYTES:
            sys.exit(f"{path.name} takes more than {NOTEBOOK_BYTES / 1e3:.0f} kB: show less in it")


if __name__ == "__main__":
    main()
