"""What a reader asks of memory: as much as the file needs, whatever could be read at most."""

from __future__ import annotations

import io
import os
import pathlib
import subprocess
import sys

import pytest

from evolvent_base import safe_open
from evolvent_base.errors import InputError

LIMITED = """
import os, pathlib, resource, sys
from evolvent import results
from evolvent_base import safe_open
from evolvent.elements.reduced_files import read_model
from evolvent_base import signals
from evolvent_studio.folder import Folder

folder = pathlib.Path(sys.argv[1])
used = int(pathlib.Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
resource.setrlimit(resource.RLIMIT_AS, (used + 400_000_000,) * 2)
print(len(safe_open.content(folder / "table.csv")))
print(read_model("solar-panel").size)
print(len(signals.read(str(folder / "table.csv")).names))
print(len(Folder(folder).read("table.csv", most=4_000_000_000)))
"""


@pytest.mark.slow
@pytest.mark.skipif(not pathlib.Path("/proc/self/statm").exists(), reason="the address space is known on Linux alone")
def test_readers_do_with_little_memory(tmp_path) -> None:
    """Under a limit of the address space 0.4 GB above what the process has, every kind of reader reads a small file."""
    (tmp_path / "table.csv").write_text("time (s),a (m/s^2)\n" + "".join(f"{k},{k % 7}\n" for k in range(100)))
    done = subprocess.run([sys.executable, "-c", LIMITED, str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    size = str((tmp_path / "table.csv").stat().st_size)
    assert done.stdout.split() == [size, "22", "2", size]


class Counted(io.FileIO):
    """A file that keeps the largest number of bytes that was asked for at once."""

    asked = 0

    def read(self, size: int | None = -1) -> bytes:
        """As a file does."""
        assert size is not None
        self.asked = max(self.asked, size)
        return super().read(size)


@pytest.mark.parametrize("size", [0, 1, 5000])
def test_a_file_is_read_in_its_own_size(tmp_path, size) -> None:
    (tmp_path / "file").write_bytes(b"x" * size)
    with Counted(tmp_path / "file") as file:
        assert safe_open.read_most(file, 8_000_000_000) == b"x" * size
        assert file.asked <= max(size + 1, 1 << 20)


def test_a_file_that_grows_or_has_no_size_is_read_to_its_end_or_the_limit(tmp_path, monkeypatch) -> None:
    path = tmp_path / "file"
    path.write_bytes(os.urandom(3_000_000))
    stated = os.fstat

    def small(number: int) -> os.stat_result:
        found = stated(number)
        return os.stat_result((*found[:6], 0, *found[7:10]))

    monkeypatch.setattr(os, "fstat", small)
    assert safe_open.content(path) == path.read_bytes()
    with pytest.raises(InputError, match="at most 2 MB are read"):
        safe_open.content(path, most=2_000_000)
    with open(path, "rb") as file:
        assert len(safe_open.read_most(file, 2_000_000)) == 2_000_001
