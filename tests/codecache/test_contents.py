"""Digests of the package's own functions: what changes them, and what does not."""

from __future__ import annotations

import dis
import json
import os
import shutil
import subprocess
import sys
import types
from types import CodeType

import numpy as np
import pytest
from numba import config

from evolvent.compiled import codecache, jit
from evolvent.compiled.codecache import folder

pytestmark = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled under NUMBA_DISABLE_JIT")
contents = pytest.importorskip("evolvent.compiled.codecache.contents")

SOURCE = '''
"""A module."""
from typing import NamedTuple
import numpy as np
from numba import f8
from evolvent.compiled.jit import indirect, inlined, kernel
from evolvent.compiled.pointer import Struct, array, record, shared, struct
from evolvent.compiled.jit import ADDRESSES

FACTOR = 2.0
TABLE = np.array([1.0, 2.0])
ROW = np.dtype([("k", float), ("x", float)], align=True)

class Pair(NamedTuple):
    a: float
    b: float

class Inner(Struct):
    springs = array(1, ROW)
    unused = array(1)

class Holder(Struct):
    values = array(1)
    inner = struct(Inner)
    unused = array(1)
    addresses = shared(ADDRESSES)

def make(scale):
    @kernel
    def scaled(x):
        return scale * x
    return scaled

scaled = make(3.0)

@kernel
def deepest(x):
    """Doc."""
    return FACTOR * x

@kernel
def linked(x, n=1):
    # comment
    return deepest(x) + n

@indirect(f8(Holder._numba_type_, f8))
def called(holder, x):
    return holder.values[0] + x

@kernel
def beside(x):
    return x + 1.0

@indirect(f8(Holder._numba_type_, f8))
def outer(holder, x):
    if x < 0.0:
        raise ValueError("it is negative")
    pair = Pair(x, TABLE[1])
    return linked(x) + scaled(x) + called(holder, x) + pair.a + holder.inner.springs[0].k
'''

CHANGES = {
    "formula of a kernel in a kernel": ("return FACTOR * x", "return FACTOR + x"),
    "constant": ("FACTOR = 2.0", "FACTOR = 2.5"),
    "kind of a constant": ("FACTOR = 2.0", "FACTOR = 2"),
    "table": ("np.array([1.0, 2.0])", "np.array([1.0, 3.0])"),
    "closure": ("make(3.0)", "make(4.0)"),
    "default": ("n=1", "n=2"),
    "inlined": ("@kernel\ndef deepest", "@inlined\ndef deepest"),
    "fields of a tuple": ("    a: float\n    b: float", "    b: float\n    a: float"),
    "fields of a record": ('("k", float), ("x", float)', '("x", float), ("k", float)'),
    "longer record": ('("x", float)]', '("x", float), ("y", float)]'),
    "place of a field": ("    values = array(1)\n", "    first = array(1)\n    values = array(1)\n"),
    "place of the table of addresses": ("    unused = array(1)\n    addresses", "    unused = array(2)\n    addresses"),
    "dimension of a field": ("    springs = array(1, ROW)", "    springs = array(2, ROW)"),
    "text of an exception": ("it is negative", "it is below zero"),
    "options": ("_numba_type_, f8))\ndef outer", "_numba_type_, f8), disjoint=True)\ndef outer"),
}  # fmt: skip
NO_CHANGES = {
    "comment": ("# comment", "# another\n    # one"),
    "docstring": ('"""Doc."""', '"""Another.\n\n    Longer.\n    """'),
    "docstring of the module": ('"""A module."""', '"""One.\n"""'),
    "lines": ("FACTOR = 2.0", "\n\nFACTOR = 2.0"),
    "another kernel": ("return x + 1.0", "return x + 2.0"),
    "content of a function that is called by address": ("return holder.values[0] + x", "return holder.values[0] - x"),
    "field that is not read": ("    unused = array(1)\n\n", "    unused = array(2)\n    more = array(1)\n\n"),
    "name of a constant that is not read": ("FACTOR = 2.0", "FACTOR = 2.0\nOTHER = 5.0"),
}  # fmt: skip


