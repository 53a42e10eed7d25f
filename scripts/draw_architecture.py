"""Draw docs/images/architecture.svg and rewrite the lists of docs/architecture.md from the code.

python scripts/draw_architecture.py runs after a change of packages or of the graph; commit what it
writes. Packages and their imports are read by `ast` (imports within functions and for types only
count too), layers from import-linter's contract in pyproject.toml, values from the types of the
graph's nodes.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
import textwrap
import typing
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

PAGE = ROOT / "docs" / "architecture.md"
PICTURE = ROOT / "docs" / "images" / "architecture.svg"
WIDTH, MARGIN = 960, 20
INK, FAINT, RULE = "#22303c", "#5b6b7a", "#b9c4ce"
LABORATORY = "a2v.lab"
"""The package whose parts are shown one by one."""
COLORS = ("#e4eef8", "#fdebd8", "#e6f2e2", "#efe6f5", "#f7e6e6", "#e3f1f1", "#f6f1d9")
"""Fill colors of the bands, and of the columns of nodes in one module."""


# ---- what the code says
# ------------------------------------------------------------------------------------------------------------------


def layers() -> list[list[str]]:
    """Return the packages from top to bottom, with siblings side by side.

    Packages that the contract does not name are at the bottom.
    """
    import tomllib

    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
        "importlinter"
    ]["contracts"]
    layered = [contract["layers"] for contract in contracts if contract["type"] == "layers"]
    inner = next(rows for rows in layered if rows[0].startswith(f"{LABORATORY}."))
    rows = [row for outer in layered[0] for row in (inner if outer == LABORATORY else [outer])]
    found = [[name.strip() for name in re.split(r"[|:]", row)] for row in rows]
    named = {name for row in found for name in row}
    found[-1] += sorted({room_of(path) for path in sources("a2v")} - named - {"a2v", LABORATORY})
    return found


def sources(package: str) -> list[Path]:
    """Return the Python files of a package."""
    return sorted((ROOT / package).rglob("*.py"))


def room_of(path: Path) -> str:
    """Return the room of a file:

    ``a2v.<package or module>``, ``a2v.lab.<...>``, ``pipelines`` or ``export``.
    """
    return room_named(
        [part for part in path.relative_to(ROOT).with_suffix("").parts if part != "__init__"]
    )


def room_named(parts: Sequence[str]) -> str:
    """The room of a module whose full name has these parts."""
    if parts[0] != "a2v":
        return parts[0]
    return ".".join(parts[: 3 if ".".join(parts[:2]) == LABORATORY else 2])


def imported_names(path: Path) -> Iterator[str]:
    """Return the full names that a file imports from the project, anywhere in the file."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from (f"{node.module}.{name.name}" for name in node.names)


def room_imports() -> dict[str, list[str]]:
    """Return the rooms that each room imports."""
    rooms = [name for row in layers() for name in row]
    shown = {
        name.rpartition(".")[2]: name.rpartition(".")[0]
        for name in imported_names(ROOT / "a2v" / "__init__.py")
    }  # by `from a2v import`
    found: dict[str, set[str]] = {room: set() for room in rooms}
    for path in [*sources("a2v"), *sources("pipelines"), *sources("export")]:
        for name in imported_names(path) if room_of(path) in found else ():
            parts = name.split(".")
            if parts[0] == "a2v" and len(parts) > 1:
                room = room_named(parts)
                found[room_of(path)].add(room if room in rooms else shown.get(parts[1], room))
            elif parts[0] in ("pipelines", "export"):
                found[room_of(path)].add(parts[0])
    return {room: sorted(others - {room} & set(rooms)) for room, others in found.items()}


def purpose(room: str) -> str:
    """Return the first sentence of a room's docstring, without marks."""
    path = ROOT / room.replace(".", "/")
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    return re.split(
        r"(?<=[.;]) (?=[A-Z])", " ".join(text.split("\n\n")[0].split()).replace("`", "")
    )[0].rstrip(".;")


@dataclass(frozen=True)
class Stage:
    """A node of the graph: its arguments and results with their axes, and its module."""

    name: str
    module: str
    takes: tuple[str, ...]
    gives: tuple[str, ...]
    axes: tuple[str, ...]


def stages() -> tuple[list[Stage], dict[str, str]]:
    """Return the nodes of the video's graph in the order of computation, and the type of every
    value.

    Settings are left out.
    """
    from pipelines.engine.graph import topological
    from pipelines.graph import video_graph

    made, types = [], {}
    for step in topological(video_graph()):
        function = inspect.unwrap(step.node.function)
        hints = typing.get_type_hints(function)
        given = (
            typing.get_args(hints["return"])
            if isinstance(step.output, tuple)
            else (hints["return"],)
        )
        takes = tuple(inspect.signature(function).parameters)
        for name, hint in [
            *zip(step.outputs, given, strict=True),
            *((name, hints[name]) for name in takes),
        ]:
            if kind := value_type(hint):
                types.setdefault(name, kind)
        made.append(
            Stage(
                step.node.name,
                function.__module__.rsplit(".", 1)[1],
                takes,
                step.outputs,
                step.axes,
            )
        )
    return made, types


