"""Part of the build: a wheel carries the compiled functions of the folder that ``$EVOLVENT_KERNELS`` names.

Such a wheel is for one Python and one platform. Without that variable the wheel is pure Python.
"""

import os
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class KernelsHook(BuildHookInterface):
    """Adds the folder, and the tag of this Python and platform."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Change what is built."""
        folder = os.environ.get("EVOLVENT_KERNELS")
        if folder and version == "standard":
            build_data["force_include"][folder] = "evolvent/_kernels"
            build_data["pure_python"] = False
            build_data["infer_tag"] = True
