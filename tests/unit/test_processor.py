"""What must not depend on the processor: start states, constants of elements; and for which processor code is made."""

from __future__ import annotations

import json
import os
import pathlib
import platform
import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow
STATES = pathlib.Path(__file__).parents[1] / "start_states.py"


def output(*command: str, **environment: str) -> str:
    """What Python prints; it compiles nothing."""
    done = subprocess.run(
        [sys.executable, *command],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"} | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="kernels of OpenBLAS for x86")
def test_start_states_and_constants_have_the_same_digits_under_every_kernel_of_blas():
    """The kernel of the oldest processor and the one of this; NumPy's loops with and without AVX2."""
    mine = json.loads(output(os.fspath(STATES)))
    other = json.loads(
        output(os.fspath(STATES), OPENBLAS_CORETYPE="Prescott", NPY_DISABLE_CPU_FEATURES="AVX2 FMA3 X86_V3 X86_V4")
    )
    assert mine.keys() == other.keys()
    for case, found in mine.items():
        assert len(found) > 100
        assert [name for name, digest in found.items() if other[case][name] != digest] == [], case


def test_code_for_a_named_processor_has_its_own_cache_folder():
    """NUMBA_CPU_NAME=generic is honoured: no baseline, no AVX2."""
    program = (
        "from numba.core.registry import cpu_target\n"
        "from evolvent.compiled import codecache, compilers\n"
        "with compilers.compiling:\n"
        "    _, name, features = cpu_target.target_context.codegen().magic_tuple()\n"
        "print(codecache.BASELINE, name, repr(features), codecache.folder_name())\n"
    )
    words = output("-c", program, NUMBA_CPU_NAME="generic").split()
    assert words[:3] == ["None", "generic", "''"]
    assert "-generic-" in words[3]