def value_type(hint: Any) -> str:
    """``Body`` of ``Ref[Body]``, of a list or an optional one; "" of settings and plain numbers."""
    from pipelines.engine.refs import File, Ref

    if hint is File:
        return "File"
    if typing.get_origin(hint) is Ref:
        return str(typing.get_args(hint)[0].__name__)
    return next((kind for argument in typing.get_args(hint) if (kind := value_type(argument))), "")


def lists() -> str:
    """Return the content of the picture as text: rooms with imports, nodes with types."""
    imports, (nodes, types) = room_imports(), stages()

    def typed(names: Iterable[str], axes: tuple[str, ...] = ()) -> str:
        return ", ".join(
            f"{name}{'[' + ', '.join(axes) + ']' if axes else ''}: {types[name]}"
            if name in types
            else name
            for name in names
        )

    rooms = [
        f"{room} -> {', '.join(others) or 'nothing of the project'}"
        for room, others in imports.items()
    ]
    values = [
        f"{stage.name}({typed(stage.takes)}) -> {typed(stage.gives, stage.axes)}" for stage in nodes
    ]
    return "```\n" + "\n".join(rooms) + "\n```\n\n```\n" + "\n".join(values) + "\n```"


# ---- the picture -------------------------------------------------------------------------------------------------------------------------


class Sheet:
    """An SVG that grows downwards."""

    def __init__(self) -> None:
        self.parts: list[str] = []
        self.y = float(MARGIN)

    def text(
        self,
        x: float,
        y: float,
        words: str,
        *,
        size: float = 12,
        color: str = INK,
        bold: bool = False,
        turn: float = 0,
    ) -> None:
        """Add words that begin at (x, y), turned by degrees."""
        extra = f' transform="rotate({turn:g} {x:g} {y:g})"' if turn else ""
        weight = ' font-weight="bold"' if bold else ""
        self.parts.append(
            f'<text x="{x:g}" y="{y:g}" font-size="{size:g}" '
            f'fill="{color}"{weight}{extra}>{escape(words)}</text>'
        )

    def box(self, x: float, y: float, width: float, height: float, fill: str) -> None:
        """Add a box with round corners."""
        self.parts.append(
            f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="4" fill="{fill}" '
            f'stroke="{RULE}"/>'
        )

    def line(
        self,
        x: float,
        y: float,
        to_x: float,
        to_y: float,
        *,
        color: str = RULE,
        width: float = 1,
        arrow: bool = False,
    ) -> None:
        """Add a straight line, with a tip at its end if requested."""
        end = ' marker-end="url(#tip)"' if arrow else ""
        self.parts.append(
            f'<line x1="{x:g}" y1="{y:g}" x2="{to_x:g}" y2="{to_y:g}" stroke="{color}" '
            f'stroke-width="{width:g}"{end}/>'
        )

    def dot(self, x: float, y: float, fill: str) -> None:
        """Add a small circle."""
        self.parts.append(
            f'<circle cx="{x:g}" cy="{y:g}" r="4.5" fill="{fill}" stroke="{INK}" '
            'stroke-width="1.3"/>'
        )

    def svg(self) -> str:
        """Return the whole SVG."""
        tip = f'<path d="M0,0 L9,4 L0,8 z" fill="{FAINT}"/>'
        marker = f'<marker id="tip" markerWidth="9" markerHeight="8" refX="8" refY="4" orient="auto">{tip}</marker>'
        size = f'viewBox="0 0 {WIDTH} {self.y + MARGIN:g}"'
        head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="DejaVu Sans, Verdana, sans-serif">'
        return (
            "\n".join(
                [
                    head,
                    f"<defs>{marker}</defs>",
                    '<rect width="100%" height="100%" fill="white"/>',
                    *self.parts,
                    "</svg>",
                ]
            )
            + "\n"
        )


def wrapped(words: str, width: float, size: float) -> list[str]:
    """Return lines of `words` that fit into `width` pixels."""
    return textwrap.wrap(words, max(8, int(width / (0.6 * size))), break_long_words=False)


