"""``a2v motion-page``: write a motion model as one web page that generates motions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from a2v.errors import InputError
from a2v.motion import MotionModel
from pipelines.answer import Answer
from pipelines.inputs import check_writable
from pipelines.options import option
from pipelines.requests.motion import DEFAULT_SECONDS
from pipelines.requests.ways import MANY

HELP = (
    "Write a page that holds a motion model and generates motions in the browser, without a server."
)
EXAMPLES = """examples:
  a2v motion-page --out motions.html                                    the 123 actions of cmu-fine, played by sticks
  a2v motion-page --character me.glb --action Salsa --seed 4 --seconds 8 --out me.html
  a2v motion-page --model runs/mine/motion.onnx --out mine.html"""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    out: str = option("page to write: .html")
    character: str | None = option(
        "character (.glb) that performs the motions (default: sticks)",
        default=None,
        metavar="FILE",
    )
    model: str = option("name of the model, or an .onnx file", default=MANY)
    action: str = option("action that it begins with", default="")
    seconds: float = option("length of the first motion in seconds", default=DEFAULT_SECONDS)
    seed: int = option("seed of the first motion", default=0)


def run(options: Options) -> Answer:
    """Write the page."""
    from a2v.motion.page import write_motion_page
    from a2v.motion.prompts import Vocabulary, parse_prompt

    path = Path(options.out)
    if path.suffix.lower() != ".html":
        raise InputError(f"cannot write {path}; a page is an .html")
    model = MotionModel.load(options.model)
    action = options.action
    steps = parse_prompt(action, Vocabulary.of(model.card))[0] if action else []
    if len(steps) > 1:
        raise InputError("a page starts with one action; give one --action")
    check_writable(path.parent)
    write_motion_page(
        path,
        model,
        options.character,
        action=steps[0].action if steps else None,
        seed=options.seed,
        seconds=options.seconds,
        title=f"a2v: {len(model.actions)} actions",
    )
    return Answer(files=[path], facts={"model": model.path.name, "bytes": path.stat().st_size})
