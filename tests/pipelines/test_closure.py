"""A node's key depends on the code that the node reaches, and on nothing else."""

from __future__ import annotations

import ast
import functools
import os
import shutil
import textwrap
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipelines.engine import closure
from pipelines.engine.closure import Sources
from pipelines.engine.graph import Step
from pipelines.engine.imports import PROJECT, imports_in, imports_of, parse
from pipelines.graph import video_graph

ROOT = Path(__file__).resolve().parents[2]
_NO_NODES = (
    "pipelines/serve/page/",
    "a2v/motion/browser/",
    "a2v/rendering/looks/",
    "export/blender/",
)
"""Pages, an add-on, and looks, which are arguments of nodes: no node's result depends on these
files."""
RUNS = " (what it runs)"
SHARES = 6
"""Each file is edited for the first node whose closure has it, and for every sixth one."""
STEPS = {
    step.node.name: step for recorded in (False, True) for step in video_graph(recorded=recorded)
}


@pytest.fixture(scope="module", autouse=True)
def _each_text_is_parsed_once() -> Iterator[None]:
    """Files are edited two thousand times, one at a time; what the others say stays the same."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("_statements", "imports_in"):
            patch.setattr(closure, name, functools.cache(getattr(closure, name)))
        yield


def project_files(root: Path) -> list[Path]:
    """Everything that the packages hold but weights."""
    found = [path for package in PROJECT for path in (root / package).rglob("*") if path.is_file()]
    return sorted(
        path for path in found if "__pycache__" not in path.parts and "weights" not in path.parts
    )


@pytest.fixture(scope="module")
def tree(tmp_path_factory) -> Path:
    """A copy of the project's packages without weights."""
    root = tmp_path_factory.mktemp("tree")
    for path in project_files(ROOT):
        target = root / path.relative_to(ROOT)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target)
    return root


def own_file(step: Step, root: Path) -> Path:
    return root.joinpath(*step.node.function.__module__.split(".")).with_suffix(".py")


@pytest.fixture(scope="module")
def edits(tree: Path) -> dict[str, list[str]]:
    """By node: the labels of the files that are edited for it."""
    found: dict[str, list[str]] = {name: [] for name in STEPS}
    times = Counter[str]()
    for name, step in sorted(STEPS.items()):
        for label in Sources(tree).closure(own_file(step, tree), name):
            if times[label] % SHARES == 0:
                found[name].append(label)
            times[label] += 1
    return found


def digest(root: Path, step: Step) -> str:
    return Sources(root).digest(own_file(step, root), step.node.name)


@pytest.fixture(scope="module")
def before(tree: Path) -> dict[str, str]:
    """The digest of each node in the unchanged tree."""
    return {name: digest(tree, step) for name, step in STEPS.items()}


class Edited:
    """Change files inside the block: those given have one more line or byte."""

    def __init__(self, *paths: Path, line: bytes = b"EDITED = 1") -> None:
        self.line = line
        self.before = {path: path.read_bytes() for path in paths}

    def __enter__(self) -> None:
        for path, data in self.before.items():
            path.write_bytes(data + (b"\n" + self.line + b"\n" if path.suffix == ".py" else b"\0"))

    def __exit__(self, *_: object) -> None:
        for path, data in self.before.items():
            path.write_bytes(data)


@pytest.mark.parametrize("name", sorted(STEPS))
def test_an_edit_anywhere_in_the_closure_changes_the_key_and_one_outside_does_not(
    tree, edits, name
):
    step = STEPS[name]
    own, before = own_file(step, tree), digest(tree, step)
    assert before == step.node.code(), "of this installation"
    labels = Sources(tree).closure(own, name)
    reached = [tree / label for label in labels if not label.endswith(RUNS)]
    assert tree / "a2v" / "types.py" in reached
    for label in edits[name]:
        path = tree / label.removesuffix(RUNS)
        if path != own or label.endswith(RUNS):
            with Edited(path, line=b"print()" if label.endswith(RUNS) else b"EDITED = 1"):
                assert digest(tree, step) != before, label
    with Edited(
        *(path for path in project_files(tree) if path not in reached or path == own)
    ):  # a new name in its own module is outside
        assert digest(tree, step) == before
    text = own.read_text()
    line = (
        next(
            node
            for node in ast.parse(text).body
            if isinstance(node, ast.FunctionDef) and node.name == name
        )
        .body[0]
        .lineno
    )
    lines = text.splitlines(keepends=True)
    own.write_text(
        "".join([*lines[: line - 1], "    # in the function itself\n", *lines[line - 1 :]])
    )
    try:
        assert digest(tree, step) != before
    finally:
        own.write_text(text)


