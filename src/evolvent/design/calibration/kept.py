"""Evaluations that a folder keeps, so that a fit goes on where it was stopped."""

from __future__ import annotations

import hashlib
import json
import os
import pathlib
from collections.abc import Sequence
from typing import Any

from evolvent.base import files, safe_open
from evolvent.base.errors import InputError, counted, reason_of


class Kept:
    """Evaluations that a folder keeps: one a line, with its check sum, in a file named by what was asked.

    Attributes
    ----------
    found : dict, of every set of parameters the values of all series
    damaged : int, lines that are left out, whose evaluations are computed again
    """

    def __init__(self, folder: pathlib.Path, asked: str, sizes: Sequence[int]) -> None:
        self._sizes = list(sizes)
        digest = hashlib.sha256(asked.encode()).hexdigest()[:16]
        self.found: dict[str, list[list[float]]] = {}
        self.damaged = 0
        files.make_folder(folder)
        self._file = folder / f"evaluations-{digest}.jsonl"
        if os.path.lexists(self._file):
            self._read()

    def _read(self) -> None:
        """Read the lines that are whole, and write the file again where others are."""
        content = safe_open.content(self._file)
        for line in content.split(b"\n")[:-1]:
            try:
                key, values, check = json.loads(line)
                is_whole = (
                    isinstance(key, str)
                    and check == _check_sum(key, values)
                    and [len(one) for one in values] == self._sizes
                )
            except (ValueError, TypeError, RecursionError):
                is_whole = False
            if is_whole:
                self.found[key] = values
            else:
                self.damaged += 1
        if self.damaged or not content.endswith(b"\n"):  # the line that was being written as the process ended
            files.write_file(self._file, "".join(self._line(key, values) for key, values in self.found.items()))

    def add(self, key: str, values: list[list[float]]) -> None:
        """Keep an evaluation."""
        self.found[key] = values
        try:
            with self._file.open("a", encoding="utf-8") as file:
                file.write(self._line(key, values))
        except OSError as error:
            raise InputError(f"cannot write {str(self._file)!r}: {reason_of(error)}") from None

    def _line(self, key: str, values: list[list[float]]) -> str:
        return json.dumps([key, values, _check_sum(key, values)]) + "\n"

    def sentence(self) -> str:
        """What to say of lines that are left out."""
        many = counted(self.damaged, "evaluation")
        verb = "is" if self.damaged == 1 else "are"
        return f"{many} in {str(self._file)!r} {verb} damaged or altered, and computed again"


def _check_sum(key: Any, values: Any) -> str:
    """Check sum of an evaluation, of the text in which JSON writes it."""
    return hashlib.sha256(json.dumps([key, values]).encode()).hexdigest()[:32]
