"""Find the code and the data files that the result of a node depends on.

The source is read; nothing is imported. Of the node's own module only its function counts, with the
module-level names that it uses, directly or indirectly. Modules that these import count as a whole,
and so do the modules that those import, also inside of functions. Three things do not count:
imports for type checkers only; the ``__init__`` of a package that passes a name on (the module that
defines the name counts); and files in ``a2v/weights`` (models are arguments of nodes and count by
their content). A data file counts for the modules beside or above it that name it in quotes.
"""

from __future__ import annotations

import ast
import functools
import os
import re
import symtable
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from a2v.digest import Digest
from pipelines.engine.imports import PROJECT, Import, imports_in, imports_of, parse

_ARGUMENTS = "a2v/weights"
_RUNS = " (what it runs)"
_SCOPES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)


@functools.cache
def code_digest(file: str, name: str) -> Digest:
    """Return forty hex digits of everything that the top-level name `name` of `file` depends on.

    They are computed once per process, so that they describe the code that runs.
    """
    return _installed().digest(file, name)


def top_folder() -> Path:
    """Return the folder of the project's packages: a checkout, or the site-packages of a wheel.

    In a wheel this package lies below `a2v`.
    """
    return Path(__file__).resolve().parents[__name__.count(".")]


@functools.cache
def _installed() -> Sources:
    return Sources(top_folder())


class Sources:
    """The source files of the project below one folder, each read once.

    Parameters
    ----------
    root : folder that holds the packages of `PROJECT`
    """

    def __init__(self, root: str | os.PathLike[str]) -> None:
        self._root = Path(root)
        self._own: dict[str, list[_Statement]] = {}
        self._modules: dict[str, _Module] = {}
        self._data = sorted(self._find_data())

    def digest(self, file: str | os.PathLike[str], name: str) -> Digest:
        """Return the digest of `closure`."""
        return Digest.of(
            "\n".join(
                f"{label} {digest}" for label, digest in sorted(self.closure(file, name).items())
            ).encode()
        )

    def closure(self, file: str | os.PathLike[str], name: str) -> dict[str, str]:
        """Return the digests of what the top-level name `name` of `file` depends on, by path.

        Raises
        ------
        KeyError
            The file defines no such name.
        """
        label = Path(os.path.relpath(file, self._root)).as_posix()
        if label not in self._own:
            self._own[label] = _statements(
                Path(file).read_text(encoding="utf-8"), ".".join(Path(label).parent.parts)
            )
        text, uses = _reachable(self._own[label], name)
        parts = {label: Digest.of(text), **self._data_named(text, label)}
        left, seen = (
            [module for one, attributes in uses for module in self._definers(one, attributes)],
            set[str](),
        )
        while left:
            if (module := left.pop()) not in seen:
                seen.add(module)
                parts |= self._module(module).parts
                left += [
                    definer
                    for one in self._module(module).imports
                    for definer in self._definers(one)
                ]
        return parts

    def _definers(self, one: Import, attributes: Iterable[str] | None = None) -> Iterator[str]:
        """Return the modules of an imported name.

        For a package these are the modules of its used `attributes`, if these are known.
        """
        found = self._definer(one.module, one.name)
        if found is None:
            return
        if (
            attributes is not None
            and found == f"{one.module}.{one.name}"
            and self._module(found).is_package
        ):
            for attribute in attributes:
                yield from self._definers(Import(found, attribute, attribute))
        else:
            yield found

    def _definer(self, module: str, name: str) -> str | None:
        """Return the module that defines `name` of `module`, or None outside of the project."""
        if module.partition(".")[0] not in PROJECT or self._path(module) is None:
            return None
        if not name or not self._module(module).is_package:
            return module
        passed_on = self._module(module).passed_on.get(name)
        if passed_on is not None and (passed_on.module, passed_on.name) != (module, name):
            return self._definer(passed_on.module, passed_on.name)
        return module if self._path(f"{module}.{name}") is None else f"{module}.{name}"

    def _path(self, module: str) -> Path | None:
        """Return the file of a module, or None if there is none."""
        if module in self._modules:
            return self._modules[module].path
        base = self._root.joinpath(*module.split("."))
        return next(
            (path for path in (base.with_suffix(".py"), base / "__init__.py") if path.is_file()),
            None,
        )

    def _module(self, name: str) -> _Module:
        if name not in self._modules:
            path, above = self._path(name), name.rpartition(".")[0]
            assert path is not None
            text, label = path.read_text(encoding="utf-8"), path.relative_to(self._root).as_posix()
            is_package = path.name == "__init__.py"
            statements = _statements(text, name) if is_package else []
            parts = (
                {}
                if not above
                else {
                    key: digest
                    for key, digest in self._module(above).parts.items()
                    if key.endswith(_RUNS)
                }
            )
            if runs := [statement.text for statement in statements if statement.runs]:
                parts[f"{label}{_RUNS}"] = Digest.of("\n".join(runs))
            parts |= {label: Digest.of(text), **self._data_named(text, label)}
            imports = imports_in(text, name if is_package else above)
            passed_on = {one.alias: one for statement in statements for one in statement.imports}
            self._modules[name] = _Module(path, is_package, parts, imports, passed_on)
        return self._modules[name]

    def _find_data(self) -> Iterator[tuple[str, str]]:
        """Return the relative path and the name of every data file."""
        for package in PROJECT:
            for folder, below, names in os.walk(self._root / package):
                below[:] = [name for name in below if not name.startswith((".", "__"))]
                where = Path(folder).relative_to(self._root).as_posix()
                if where != _ARGUMENTS:
                    yield from (
                        (f"{where}/{name}", name)
                        for name in names
                        if not name.endswith((".py", ".pyc"))
                    )

    def _data_named(self, text: str, label: str) -> dict[str, str]:
        """Return the digests of the data files that a source names, by relative path."""
        beside = f"{Path(label).parent.as_posix()}/"
        near = [
            (path, name) for path, name in self._data if path.startswith(beside) and name in text
        ]
        named = [path for path, name in near if re.search(rf"""["'/]{re.escape(name)}["']""", text)]
        return {path: Digest.of((self._root / path).read_bytes()) for path in named}


