"""Laws of users have the values of their globals, whatever was stored before."""

from __future__ import annotations

import enum
import json
import math
import os
import pathlib
import subprocess
import sys
import types
from typing import NamedTuple

import numpy as np
import pytest
from numba import config, njit

import evolvent
from evolvent.compiled import jit, laws
from evolvent.compiled.codecache import folder
from evolvent.compiled.codecache.snapshots import Snapshot, snapshot

compiled_only = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled under NUMBA_DISABLE_JIT")
P = np.zeros(1)


@pytest.fixture(autouse=True)
def fresh_folder(tmp_path, monkeypatch):
    """An empty cache folder."""
    monkeypatch.setattr(folder, "CACHE_DIR", tmp_path / "cache")


# ------------------------------------------------------------------------------------------------ digests


def digest(text: str, **names: object) -> str:
    """Digest of the function f of a text, whose module has some names more."""
    space: dict = {"__name__": __name__, "np": np, "math": math, "njit": njit, **names}
    exec(compile(text, "written.py", "exec"), space)
    found = snapshot(space["f"])
    assert isinstance(found, Snapshot)
    return found.digest


class Point(NamedTuple):
    x: float
    y: float


class Colour(enum.Enum):
    RED = 1
    BLUE = 2


K_TIMES = "def f(x):\n    return K * x\n"
#: Values of a global, which all differ.
VALUES = [
    1, 1.0, True, -0.0, 0.0, 1j, "1", b"1", None, (1, 2), (1.0, 2), (1, (2,)), [1, 2], {"a": 1}, {"a": 2},
    frozenset({1}), np.float64(1.0), np.float32(1.0), np.array([1.0, 2.0]), np.array([1.0, 3.0]), np.array([1, 2]),
    np.array([[1.0, 2.0]]), np.ones((2, 3)), np.ones((2, 3), order="F"), Point(1.0, 2.0), Point(1.0, 3.0), Colour.RED,
    Colour.BLUE, math.sin, math.cos, np.sin, np.dtype("f8"),
]  # fmt: skip


def test_values_of_globals_differ():
    found = [digest(K_TIMES, K=value) for value in VALUES]
    assert "" not in found
    assert len(set(found)) == len(VALUES)
    assert found == [digest(K_TIMES, K=value) for value in VALUES]


def test_an_array_enters_by_its_content():
    table = np.array([1.0, 2.0])
    before = digest(K_TIMES, K=table)
    assert digest(K_TIMES, K=table.copy()) == before
    table[1] = 5.0
    assert digest(K_TIMES, K=table) != before


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ("def f(x):\n    return 2.0 * x", "def f(x):\n    return 3.0 * x"),
        ("def f(x, k=2.0):\n    return k * x", "def f(x, k=3.0):\n    return k * x"),
        ("def f(x, *, k=2.0):\n    return k * x", "def f(x, *, k=3.0):\n    return k * x"),
        ("def f(x):\n    return math.sin(x)", "def f(x):\n    return math.cos(x)"),
        (
            "def f(x):\n    def g(y):\n        return 2.0 * y\n    return g(x)",
            "def f(x):\n    def g(y):\n        return 3.0 * y\n    return g(x)",
        ),
        ("def m(k):\n    return lambda x: k * x\nf = m(2.0)", "def m(k):\n    return lambda x: k * x\nf = m(3.0)"),
        (
            "K = 2.0\n@njit\ndef g(x):\n    return K * x\ndef f(x):\n    return g(x)",
            "K = 3.0\n@njit\ndef g(x):\n    return K * x\ndef f(x):\n    return g(x)",
        ),
        (
            "@njit\ndef g(x):\n    return 2 * x\ndef f(x):\n    return g(x)",
            "@njit(fastmath=True)\ndef g(x):\n    return 2 * x\ndef f(x):\n    return g(x)",
        ),
        (
            "K = 2.0\ndef f(x):\n    def g(y):\n        return K * y\n    return g(x)",
            "K = 3.0\ndef f(x):\n    def g(y):\n        return K * y\n    return g(x)",
        ),
    ],
    ids=["constant", "default", "keyword", "function", "inner", "closure", "helper", "options", "inner global"],
)
def test_what_a_function_is_made_of_enters(a, b):
    if config.DISABLE_JIT and "njit" in a:
        pytest.skip("nothing is compiled under NUMBA_DISABLE_JIT")
    assert "" != digest(a) == digest(a) != digest(b) != ""