@pytest.mark.parametrize(
    ("file", "changed", "kept"),
    [
        ("a2v/rendering/scene.py", {"frame"}, {"surface", "colored_surface", "camera", "clip"}),
        ("a2v/lab/studio/lighting.py", set(), set(STEPS)),
        (
            "a2v/reconstruction/coloring/steps.py",
            {"color_draft", "surface_with_face", "shaded_surface"},
            {"surface", "photo_body", "body", "face_draft", "colored_surface"},
        ),
        (
            "a2v/geometry/rays.py",
            {"surface", "colored_surface", "photo_body", "body"},
            {"motion", "frame", "vertices"},
        ),
        (
            "a2v/kinematics/transforms.py",
            {"subject", "motion", "poses", "glb"},
            {"frame", "vertices"},
        ),
        ("a2v/sessions.py", {"motion", "surface", "subject"}, {"frame", "photo_body"}),
        (
            "a2v/perception/data/depth_correction.npz",
            {"subject", "recorded_motion"},
            set(STEPS) - {"subject", "recorded_motion"},
        ),
        (
            "a2v/perception/data/bodymap.onnx",
            {"subject", "recorded_motion"},
            set(STEPS) - {"subject", "recorded_motion"},
        ),
        ("a2v/body/data/pose_prior_anny.npz", {"photo_body", "body"}, {"surface", "poses"}),
        ("a2v/lab/motion/training.py", set(), set(STEPS)),
        ("a2v/version.py", {"glb"}, {"surface", "motion"}),  # the writer names it
        ("a2v/animation/__init__.py", set(), set(STEPS)),  # it only passes names on
        ("pipelines/cli.py", set(), set(STEPS)),
    ],
)
def test_what_an_edit_of_a_file_makes_new(tree, before, file, changed, kept):
    with Edited(tree / file):
        after = {name: digest(tree, step) for name, step in STEPS.items()}
    assert changed <= {name for name in STEPS if after[name] != before[name]}
    assert kept <= {name for name in STEPS if after[name] == before[name]}


def test_the_quick_reading_of_imports_agrees_with_a_full_one():
    for path in project_files(ROOT):
        if path.suffix == ".py":
            text, package = path.read_text(), ".".join(path.relative_to(ROOT).parent.parts)
            full = {
                one
                for one in imports_of(ast.walk(parse(text)), package)
                if one.module.partition(".")[0] in PROJECT
            }
            assert set(imports_in(text, package)) == full, path


def test_every_data_file_is_known_to_some_module():
    sources = Sources(ROOT)
    known: set[str] = set()
    for path in project_files(ROOT):
        if path.suffix == ".py":
            known |= set(sources._data_named(path.read_text(), path.relative_to(ROOT).as_posix()))
    data = {
        path.relative_to(ROOT).as_posix() for path in project_files(ROOT) if path.suffix != ".py"
    }
    data = {name for name in data if not name.startswith(_NO_NODES)}
    unnamed = {
        "a2v/motion/words.license.txt",
        "a2v/py.typed",
        "a2v/samples/README.md",
    }
    assert data - known == unnamed | {
        "export/factors_cmu_fine.csv"
    }  # given to export.retune on its command line


# --- the rules, on a small project


