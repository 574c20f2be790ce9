"""Nothing lists the families of records: what is asked about them is asked of them (`evolvent.model.family`)."""

from __future__ import annotations

import ast
import pathlib
from collections.abc import Iterator

import evolvent
from evolvent.model.registry import families, whole

ROOT = pathlib.Path(evolvent.__file__).parent
#: From here on what names families is a list of them.
SEVERAL = 5
#: Lines that name a family, or import one, by folder: bounds that only fall. Some are words of another meaning.
LEFT = {"solvers": 84, "equations": 26, "analysis": 40, "assembly": 35}


#: Modules whose functions have names of families.
MODULES = {"json", "dataclasses"}


def named(node: ast.AST, names: set[str]) -> set[str]:
    """Families that are named in some code, as attributes or words."""
    inside = list(ast.walk(node))
    attributes = {one.attr for one in inside if isinstance(one, ast.Attribute)}
    words = {one.value for one in inside if isinstance(one, ast.Constant) and isinstance(one.value, str)}
    return (attributes | words) & names


def is_of_part(module: str) -> bool:
    """Whether a module of a topic is what users write (`model.registry.beside`)."""
    return module.rpartition(".")[2].split("_")[0] == "part"


def lines(tree: ast.AST, names: set[str]) -> set[int]:
    """Lines of a module that name a family, as an attribute, a word or an argument, or import from one but its part."""
    found = set()
    for one in ast.walk(tree):
        if isinstance(one, ast.Attribute):
            word = "" if isinstance(one.value, ast.Name) and one.value.id in MODULES else one.attr
        elif isinstance(one, ast.keyword):
            word = one.arg
        elif isinstance(one, ast.Constant) and isinstance(one.value, str):
            word = one.value
        elif isinstance(one, ast.ImportFrom) and (one.module or "").startswith("evolvent.families"):
            found |= set() if is_of_part(one.module or "") else {one.lineno}
            continue
        else:
            continue
        if word in names:
            found.add(one.value.lineno if isinstance(one, ast.keyword) else one.lineno)
    return found


def pieces(tree: ast.Module) -> Iterator[ast.FunctionDef | ast.Assign | ast.AnnAssign]:
    """Functions, methods and tables of a module."""
    for node in tree.body:
        for one in node.body if isinstance(node, ast.ClassDef) else [node]:
            if isinstance(one, ast.FunctionDef | ast.Assign | ast.AnnAssign):
                yield one


def test_no_function_and_no_table_names_many_families() -> None:
    names = {family.name for family in whole()}
    assert len(names) > 20
    found = []
    for path in sorted(ROOT.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        if sum(name in text for name in names) < SEVERAL:  # parsing all files takes a hundred times as long
            continue
        for one in pieces(ast.parse(text)):
            if len(named(one, names)) >= SEVERAL:
                found.append(f"{path.relative_to(ROOT)}:{one.lineno}")
    assert not found


def test_a_list_would_be_found() -> None:
    tree = ast.parse('def f(model):\n    return model.springs, model.loads, model.joints, "rods", model.threads.size\n')
    (one,) = pieces(tree)
    assert len(named(one, {family.name for family in whole()})) == SEVERAL


def test_families_are_named_by_fewer_and_fewer_lines() -> None:
    names, found = set(families()), {}
    for folder in LEFT:
        paths = sorted((ROOT / folder).rglob("*.py"))
        found[folder] = sum(len(lines(ast.parse(path.read_text(encoding="utf-8")), names)) for path in paths)
    assert all(found[folder] <= LEFT[folder] for folder in LEFT), found
    assert all(found[folder] > 0.9 * LEFT[folder] - 5 for folder in LEFT), f"lower the bounds to {found}"
