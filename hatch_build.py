"""Parts of the build: the root project is all packages together, and a wheel may carry compiled functions.

Such a wheel carries those of the folder that ``$EVOLVENT_KERNELS`` names, and is for one Python and one platform.
Without that variable the wheel is pure Python.
"""

import os
import pathlib
import sys
import sysconfig
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface
from packaging import tags

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "tools"))
import workspace


def tag() -> str:
    """That of this Python and platform; on Linux with the least C library, since no index takes the bare name.

    The machine code has no symbols of that library: those that it calls are found by numba, which asks for no less.
    """
    first = next(iter(tags.sys_tags()))
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    if platform.startswith("linux_"):
        platform = platform.replace("linux", "manylinux_2_28", 1)
    elif platform.startswith("macosx"):
        platform = first.platform
    return f"{first.interpreter}-{first.abi}-{platform}"


class KernelsHook(BuildHookInterface):
    """Adds the folder, and the tag of this Python and platform."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Change what is built."""
        folder = os.environ.get("EVOLVENT_KERNELS")
        if folder and version == "standard":
            build_data["force_include"][folder] = "evolvent/_kernels"
            build_data["pure_python"] = False
            build_data["tag"] = tag()


class PackagesHook(MetadataHookInterface):
    """Adds what the packages state."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Fill in what is dynamic."""
        metadata |= workspace.merged(self.config["extras"])