def digest_of(source: str) -> str:
    module = types.ModuleType("evolvent.kernels.made_for_a_test")
    sys.modules[module.__name__] = module
    before = dict(jit._BY_SLOT)
    try:
        exec(compile(source, "made_for_a_test.py", "exec"), module.__dict__)
        outer = module.outer
        options = f"disjoint={outer._disjoint}"
        return contents.digest(outer.py_func, outer.signature, options)
    finally:
        del sys.modules[module.__name__]
        jit._BY_SLOT.clear()
        jit._BY_SLOT.update(before)


@pytest.fixture(scope="module")
def before():
    return digest_of(SOURCE)


def changed(change):
    old, new = change
    assert SOURCE.count(old) == 1
    return SOURCE.replace(old, new)


@pytest.mark.parametrize("name", CHANGES)
def test_what_counts(before, name):
    assert digest_of(changed(CHANGES[name])) != before


@pytest.mark.parametrize("name", NO_CHANGES)
def test_what_does_not_count(before, name):
    assert digest_of(changed(NO_CHANGES[name])) == before


def test_what_is_not_known_is_refused():
    source = SOURCE.replace("FACTOR = 2.0", "class Odd:\n    pass\n\nFACTOR = Odd()")
    with pytest.raises(contents.Unknown, match="Odd"):
        digest_of(source)


def slowly(code: CodeType) -> dict[str, set[str]]:
    """As `contents.scan`, by the standard library."""
    found, last = {}, None
    for one in dis.get_instructions(code):
        if last is not None and one.opname in ("LOAD_ATTR", "LOAD_METHOD"):
            last.add(one.argval)
        last = found.setdefault(one.argval, set()) if one.opname == "LOAD_GLOBAL" else None
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            for name, asked in slowly(inner).items():
                found.setdefault(name, set()).update(asked)
    return found


def test_globals_are_read_as_by_the_standard_library():
    for one in jit.functions():
        assert contents.scan(one.py_func.__code__).loads == slowly(one.py_func.__code__)


def test_slots_of_the_package_do_not_depend_on_the_order_of_imports():
    own = [one for one in jit._BY_SLOT.values() if one.is_own]
    names = [f"{one.py_func.__module__}.{one.py_func.__qualname__}" for one in own]
    assert len({jit._place(name) for name in names}) == len(set(names))


SCRIPT = """
import importlib, json, sys
from evolvent.compiled import codecache, jit
from evolvent.compiled.codecache import contents
for name in codecache.sources():
    importlib.import_module(name)
found = {f"{one.py_func.__module__}.{one.py_func.__qualname__}": contents.digest(one.py_func, one.signature, "")
         for one in jit.functions()}
sys.stdout.write(json.dumps(found))
"""


def digests(path, *options) -> dict[str, str]:
    """Digests of all functions of the package in a folder, in a new process."""
    environment = {**os.environ, "PYTHONPATH": str(path), "PYTHONHASHSEED": str(np.random.default_rng().integers(1000))}
    done = subprocess.run(
        [sys.executable, *options, "-c", SCRIPT], capture_output=True, text=True, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_a_change_changes_what_it_goes_into_alone(tmp_path):
    """A message changes no function; a kernel those that it goes into; the digests are those of any process."""
    shutil.copytree(folder._PACKAGE, tmp_path / "evolvent", ignore=shutil.ignore_patterns("__pycache__"))
    before = digests(tmp_path)
    assert len(before) > 300

    messages = tmp_path / "evolvent" / "solvers" / "time" / "messages.py"
    messages.write_text(messages.read_text().replace("the ", "the very ").replace("# ", "## "))
    assert digests(tmp_path, "-OO") == before

    springs = tmp_path / "evolvent" / "families" / "springs" / "springs.py"
    text = springs.read_text()
    assert "return" in text
    springs.write_text(text.replace("    return ", "    return 1.0 * ", 1))
    after = digests(tmp_path)
    others = {name for name in before if before[name] != after[name]}
    assert after.keys() == before.keys()
    assert others
    assert len(others) < 0.1 * len(before)


def test_the_sources_are_those_that_declare_functions():
    modules = codecache.sources().keys()
    assert {one.py_func.__module__ for one in jit.functions() if one.is_own} <= modules
