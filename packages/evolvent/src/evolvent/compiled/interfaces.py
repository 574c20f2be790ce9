"""Whether numba has the private interfaces that compilation and its cache use, or plain ``numba.njit`` has to do.

With them a function is compiled once, linked by its address, and stored by a digest of all that it is compiled from;
indices are not tested for negative ones. Plain numba gives the same results, but tests indices, compiles what a kernel
is linked into with it, and stores nothing: each start compiles for minutes. ``EVOLVENT_PLAIN_NUMBA=1`` asks for it.
"""

from __future__ import annotations

import importlib
import inspect
import os
from typing import Any

#: Environment variable that asks for plain numba.
VARIABLE = "EVOLVENT_PLAIN_NUMBA"
#: What is used: module, name in it, and the arguments of a function, or None where it need only be there.
_USED: tuple[tuple[str, str, tuple[str, ...] | None], ...] = (
    ("dispatcher", "_FunctionCompiler", ("py_func", "targetdescr", "targetoptions", "locals", "pipeline_class")),
    ("dispatcher", "_FunctionCompiler._compile_core", ("self", "args", "return_type")),
    ("dispatcher", "_FunctionCompiler._customize_flags", ("self", "flags")),
    ("dispatcher", "Dispatcher", None),
    ("codegen", "JITCPUCodegen._get_host_cpu_name", ("self",)),
    ("codegen", "JITCPUCodegen._customize_tm_features", ("self",)),
    ("caching", "_Cache.load_overload", ("self", "sig", "target_context")),
    ("caching", "_Cache.save_overload", ("self", "sig", "data")),
    ("compiler", "CompileResult._rebuild", None),
    ("compiler", "compile_result", None),
    ("registry", "cpu_target.target_context._internal_codegen", None),
    ("registry", "CPUDispatcher", None),
    ("serialize", "dumps", ("obj",)),
    ("targetconfig", "TargetConfig.values", ("self",)),
    ("targetconfig", "TargetConfig.options", None),
    ("extending", "_Intrinsic", None),
    ("typeinfer", "register_dispatcher", ("disp",)),
    ("typing.templates", "builtin_registry", None),
)


def missing() -> str:
    """The first private interface of numba that is not as this package uses it; '' where all are."""
    for module, name, arguments in _USED:
        try:
            found: Any = importlib.import_module(f"numba.core.{module}")
            for part in name.split("."):
                found = getattr(found, part)
            if arguments is not None and tuple(inspect.signature(found).parameters) != arguments:
                return f"numba.core.{module}.{name} has other arguments"
        except (ImportError, AttributeError, TypeError, ValueError):
            return f"numba.core.{module}.{name} is missing"
    return ""


#: Why plain numba is used; '' where it is not.
REASON = f"{VARIABLE} is set" if os.environ.get(VARIABLE, "") not in ("", "0") else missing()
#: Whether functions are compiled by plain numba.
PLAIN = bool(REASON)
