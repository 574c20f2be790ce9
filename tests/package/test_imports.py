"""Imports of the packages: no circle of files, and few imports inside functions, each with its reason."""

import ast
import functools
import pathlib
from collections.abc import Iterator

import pytest

PACKAGES = sorted(pathlib.Path(__file__).parents[2].glob("packages/*/src/*/"))
#: Imports inside functions in all packages together, at most.
MOST = 60


def modules(package: pathlib.Path) -> dict[str, pathlib.Path]:
    """Files of a package by the names of their modules."""
    found = {}
    for path in package.rglob("*.py"):
        words = path.relative_to(package.parent).with_suffix("").parts
        found[".".join(words[:-1] if words[-1] == "__init__" else words)] = path
    return found


def imported(node: ast.AST) -> list[str]:
    """Names that a statement imports: also under TYPE_CHECKING, in functions, and by `lazy.load`."""
    if isinstance(node, ast.Import):
        return [one.name for one in node.names]
    if isinstance(node, ast.ImportFrom):
        return [f"{node.module}.{one.name}" for one in node.names]
    if (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "load"
        and ast.unparse(node.func.value) == "lazy"
    ):
        return [ast.literal_eval(node.args[0])]
    return []


@functools.cache
def tree_of(path: pathlib.Path) -> ast.Module:
    """A file as its statements."""
    return ast.parse(path.read_text(encoding="utf-8"))


@functools.cache
def graph(package: pathlib.Path) -> dict[str, set[str]]:
    """Which files of a package import which."""
    files, found = modules(package), dict[str, set[str]]()
    for name, path in files.items():
        found[name] = set()
        for node in ast.walk(tree_of(path)):
            for target in imported(node):
                while target and target not in files:
                    target = target.rpartition(".")[0]
                if target and target != name:
                    found[name].add(target)
    return found


def circle(of: dict[str, set[str]]) -> list[str]:
    """The names along a circle, the first again at its end; none where there is no circle."""
    done: set[str] = set()

    def search(name: str, path: list[str]) -> list[str]:
        if name in path:
            return [*path[path.index(name) :], name]
        if name not in done:
            for target in sorted(of[name]):
                if found := search(target, [*path, name]):
                    return found
            done.add(name)
        return []

    return next((found for name in sorted(of) if (found := search(name, []))), [])


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.name)
def test_no_files_import_one_another_in_a_circle(package):
    found = circle(graph(package))
    assert not found, " -> ".join(found)


def topics(of: dict[str, set[str]], package: str) -> dict[str, set[str]]:
    """Which folders of a package import which, of imports of files."""
    found: dict[str, set[str]] = {}
    for name, targets in of.items():
        if name.startswith(f"{package}."):
            own = name.removeprefix(f"{package}.").split(".")[0]
            others = {one.removeprefix(f"{package}.").split(".")[0] for one in targets if one.startswith(f"{package}.")}
            found.setdefault(own, set()).update(others - {own})
    return found


def test_no_topics_of_families_import_one_another_in_a_circle():
    (package,) = (one for one in PACKAGES if one.name == "evolvent")
    found = topics(graph(package), "evolvent.families")
    assert len(found) > 10
    assert not circle(found), " -> ".join(circle(found))


def test_a_circle_is_found():
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c", "b"]
    assert not circle({"a": {"b", "c"}, "b": {"c"}, "c": set()})


def in_functions(tree: ast.AST, within: bool = False) -> Iterator[list[ast.stmt]]:
    """Groups of import statements that follow one another inside functions."""
    for child in ast.iter_child_nodes(tree):
        if isinstance(child, ast.expr):  # no statement is in it
            continue
        yield from in_functions(child, within or isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef))
    for name in ("body", "orelse", "finalbody") if within else ():
        group: list[ast.stmt] = []
        statements = getattr(tree, name, None)
        for statement in [*statements, ast.Pass()] if isinstance(statements, list) else ():
            if isinstance(statement, ast.Import | ast.ImportFrom):
                group.append(statement)
            elif group:
                yield group
                group = []


def test_imports_inside_functions_are_few_and_say_why():
    count, silent = 0, []
    for package in PACKAGES:
        for path in package.rglob("*.py"):
            lines = path.read_text(encoding="utf-8").splitlines()
            for group in in_functions(tree_of(path)):
                count += len(group)
                if not any("#" in lines[one.end_lineno - 1] for one in group):
                    silent.append(f"{path.relative_to(package.parent)}:{group[0].lineno}")
    assert not silent, "imports without a reason in a comment on their line: " + ", ".join(silent)
    assert 0 < count <= MOST
