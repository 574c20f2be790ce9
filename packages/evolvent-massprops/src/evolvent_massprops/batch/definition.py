"""BatchedDefinition: a system whose cases `evolvent_massprops.batch` integrates, alone and many at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis.definition import SystemDefinition
from evolvent_base.errors import InputError, in_keys, naming_keys
from evolvent_massprops import batch

if TYPE_CHECKING:
    from evolvent.assembly.assembled import Assembly


class BatchedDefinition(SystemDefinition):
    """A system of one free body on ground springs; `batch_case` prepares those that the batch integrates."""

    def batch_case(self, case: Any, assembly: Assembly, times: np.ndarray) -> batch.BatchCase | None:
        """A case, prepared for the batch (`evolvent_massprops.batch.plan`); None where the general engine takes it."""
        raise NotImplementedError(f"{type(self).__name__} has no batch_case()")

    def prepare_run(
        self, case: Any, assembly: Assembly, times: np.ndarray, settings: Mapping[str, Any]
    ) -> tuple[str, Callable[[], tuple[Any, str]], str]:
        """As of `SystemDefinition`; a batch_case where the case has one."""
        batch_case = None if self.level else self.batch_case(case, assembly, times)  # its accuracy is that of the case
        if batch_case is None:
            return super().prepare_run(case, assembly, times, settings)
        return batch.NAME, lambda: (batch_case, "as asked for"), ""

    def run_batch(self, several: Sequence[Any]) -> list[Any]:
        """Runs of many cases, integrated side by side; each has the bits that it has alone.

        Returns
        -------
        list, of the same length
            A run, or the error that a case ended with.
        """
        found: list[Any] = []
        for case in several:
            try:
                with naming_keys(self.keys):
                    assembly, times, _ = self.assembled(case, {})
                    found.append(self.batch_case(case, assembly, times) or self.plan(case).run(None))
            except InputError as error:
                found.append(error)
        batch_cases = [k for k, one in enumerate(found) if isinstance(one, batch.BatchCase)]
        for k, solution in zip(batch_cases, batch.solve([found[k] for k in batch_cases]), strict=True):
            solution.message = in_keys(solution.message, self.keys)
            try:
                found[k] = self.tree(several[k], solution, "as asked for")
            except InputError as error:
                found[k] = error
        return found
