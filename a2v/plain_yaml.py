"""One loader for all YAML from outside, with bounds on time and memory.

Few nodes may be repeated by aliases, and merge keys (``<<``) and long numbers are refused: with
each of them a text of some hundred bytes could cost gigabytes or minutes. Numbers follow YAML 1.2
(``1e3`` is a number), and dates are text.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import yaml

from a2v.io import reading

MAX_REPEATED = 10_000
"""Largest number of nodes that aliases may add to the written ones."""

MAX_NODES = 300_000
"""Largest number of values and keys of one text: about 300 MB during reading."""

MAX_LEVELS = 64
"""Largest depth of nested lists and mappings. libyaml composes them by recursion in C, where
thousands of levels end the process."""

MAX_NUMBER = 40
"""Largest length of a number, characters."""

MAX_KEY = 18
"""Largest length of a number that is a key, characters. Longer ones can be chosen to have equal
hashes, which makes a dictionary quadratic."""

_TAG = "tag:yaml.org,2002:"
_FLOAT = re.compile(
    r"[-+]?(?:[0-9][0-9_]*\.[0-9_]*|\.[0-9][0-9_]*|[0-9][0-9_]*(?=[eE]))(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"
)

if TYPE_CHECKING:
    _Base = yaml.SafeLoader
else:
    _Base = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class PlainLoader(_Base):
    """PyYAML's safe loader with the bounds of this module. Exceeding one raises
    `yaml.YAMLError`."""

    yaml_implicit_resolvers = {  # noqa: RUF012 - PyYAML's own attribute
        letter: [
            (tag, pattern)
            for tag, pattern in entries
            if tag.removeprefix(_TAG) not in ("float", "timestamp")
        ]
        for letter, entries in _Base.yaml_implicit_resolvers.items()
    }

    def __init__(self, stream: Any) -> None:
        text = stream if isinstance(stream, str) else stream.read()
        _check_events(text)
        super().__init__(text)

    def get_single_data(self) -> Any:
        """Return the value of the only document."""
        node = self.get_single_node()
        if node is None:
            return None
        _check(node)
        return self.construct_document(node)


PlainLoader.add_implicit_resolver(
    f"{_TAG}float", re.compile(rf"(?:{_FLOAT.pattern})\Z"), list("-+0123456789.")
)


def load_yaml(text: str) -> Any:
    """Load a YAML text.

    Raises
    ------
    yaml.YAMLError
        It is not YAML, or exceeds a bound of this module.
    ValueError
        A value does not match its tag.
    """
    return yaml.load(text, PlainLoader)


def parse_yaml(data: bytes, source: object, what: str, expected: str) -> Any:
    """Parse YAML in UTF-8, with or without a byte-order mark.

    Parameters
    ----------
    source : what messages call the file
    what : what it should be ("timeline")
    expected : a longer description of it

    Raises
    ------
    InputError
        It is not YAML, or exceeds a bound of this module.
    """
    with reading(source, what, expected):
        return load_yaml(data.decode("utf-8-sig"))


def _check_events(text: str) -> None:
    """Check the bounds on levels and nodes before anything is composed."""
    level = nodes = 0
    for event in yaml.parse(text, _Base):
        nodes += isinstance(event, yaml.NodeEvent)
        if isinstance(event, yaml.CollectionStartEvent):
            level += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            level -= 1
        if level > MAX_LEVELS:
            raise _refused(f"is nested deeper than {MAX_LEVELS} levels", event)
        if nodes > MAX_NODES:
            raise _refused(f"goes beyond {MAX_NODES} values", event)


def _check(root: yaml.Node) -> None:
    """Check that the tree below `root` is hardly larger with aliases expanded than as written."""
    sizes: dict[int, int] = {}
    entered: set[int] = set()
    stack = [root]
    while stack:
        node = stack[-1]
        if id(node) in sizes:
            stack.pop()
        elif isinstance(node, yaml.ScalarNode):
            _check_scalar(node, MAX_NUMBER)
            sizes[id(node)] = 1
        elif id(node) in entered:
            inner = [id(one) for one in _inner(node)]
            if any(one not in sizes for one in inner):
                raise _refused("contains itself", node)
            sizes[id(node)] = 1 + sum(sizes[one] for one in inner)
            if sizes[id(node)] > len(sizes) + MAX_REPEATED:
                raise _refused(f"repeats more than {MAX_REPEATED} values by its aliases", node)
        else:
            entered.add(id(node))
            stack += [one for one in _inner(node) if id(one) not in sizes]


def _inner(node: yaml.Node) -> list[yaml.Node]:
    """Return the nodes inside a sequence or mapping; the keys of a mapping are checked."""
    if not isinstance(node, yaml.MappingNode):
        return list(node.value)
    for key, _ in node.value:
        if key.tag == f"{_TAG}merge":
            raise _refused("has a merge key (<<); write its entries out", key)
        if isinstance(key, yaml.ScalarNode):
            _check_scalar(key, MAX_KEY)
    return [one for pair in node.value for one in pair]


def _check_scalar(node: yaml.ScalarNode, most: int) -> None:
    if node.tag in (f"{_TAG}int", f"{_TAG}float") and len(node.value) > most:
        raise _refused(f"has a number of more than {most} characters", node)


def _refused(what: str, place: yaml.Node | yaml.Event) -> yaml.YAMLError:
    return yaml.YAMLError(f"line {place.start_mark.line + 1 if place.start_mark else 1} {what}")