@dataclass(frozen=True)
class _Module:
    """A source file: its digest, its imports and, for a package, the names that it passes on."""

    path: Path
    is_package: bool
    parts: dict[str, str]
    imports: list[Import]
    passed_on: dict[str, Import]


# --- within the node's own module


@dataclass(frozen=True)
class _Statement:
    """A top-level statement: the names that it binds, the names that it may use, and its imports.

    `attributes` has the attributes that are used of each name; None if a name is also used
    otherwise.
    """

    node: ast.stmt
    text: str
    bound: set[str]
    used: set[str]
    imports: list[Import]
    attributes: dict[str, set[str] | None]

    @property
    def runs(self) -> bool:
        """Whether it does more than bind names, such as calling a function."""
        return not self.bound and not (
            isinstance(self.node, ast.Expr) and isinstance(self.node.value, ast.Constant)
        )


def _statements(text: str, package: str) -> list[_Statement]:
    """Return the top-level statements of a module's source."""
    lines, scopes = text.splitlines(), dict[str, list[symtable.SymbolTable]]()
    for scope in symtable.symtable(text, package, "exec").get_children():
        scopes.setdefault(scope.get_name(), []).append(scope)
    found = []
    for node in parse(text).body:
        parts = list(ast.walk(node))
        first = min([node.lineno, *(one.lineno for one in getattr(node, "decorator_list", []))])
        imports = list(imports_of(parts, package))
        if isinstance(node, _SCOPES):
            bound, used = {node.name}, _used(parts, scopes[node.name])
        else:
            bound, used = (
                _bound(parts) | {one.alias for one in imports},
                {one.id for one in parts if isinstance(one, ast.Name)},
            )
        found.append(
            _Statement(
                node,
                "\n".join(lines[first - 1 : node.end_lineno]),
                bound,
                used,
                imports,
                _attributes(parts),
            )
        )
    return found


def _reachable(
    statements: Iterable[_Statement], name: str
) -> tuple[str, list[tuple[Import, set[str] | None]]]:
    """Return the source of a top-level name and of everything in its module that it uses.

    Also return the imports that these use, with their used attributes (None if an import is also
    used otherwise).
    """
    binding: dict[str, list[_Statement]] = {}
    for statement in statements:
        for bound in statement.bound:
            binding.setdefault(bound, []).append(statement)
    left = [*binding[name], *(statement for statement in statements if statement.runs)]
    reached: list[_Statement] = []
    uses: list[tuple[Import, set[str] | None]] = []
    while left:
        statement = left.pop()
        if statement in reached or isinstance(statement.node, ast.Import | ast.ImportFrom):
            continue
        reached.append(statement)
        uses += [(one, statement.attributes.get(one.alias)) for one in statement.imports]
        for other in sorted(statement.used & set(binding)):
            left += binding[other]
            uses += [
                (one, statement.attributes.get(other))
                for source in binding[other]
                for one in source.imports
                if one.alias == other
            ]
    own = [
        statement.text for statement in sorted(reached, key=lambda statement: statement.node.lineno)
    ]
    named = sorted({f"{one.alias} is {one.module} {one.name}" for one, _ in uses})
    return "\n".join([*own, *named]), uses


def _bound(parts: Iterable[ast.AST]) -> set[str]:
    """Return the names that a statement assigns or defines."""
    names = {
        part.id for part in parts if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)
    }
    return names | {part.name for part in parts if isinstance(part, _SCOPES)}


def _used(parts: Iterable[ast.AST], scopes: Iterable[symtable.SymbolTable]) -> set[str]:
    """Return the names of the module that a function or class may use, in annotations too."""
    names = {name for scope in scopes for name in _globals(scope)}
    outside: list[ast.expr | None] = []  # Evaluated outside of these scopes, or not at all.
    for part in parts:
        if isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef):
            outside += [
                *part.decorator_list,
                *part.args.defaults,
                *part.args.kw_defaults,
                part.returns,
            ]
        elif isinstance(part, ast.arg | ast.AnnAssign):
            outside.append(part.annotation)
        elif isinstance(part, ast.ClassDef):
            outside += [
                *part.decorator_list,
                *part.bases,
                *(keyword.value for keyword in part.keywords),
            ]
    return names | {
        one.id
        for part in outside
        if part is not None
        for one in ast.walk(part)
        if isinstance(one, ast.Name)
    }


def _globals(scope: symtable.SymbolTable) -> set[str]:
    """Return the names that a scope and its inner scopes take from the module."""
    names = {
        one.get_name()
        for one in scope.get_symbols()
        if one.is_global() or (scope.get_type() == "class" and one.is_referenced())
    }
    return names.union(*map(_globals, scope.get_children()))


def _attributes(parts: Iterable[ast.AST]) -> dict[str, set[str] | None]:
    """Return the used attributes by name; None if the name is also used otherwise."""
    counts = Counter(part.id for part in parts if isinstance(part, ast.Name))
    attributes: dict[str, list[str]] = {}
    for part in parts:
        if isinstance(part, ast.Attribute) and isinstance(part.value, ast.Name):
            attributes.setdefault(part.value.id, []).append(part.attr)
    return {
        name: set(attributes[name]) if len(attributes.get(name, [])) == count else None
        for name, count in counts.items()
    }