def module(**values: object) -> types.ModuleType:
    """A module of a user."""
    found = types.ModuleType("users_helpers")
    vars(found).update(values)
    return found


@pytest.mark.parametrize(
    "text",
    [
        "def f(x):\n    return h.K * x",
        "def f(x):\n    return h.inner.K * x",
        "def f(x):\n    m = h\n    return m.K * x",
        "def f(x):\n    return getattr(h, 'K') * x",
    ],
)
def test_attributes_of_modules_enter(text):
    def of(k: float) -> str:
        return digest(text, h=module(K=k, inner=module(K=k), other=object()))

    assert "" != of(2.0) == of(2.0) != of(3.0) != ""


@pytest.mark.parametrize("value", [object(), lambda x: x, [object()], np.array([None]), type("Own", (), {})])
def test_what_cannot_be_decided_is_not_stored(value):
    assert digest(K_TIMES, K=value) == ""


def test_a_function_whose_module_cannot_be_found_again_is_not_stored():
    assert digest(K_TIMES, K=1.0) != digest(K_TIMES, K=1.0, __name__="../nowhere") == ""


def test_what_a_function_does_not_name_does_not_enter():
    assert digest(K_TIMES, K=1.0, other=object()) == digest(K_TIMES, K=1.0, other=5) != ""


# ------------------------------------------------------------------------------------------------ laws, compiled

#: A law of every kind that returns or adds K, and how it is called.
LAWS = {
    "spring": ("def law(x, v, t, p):\n    return K", (0.0, 0.0, 0.0, P)),
    "force": ("def law(x, v, t, p):\n    return K, 0.0, 0.0", (np.zeros(3), np.zeros(3), 0.0, P)),
    "drive": ("def law(t, p):\n    return K, 0.0, 0.0", (0.0, P)),
    "event": ("def law(t, y, p):\n    return K", (0.0, P, P)),
    "element": ("def law(t, x, v, p, f):\n    return K, 0.0", (0.0, P, P, P, P)),
    "spring, time first": ("def law(t, x, v, p):\n    return K", (0.0, 0.0, 0.0, P)),
    "force, time first": ("def law(t, x, v, p):\n    return K, 0.0, 0.0", (np.zeros(3), np.zeros(3), 0.0, P)),
}


def made(name: str, k: float):
    """A law of a kind, whose global is k."""
    space = {"K": k, "__name__": __name__}
    exec(compile(LAWS[name][0], "written.py", "exec"), space)
    return laws.law(space["law"]).of(name.partition(",")[0])


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
def test_a_law_that_is_defined_again_has_the_new_value(name):
    for k in (10.0, 20.0, 10.0):
        law = made(name, k)
        assert np.ravel(law(*LAWS[name][1]))[0] == k
        if not config.DISABLE_JIT:
            assert law._cache._content
    if not config.DISABLE_JIT:
        assert sum(law.stats.cache_hits.values()) == 1  # the first one's


HELPERS = """
import numpy as np
from numba import njit
from evolvent.compiled import jit

K = 10.0
TABLE = np.array([1.0, 2.0])


@njit
def f(x):
    return K * x


@njit("f8(f8)")
def signed(x):
    return K * x + 7 // 2


@njit(cache=True)
def stored(x):
    return K * x


@njit
def deep(x):
    return f(x) + TABLE[1]


@njit
def again(n):
    if n <= 0:
        return K
    return again(n - 1)


@jit.kernel
def kernel(x):
    return K * x


def plain(x):
    return K * x
"""
THROUGH = {
    "constant": "helpers.K * x",
    "attribute": "helpers.f(x)",
    "name": "f(x)",
    "signed": "signed(x) - 3.0",
    "stored by numba": "stored(x)",
    "two deep": "deep(x) - TABLE[1]",
    "kernel": "kernel(x)",
    "recursive": "again(3) * x",
}


