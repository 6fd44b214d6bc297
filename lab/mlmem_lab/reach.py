# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What code makes a result: a hash of every definition that a function reaches, by imports too.

Names are followed through the laboratory, the tools and the scripts. Into `mlmem_ros` they are
not: what a memory does is compared itself (`results.fingerprint`), or every change of a device
would make every result old. Comments, docstrings, annotations, and the file in which a definition
stands do not count; a module that is imported by a name put together as the program runs is not
found.
"""

from __future__ import annotations

import ast
import hashlib
from collections import defaultdict
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[2]
"""Of the checkout."""

PLACES = {'mlmem_lab': ROOT / 'lab', 'mlmem_tools': ROOT, 'tools': ROOT}
"""Where the packages lie whose code is followed."""

ASIDE = (
    'mlmem_lab.results', 'mlmem_lab.reach', 'mlmem_tools.cli',
    'mlmem_lab.studies.campaign.execution',
    'mlmem_lab.studies.campaign.terminal',
)  # fmt: skip
"""What runs a study, keeps its result and prints it: that makes no number."""

SILENT = ('ctx', 'kind', 'type_comment', 'type_params', 'annotation', 'returns')
"""Fields of a syntax tree that change no value, or are not those of every Python."""

Definition = tuple[str, str]
"""A module, and a name in it; '' is what a module does when it is imported."""


class Module(NamedTuple):
    """The names of a module.

    Attributes:
        imports: What each means, as (module, name).
    """

    definitions: dict[str, list[ast.stmt]]
    imports: dict[str, Definition]


@cache
def code(maker: str) -> str | None:
    """Return a hash of what `module:function` reaches, or, without a name, a whole module; None if
    there is no such code.
    """
    name, _, function = maker.partition(':')
    found = _module(name)
    if found is None or (function and function not in found.definitions):
        return None
    reached: dict[Definition, None] = {}
    waiting = [(name, each) for each in ([function] if function else found.definitions)]
    while waiting:
        if (one := waiting.pop()) not in reached:
            reached[one] = None
            waiting += _used(*one)
    hashed = hashlib.blake2b(digest_size=8)
    for told in sorted({(each, _told(module, each)) for module, each in reached}):
        hashed.update(repr(told).encode())
    return hashed.hexdigest()


def source(module: str) -> str | None:
    """Return the text of a module of ours that is followed; None for others."""
    first, *rest = module.split('.')
    if first not in PLACES or module.startswith(ASIDE):
        return None
    path = PLACES[first].joinpath(first, *rest)
    for file in (path / '__init__.py', path.with_suffix('.py')):
        if file.exists():
            return file.read_text(encoding='utf-8')
    return None


@cache
def _module(name: str) -> Module | None:
    text = source(name)
    if text is None:
        return None
    tree, found = ast.parse(text), Module(defaultdict(list), {})
    package = name if source(f'{name}.__init__') is not None else name.rpartition('.')[0]
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            parts = package.split('.')[: 1 - node.level or None] if node.level else []
            origin = '.'.join([*parts, *([node.module] if node.module else [])])
            for alias in node.names:
                found.imports[alias.asname or alias.name] = origin, alias.name
        elif isinstance(node, ast.Import):
            for alias in node.names:
                found.imports[alias.asname or alias.name.partition('.')[0]] = alias.name, ''
    for statement in tree.body:
        if not isinstance(statement, ast.Import | ast.ImportFrom):
            for each in _named(statement):
                found.definitions[each].append(statement)
    return found


def _of(name: str) -> Module:
    found = _module(name)
    assert found is not None, name
    return found


def _named(statement: ast.stmt) -> Sequence[str]:
    """Return the names that a statement of a module defines or changes."""
    if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return [statement.name]
    targets: list[ast.expr] = list(getattr(statement, 'targets', ()))
    if isinstance(statement, ast.AnnAssign | ast.AugAssign):
        targets = [statement.target]
    inside = (node for target in targets for node in ast.walk(target))
    return [node.id for node in inside if isinstance(node, ast.Name)] or ['']


@cache
def _used(module: str, name: str) -> list[Definition]:
    """Return the definitions of ours that a definition uses."""
    found: dict[Definition, None] = {}
    for statement in _of(module).definitions[name]:
        bases = set()
        for node in ast.walk(statement):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                bases.add(node.value)
                found |= dict.fromkeys(_meant(module, node.value.id, node.attr))
            elif isinstance(node, ast.Name) and node not in bases:
                found |= dict.fromkeys(_meant(module, node.id))
    return [*found]


def _meant(module: str, name: str, attribute: str = '') -> Iterator[Definition]:
    """Yield what a name means in a module, or its attribute if it is another module."""
    found = _of(module)
    if name in found.definitions:
        yield module, name
        return
    origin, original = found.imports.get(name, ('', ''))
    inner = f'{origin}.{original}' if original else origin
    if _module(inner) is not None:
        if attribute:
            yield from _meant(inner, attribute)
        else:  # the module itself is handed on: any of its names may be used
            yield from ((inner, each) for each in _of(inner).definitions)
    elif _module(origin) is not None:
        yield from _meant(origin, original)


@cache
def _told(module: str, name: str) -> str:
    return repr([_plain(statement) for statement in _of(module).definitions[name]])


def _plain(node: Any) -> Any:
    """Return a syntax tree as nested tuples, without what changes no value."""
    if isinstance(node, list):
        return [_plain(each) for each in node if not _says_nothing(each)]
    if not isinstance(node, ast.AST):
        return node
    fields = ((name, value) for name, value in ast.iter_fields(node) if name not in SILENT)
    told = ((name, _plain(value)) for name, value in fields if value not in (None, []))
    return type(node).__name__, *told


def _says_nothing(node: Any) -> bool:
    """Whether a statement is a docstring or an import."""
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    return isinstance(node, ast.Import | ast.ImportFrom)