def draw_rooms(sheet: Sheet) -> None:
    """Draw a band per layer and a box per room: its name, its purpose, its imports."""
    imports = room_imports()
    rows = layers()
    sheet.text(
        MARGIN,
        sheet.y + 16,
        "Rooms: a room may import those of lower bands, never its neighbors",
        size=15,
        bold=True,
    )
    sheet.y += 32
    top, left = sheet.y, MARGIN + 26
    for index, row in enumerate(rows):
        width = (WIDTH - MARGIN - left - 8 * (len(row) - 1)) / len(row)
        texts = []
        for room in row:
            others = ", ".join(name.removeprefix("a2v.") for name in imports[room])
            texts.append(
                (
                    wrapped(purpose(room), width - 16, 10.5),
                    wrapped(f"imports {others}" if others else "", width - 16, 10),
                )
            )
        height = max(24 + 14 * len(words) + 13 * len(uses) for words, uses in texts) + 6
        for column, (room, (words, uses)) in enumerate(zip(row, texts, strict=True)):
            x, y = left + column * (width + 8), sheet.y
            sheet.box(x, y, width, height, COLORS[index % len(COLORS)])
            sheet.text(x + 8, y + 18, room, size=13, bold=True)
            for number, line in enumerate(words):
                sheet.text(x + 8, y + 34 + 14 * number, line, size=10.5)
            for number, line in enumerate(uses):
                sheet.text(
                    x + 8, y + 34 + 14 * len(words) + 13 * number, line, size=10, color=FAINT
                )
        sheet.y += height + 8
    sheet.line(MARGIN + 8, top, MARGIN + 8, sheet.y - 8, color=FAINT, width=3, arrow=True)


def draw_values(sheet: Sheet) -> None:
    """Draw a column per node and a lane per value: a filled dot for the node that makes it, an open
    dot for a node that uses it."""
    nodes, types = stages()
    made = [name for stage in nodes for name in stage.gives]
    given = list(
        dict.fromkeys(
            name for stage in nodes for name in stage.takes if name in types and name not in made
        )
    )
    lanes = [*given, *made]
    left, head, step = MARGIN + 256, 104, 22
    pitch = (WIDTH - MARGIN - left - 24) / len(nodes)
    sheet.y += 28
    sheet.text(
        MARGIN,
        sheet.y,
        "Values: which node makes one (filled), which nodes take it (open)",
        size=15,
        bold=True,
    )
    top = sheet.y + head
    bottom = top + step * len(lanes)
    modules = list(dict.fromkeys(stage.module for stage in nodes))
    place = {stage.name: left + pitch * (index + 0.5) for index, stage in enumerate(nodes)}
    for stage in nodes:
        x = place[stage.name]
        sheet.box(
            x - pitch / 2 + 2,
            top - 8,
            pitch - 4,
            bottom - top + 8,
            COLORS[modules.index(stage.module) % len(COLORS)],
        )
        sheet.text(
            x + 4,
            top - 14,
            stage.name + (f" [{', '.join(stage.axes)}]" if stage.axes else ""),
            size=12,
            bold=True,
            turn=-50,
        )
    for index, name in enumerate(lanes):
        y = top + step * (index + 0.5)
        makers = [place[stage.name] for stage in nodes if name in stage.gives]
        takers = [place[stage.name] for stage in nodes if name in stage.takes]
        start = makers[0] if makers else left - 6
        sheet.text(MARGIN, y + 4, name, size=12, bold=bool(makers), color=INK if makers else FAINT)
        sheet.text(MARGIN + 112, y + 4, types.get(name, ""), size=11, color=FAINT)
        if takers:
            sheet.line(start, y, max(takers), y, color=INK, width=1.6)
        for x in takers:
            sheet.dot(x, y, "white")
        if makers:
            sheet.dot(start, y, INK)
    sheet.y = bottom + 24
    x = float(MARGIN)
    for index, module in enumerate(modules):
        if x > WIDTH - 160:
            x, sheet.y = float(MARGIN), sheet.y + 20
        sheet.box(x, sheet.y - 11, 14, 14, COLORS[index % len(COLORS)])
        sheet.text(x + 20, sheet.y, f"nodes/{module}.py", size=11, color=FAINT)
        x += 40 + 6.6 * len(f"nodes/{module}.py")


def picture() -> str:
    """Return the whole picture as SVG."""
    sheet = Sheet()
    draw_rooms(sheet)
    draw_values(sheet)
    return sheet.svg()


def page(text: str) -> str:
    """Return `text` of the page with today's lists between its two marks."""
    before, _, rest = text.partition("<!-- lists -->\n")
    _, _, after = rest.partition("<!-- end of lists -->")
    return f"{before}<!-- lists -->\n{lists()}\n<!-- end of lists -->{after}"


if __name__ == "__main__":
    PICTURE.write_text(picture(), encoding="utf-8")
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(PICTURE)
