"""Plain numba, where its private interfaces are not as they were."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap

import pytest
from numba import config

from evolvent.compiled import interfaces

compiled_only = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled under NUMBA_DISABLE_JIT")


@pytest.mark.parametrize(
    ("used", "reason"),
    [
        (("dispatcher", "_Renamed", None), "numba.core.dispatcher._Renamed is missing"),
        (("moved", "Dispatcher", None), "numba.core.moved.Dispatcher is missing"),
        (("serialize", "dumps", ("obj", "protocol")), "numba.core.serialize.dumps has other arguments"),
        (("dispatcher", "Dispatcher", None), ""),
    ],
)
def test_a_changed_interface_is_named(used, reason, monkeypatch):
    monkeypatch.setattr(interfaces, "_USED", (used,))
    assert interfaces.missing() == reason


def test_this_numba_has_all_of_them():
    assert interfaces.missing() == ""


@compiled_only
@pytest.mark.slow
def test_plain_numba_compiles_kernels_calls_by_address_and_laws(tmp_path):
    """A kernel, functions by address (one is loaded late), a user's law and its derivative; no private module."""
    script = textwrap.dedent(
        """
        import math, sys
        import numpy as np
        import evolvent
        from numba import f8
        from evolvent.compiled import jit, laws, pointer
        from evolvent.compiled.interfaces import PLAIN

        class Holder(pointer.Struct):
            addresses = pointer.shared(jit.ADDRESSES)
            values = pointer.array(1)

        KIND = Holder._numba_type_

        @jit.inlined
        def doubled(x):
            return 2.0 * x

        @jit.indirect(f8(f8, KIND))
        def first(x, holder):
            return doubled(x) + holder.values[1]

        @jit.indirect(f8(f8, KIND))
        def second(x, holder):
            return first(x, holder) + holder.values[0]

        jit.load([second])
        assert second(3.0, Holder(values=np.array([0.5, 0.25]))) == 6.75
        assert jit.loaded_late == [first]

        @evolvent.law
        def law(x, v, t, p):
            return p[0] * math.sin(x)

        compiled = law.of("spring")
        slope = laws.law_address(compiled, "spring")
        assert compiled(0.5, 0.0, 0.0, np.array([8.0])) == 8.0 * math.sin(0.5)
        assert compiled.slope(0.5, 1.0, 0.0, 0.0, 0.0, np.array([8.0])) == 8.0 * math.cos(0.5)
        assert PLAIN and slope
        assert not {"compilers", "codecache.compiled", "codecache.snapshots"} & {
            name.removeprefix("evolvent.compiled.") for name in sys.modules
        }
        """
    )
    (tmp_path / "script.py").write_text(script)
    done = subprocess.run(
        [sys.executable, str(tmp_path / "script.py")],
        env=os.environ | {interfaces.VARIABLE: "1"}, capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "by plain numba" in done.stderr
    assert f"{interfaces.VARIABLE} is set" in done.stderr
