"""Stored machine code that is damaged: it is compiled again, with one sentence, and never unpickled before."""

from __future__ import annotations

import os
import pickle

import pytest
from numba import config

from evolvent.compiled import jit
from evolvent.compiled.codecache import files, folder

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled under NUMBA_DISABLE_JIT"),
]
posix_only = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="POSIX alone has this")


def twice(x):
    return 2.0 * x


class Bomb:
    """What sets a trap for whoever unpickles it."""

    def __init__(self, place):
        self.place = place

    def __reduce__(self):
        return os.mkdir, (str(self.place),)


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """The file of a function that is compiled and stored."""
    monkeypatch.setattr(folder, "CACHE_DIR", tmp_path / "cache")
    monkeypatch.setattr(files, "_said", set())
    assert called() == (4.0, 0)
    (found,) = (tmp_path / "cache").rglob("*.nbc")
    assert called() == (4.0, 1)
    return found


def called():
    """What the function returns as in a new process, and whether it was found in the cache."""
    function = jit.kernel(twice).dispatcher
    return function(2.0), sum(function.stats.cache_hits.values())


def other_function(path):
    """The file of another function."""

    def thrice(x):
        return 3.0 * x

    jit.kernel(thrice).dispatcher(1.0)
    (other,) = (one for one in path.parent.iterdir() if "thrice" in one.name)
    return other.read_bytes()


def changed(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    return bytes(content)


DAMAGES = {
    "empty": (lambda path: b"", "it is empty"),
    "cut in its head": (lambda path: path.read_bytes()[:20], "its check sum differs"),
    "cut": (lambda path: path.read_bytes()[:-100], "its check sum differs"),
    "longer": (lambda path: path.read_bytes() + b"\0", "its check sum differs"),
    "one bit": (changed, "its check sum differs"),
    "garbage": (lambda path: os.urandom(5000), "its check sum differs"),
    "numba's own": (lambda path: pickle.dumps((1, 2)), "its check sum differs"),
    "text": (lambda path: b"version https://git-lfs.github.com/spec/v1\n", "its check sum differs"),
    "of another function": (other_function, "its check sum differs"),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_file_is_compiled_again(kept, capsys, name):
    damage, why = DAMAGES[name]
    kept.write_bytes(damage(kept))
    assert called() == (4.0, 0)
    said = capsys.readouterr().err
    assert said == f"evolvent: stored machine code in {str(kept)!r} cannot be used: {why}; it is compiled again\n"
    assert called() == (4.0, 1)  # which was stored in its place
    assert capsys.readouterr().err == ""


def test_a_missing_file_is_compiled_again_without_a_word(kept, capsys):
    kept.unlink()
    assert called() == (4.0, 0)
    assert called() == (4.0, 1)
    assert capsys.readouterr().err == ""


def test_a_folder_in_the_place_of_a_file(kept, capsys):
    kept.unlink()
    kept.mkdir()
    (kept / "of a user").write_text("")
    assert called() == (4.0, 0)
    assert "cannot be used: it is not a file; it is compiled again\n" in capsys.readouterr().err
    assert (kept / "of a user").exists()


def test_a_file_in_the_place_of_the_folder(kept, capsys):
    kept.unlink()
    kept.parent.rmdir()
    kept.parent.write_text("")
    assert called() == (4.0, 0)
    assert capsys.readouterr().err.count("\n") == 1


@posix_only
def test_others_must_not_have_written_a_file(kept, capsys, tmp_path):
    kept.chmod(0o666)
    assert called() == (4.0, 0)
    assert "cannot be used: it can be changed by all users; it is compiled again\n" in capsys.readouterr().err
    assert kept.stat().st_mode & 0o077 == 0
    elsewhere = tmp_path / "elsewhere"
    kept.rename(elsewhere)
    kept.symlink_to(elsewhere)
    files._said.clear()
    assert called() == (4.0, 0)
    assert "it is a symbolic link; it is compiled again\n" in capsys.readouterr().err
    assert not kept.is_symlink()
    kept.unlink()
    os.mkfifo(kept)
    files._said.clear()
    assert called() == (4.0, 0)
    assert "it is not a file" in capsys.readouterr().err


@posix_only
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root reads everything")
def test_a_file_that_cannot_be_read(kept, capsys):
    kept.chmod(0)
    assert called() == (4.0, 0)
    assert "permission denied" in capsys.readouterr().err


def test_a_file_is_not_unpickled_before_its_check_sum_is_right(kept, tmp_path):
    head = kept.read_bytes()[: len(files._HEAD) + files._SUM]
    for content in (pickle.dumps(Bomb(tmp_path / "ran")), head + pickle.dumps(Bomb(tmp_path / "ran"))):
        kept.write_bytes(content)
        assert called() == (4.0, 0)
    assert not (tmp_path / "ran").exists()


def test_many_damaged_files_give_one_sentence(kept, capsys):
    other_function(kept)
    for path in kept.parent.iterdir():
        path.write_bytes(b"")
    called()
    other_function(kept)
    assert capsys.readouterr().err.count("\n") == 1


def test_a_full_disk_is_said_once(kept, monkeypatch, capsys):
    kept.unlink()

    def full(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, "replace", full)
    assert called() == called() == (4.0, 0)
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "no space left on device" in said
    assert list(kept.parent.iterdir()) == []