@compiled_only
@pytest.mark.slow
@pytest.mark.parametrize("through", THROUGH)
def test_a_law_has_the_values_of_its_helpers_globals(tmp_path, monkeypatch, through):
    """Also of a helper that is compiled already, here or in a folder of numba's own."""
    (tmp_path / "users_helpers.py").write_text(HELPERS)
    monkeypatch.syspath_prepend(tmp_path)
    sys.modules.pop("users_helpers", None)
    import users_helpers as helpers

    for k in (10.0, 20.0, 30.0, 20.0):
        helpers.K, helpers.TABLE[1] = k, -k
        for one in (helpers.f, helpers.stored, helpers.kernel):
            one(1.0)  # as of the first pass
        space = {**vars(helpers), "helpers": helpers, "__name__": __name__}
        exec(compile(f"def law(x, v, t, p):\n    return {THROUGH[through]}", "written.py", "exec"), space)
        law = laws.law(space["law"]).of("spring")
        assert law(1.0, 0.0, 0.0, P) == k
    hits = sum(law.stats.cache_hits.values())
    assert hits == (0 if through == "recursive" else 1)  # stored code that calls itself ends the process (numba 0.68)


@compiled_only
@pytest.mark.slow
def test_a_plain_function_with_an_implementation_for_numba_is_not_stored(tmp_path):
    from numba.extending import register_jitable

    @register_jitable
    def helper(x):
        return 2.0 * x

    @laws.law
    def law(x, v, t, p):
        return helper(x)

    compiled = law.of("spring")
    assert compiled(1.0, 0.0, 0.0, P) == 2.0
    assert not compiled._cache._digest
    assert list(tmp_path.rglob("*.nbc")) == []


@compiled_only
@pytest.mark.slow
def test_a_kernel_of_another_package_has_the_value_of_its_global(tmp_path):
    """Such a kernel is kept by the same digest as a law, and no longer by its name and line."""
    found = []
    for k in (10.0, 20.0, 10.0):
        space = {"K": k, "__name__": __name__, "kernel": jit.kernel}
        text = "@kernel\ndef helper(x):\n    return K * x\n\n@kernel\ndef f(x):\n    return helper(x)\n"
        exec(compile(text, "plugin.py", "exec"), space)
        found.append((space["f"](2.0), sum(space["f"].dispatcher.stats.cache_hits.values())))
    assert found == [(20.0, 0), (40.0, 0), (20.0, 1)]


@compiled_only
@pytest.mark.slow
def test_only_the_last_laws_of_a_name_are_kept(tmp_path, monkeypatch):
    from evolvent.compiled.codecache import compiled

    monkeypatch.setattr(compiled.LawCache, "most", 2)
    for k in (1.0, 2.0, 3.0):
        made("spring", k)
    assert len(list(tmp_path.rglob("*.nbc"))) == 2


SCRIPT = """
import json, sys
import numpy as np
import evolvent
from numba import njit

found = []
for word in sys.argv[1:]:
    K = float(word)

    @njit
    def helper(x):
        return K * x

    @evolvent.law
    def law(x, v, t, p):
        return K * x + helper(x) - K * x

    compiled = law.of("spring")
    found.append([compiled(1.0, 0.0, 0.0, np.zeros(1)), sum(compiled.stats.cache_hits.values())])

system = evolvent.System()
system.add(evolvent.parts.Point(mass=1.0, position=(2.0, 0.0, 0.0)), "ball")
system.add(evolvent.parts.Spring(a=(0.0, 0.0, 0.0), b="ball", length=1.0, law=law))
print(json.dumps(found))
"""


@compiled_only
@pytest.mark.slow
def test_a_new_process_takes_the_value_of_its_own(tmp_path):
    """Also where stored code and new code have functions of one name and number in their processes."""
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    paths = os.pathsep.join([str(pathlib.Path(evolvent.__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    (tmp_path / "own").mkdir(mode=0o700)
    environment = {**os.environ, "PYTHONPATH": paths, "EVOLVENT_CACHE": str(tmp_path / "own")}

    def run(*words):
        done = subprocess.run(
            [sys.executable, str(script), *words], capture_output=True, text=True, env=environment, check=False
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    assert run("10", "20", "30") == [[10.0, 0], [20.0, 0], [30.0, 0]]
    assert run("20", "40", "50", "30") == [[20.0, 1], [40.0, 0], [50.0, 0], [30.0, 1]]