SMALL = {
    "a2v/__init__.py": "",
    "a2v/room/__init__.py": """
        from typing import TYPE_CHECKING
        from a2v.room.chair import sit
        from a2v.room.table import lay
        if TYPE_CHECKING:
            from a2v.room.types_only import Nothing
    """,
    "a2v/room/chair.py": "from .leg import LEGS\ndef sit(): return LEGS",
    "a2v/room/leg.py": "LEGS = 4",
    "a2v/room/table.py": 'def lay():\n    from a2v.room.cloth import CLOTH\n    return CLOTH, "data/plates.bin"',
    "a2v/room/cloth.py": "from __future__ import annotations\nCLOTH = 1",
    "a2v/room/lamp.py": "import a2v.room.bulb\nLIGHT = 1",
    "a2v/room/bulb.py": '"""Prose in which a line begins so:\nfrom a2v one sees the bulb.\n"""\nfrom a2v.room.leg import (\n    LEGS,\n)',
    "a2v/room/types_only.py": "class Nothing: pass",
    "a2v/room/data/plates.bin": "plates",
    "a2v/room/data/forks.bin": "forks",
    "pipelines/__init__.py": "",
    "pipelines/nodes.py": """
        from __future__ import annotations
        from typing import TYPE_CHECKING
        import json
        from a2v.room import lay, sit
        from a2v.room.lamp import LIGHT as light
        if TYPE_CHECKING:
            from a2v.room.types_only import Nothing

        CHAIRS = 3
        EACH = CHAIRS * 2
        OTHER = light

        class Shape:
            side = EACH

        def helper(light):
            return sit() + light

        def seat(lay, n: Shape):
            return helper(lay)

        def dine() -> Nothing:
            return lay()

        def look():
            from a2v import room
            return room.sit() + room.leg.LEGS

        def whole():
            from a2v import room
            return vars(room)

        def dump():
            return json.dumps(1)
    """,
}


@pytest.fixture
def small(tmp_path) -> Path:
    for name, text in SMALL.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(textwrap.dedent(text))
    return tmp_path


ROOM = "a2v/room/"
CHAIR = {"chair.py", "leg.py"}
TABLE = {"table.py", "cloth.py", "data/plates.bin"}


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("seat", CHAIR),  # an argument of the same name hides `lay`
        ("dine", TABLE),
        ("look", CHAIR),  # of a package, what is used of it
        ("whole", {"__init__.py"} | CHAIR | TABLE),  # a package used in another way: all of it
        (
            "OTHER",
            {"lamp.py", "bulb.py", "../__init__.py", "__init__.py"} | CHAIR | TABLE,
        ),  # `import a2v.room.bulb` gives all of a2v
        ("dump", set()),
    ],
)
def test_what_is_followed(small, name, expected):
    closure = set(Sources(small).closure(small / "pipelines/nodes.py", name))
    assert closure - {"pipelines/nodes.py"} == {os.path.normpath(ROOM + file) for file in expected}


@pytest.mark.parametrize(
    ("name", "old", "new", "changes"),
    [
        (
            "seat",
            "CHAIRS = 3",
            "CHAIRS = 4",
            True,
        ),  # through a class, which only an annotation names
        ("dine", "CHAIRS = 3", "CHAIRS = 4", False),
        ("seat", "return sit()", "return 2 * sit()", True),
        ("dine", "return sit()", "return 2 * sit()", False),
        ("dump", "import json", "import ujson as json", True),
        (
            "dump",
            "CHAIRS = 3",
            "CHAIRS = 3\nlight.switch(on=True)",
            True,
        ),  # what runs at import counts for all
        ("dump", "CHAIRS = 3", 'CHAIRS = 3\n"""Of one table."""', False),
        ("seat", "import lay, sit", "import lay, lay as sit", True),
    ],
)
def test_what_of_its_own_module_a_node_depends_on(small, name, old, new, changes):
    file = small / "pipelines/nodes.py"
    before = Sources(small).digest(file, name)
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))
    assert (Sources(small).digest(file, name) != before) == changes


def test_what_a_package_runs_when_it_is_imported_counts_for_all_in_it(small):
    file, init = small / "pipelines/nodes.py", small / "a2v/room/__init__.py"
    before = {name: Sources(small).digest(file, name) for name in ("seat", "dump")}
    init.write_text(init.read_text() + "\nimport os\nUNUSED = 1\n")
    assert {name: Sources(small).digest(file, name) for name in before} == before
    init.write_text(init.read_text() + "os.environ['THREADS'] = '1'\n")
    after = {name: Sources(small).digest(file, name) for name in before}
    assert after["seat"] != before["seat"]
    assert after["dump"] == before["dump"]


def test_an_unknown_name_is_an_error(small):
    with pytest.raises(KeyError, match="nothing"):
        Sources(small).digest(small / "pipelines/nodes.py", "nothing")
