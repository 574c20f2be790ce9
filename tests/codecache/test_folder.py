"""The folder of stored machine code: where it is, and which folders are refused."""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys
import tempfile

import pytest

from evolvent.compiled.codecache import files, folder
from evolvent.compiled.codecache.folder import VARIABLE

posix_only = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="the rights of others are not in the mode of a file")
root_only = pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root gives files away")
OTHER = 12345


@pytest.fixture(autouse=True)
def nothing_said(monkeypatch):
    """As in a new process, whose variables of the environment are put back."""
    monkeypatch.setattr(files, "_said", set())
    monkeypatch.setenv(VARIABLE, "")


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A cache folder of the user, to which the search falls back."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    return tmp_path / "home" / "evolvent"


def test_the_cache_folder_is_where_the_user_wants_it(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "mine"))
    found = folder._find_cache_dir()
    assert found == tmp_path / "mine" / folder.folder_name()
    assert found.is_dir()
    assert capsys.readouterr().err == ""


@posix_only
def test_others_have_no_right_in_a_new_folder(home):
    found = folder._find_cache_dir()
    assert found.parent == home
    assert found.stat().st_mode & 0o077 == found.parent.stat().st_mode & 0o077 == 0


def test_an_unusable_cache_folder_falls_back_to_the_users_own(tmp_path, monkeypatch, home, capsys):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "file" / "below"))
    assert folder._find_cache_dir().parent == home
    assert os.environ[VARIABLE] == str(home)  # the processes that this one starts use the same
    said = capsys.readouterr().err
    assert said.startswith(f"evolvent: compiled functions are not stored in {str(tmp_path / 'file' / 'below')!r}: ")
    assert said.count("\n") == 1


def test_without_any_usable_folder_a_temporary_one_is_taken(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "file" / "below"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file" / "too"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    assert folder._find_cache_dir().parent.name.startswith("evolvent-")
    assert folder._find_cache_dir() == folder._find_cache_dir()


@posix_only
def test_the_last_resort_is_refused_if_another_user_made_it(tmp_path, monkeypatch, capsys):
    """What lies below the temporary folder may be anybody's; then a folder of this process alone is taken."""
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file" / "too"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    trap = tmp_path / f"evolvent-{os.getuid()}"
    trap.mkdir()
    trap.chmod(0o777)
    found = folder._find_cache_dir()
    assert found.parent.name.startswith("evolvent-cache-")
    assert found.parent.stat().st_mode & 0o077 == 0
    assert list(trap.iterdir()) == []
    assert f"{str(trap)!r} can be changed by all users; name a folder of your own" in capsys.readouterr().err
    assert os.environ[VARIABLE] == str(found.parent)


@posix_only
@pytest.mark.parametrize(
    ("mode", "why"),
    [(0o700, ""), (0o755, ""), (0o757, "can be changed by all users"), (0o777, "can be changed by all")],
)
def test_a_folder_that_others_may_write_to_is_refused(tmp_path, mode, why):
    given = tmp_path / "cache"
    given.mkdir()
    given.chmod(mode)
    found = folder.refusal(str(given))
    assert (why in found) if why else found == ""
    assert folder.refusal(str(given / "more")) == found  # there others may put a folder of theirs


@posix_only
def test_a_group_of_others_is_refused_and_the_users_own_is_not(tmp_path, monkeypatch):
    given = tmp_path / "cache"
    given.mkdir()
    given.chmod(0o770)
    monkeypatch.setattr(files, "_is_private", lambda group: False)
    assert folder.refusal(str(given)) == f"{str(given)!r} can be changed by its group"
    monkeypatch.setattr(files, "_is_private", lambda group: True)
    assert folder.refusal(str(given)) == ""


@root_only
@pytest.mark.parametrize("part", ["cache", "cache/inner"])
def test_a_folder_of_another_user_is_refused(tmp_path, part):
    inner = tmp_path / "cache" / "inner"
    inner.mkdir(parents=True)
    os.chown(tmp_path / part, OTHER, OTHER)
    assert folder.refusal(str(inner)) == f"{str(tmp_path / part)!r} belongs to another user"


@posix_only
def test_a_link_is_not_followed_below_the_temporary_folder(tmp_path):
    real, link = tmp_path / "real", tmp_path / "link"
    real.mkdir(mode=0o700)
    link.symlink_to(real)
    assert folder.refusal(str(link)) == folder.refusal(str(link / "more")) == f"{str(link)!r} is a symbolic link"


@pytest.fixture
def private(tmp_path, monkeypatch):
    """A folder on the way to which nobody else may write, as it is seen: wherever checkout and temporary folder lie."""
    look, above = pathlib.Path.lstat, {tmp_path, *tmp_path.parents}

    def lstat(path):
        found = look(path)
        return os.stat_result((found.st_mode & ~0o022, *found[1:])) if path in above else found

    monkeypatch.setattr(pathlib.Path, "lstat", lstat)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    return tmp_path


@posix_only
def test_a_link_is_followed_where_only_the_user_can_make_it(private):
    real, link, shared = (private / name for name in ("real", "link", "shared"))
    real.mkdir(mode=0o700)
    shared.mkdir()
    shared.chmod(0o1777)
    link.symlink_to(real)
    (shared / "link").symlink_to(real)
    assert folder.refusal(str(link)) == ""
    assert folder.refusal(str(shared / "link")) == f"{str(shared / 'link')!r} is a symbolic link"
    (shared / "own").mkdir(mode=0o700)
    assert folder.refusal(str(shared / "own")) == ""
    real.chmod(0o777)
    assert folder.refusal(str(link)) == f"{str(real)!r} can be changed by all users"
    link.unlink()
    link.symlink_to(link)
    assert folder.refusal(str(link)) == f"{str(link)!r} is a symbolic link"


@posix_only
@pytest.mark.slow
def test_a_command_goes_on_with_another_folder(tmp_path):
    given = tmp_path / "given"
    given.mkdir()
    given.chmod(0o777)
    script = "import evolvent, sys; from evolvent.compiled import laws; sys.stdout.write('ok')"
    environment = {**os.environ, VARIABLE: str(given), "XDG_CACHE_HOME": str(tmp_path / "home")}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment, check=False)
    assert (done.returncode, done.stdout) == (0, "ok")
    assert done.stderr.count("\n") == 1
    assert f"compiled functions are not stored in {str(given)!r}" in done.stderr
    assert f"in {VARIABLE}" in done.stderr
    assert list(given.iterdir()) == []
    assert [path.name for path in (tmp_path / "home" / "evolvent").iterdir()] == [folder.folder_name()]


@posix_only
def test_a_folder_that_cannot_be_written_to_is_read(tmp_path, monkeypatch, home, capsys):
    """It holds functions already; what is compiled afterwards goes into the next folder."""
    own = tmp_path / "mine" / folder.folder_name()
    own.mkdir(parents=True, mode=0o700)
    monkeypatch.setenv(VARIABLE, str(own.parent))
    monkeypatch.setattr(folder, "_found_read_only", [])
    look = os.access
    monkeypatch.setattr(os, "access", lambda path, how: pathlib.Path(path) != own and look(path, how))
    assert folder._find_cache_dir().parent == home
    assert folder._found_read_only == [own]
    assert capsys.readouterr().err == ""


@posix_only
def test_what_the_administrator_made_counts_as_the_users_own(tmp_path, monkeypatch):
    """As in a container, whose functions were compiled as it was built."""
    given = tmp_path / "cache"
    given.mkdir(mode=0o755)
    look = pathlib.Path.lstat

    def lstat(path):
        found = look(path)
        return os.stat_result((*found[:4], 0, *found[5:])) if path == given else found

    monkeypatch.setattr(pathlib.Path, "lstat", lstat)
    monkeypatch.setattr(os, "geteuid", lambda: OTHER)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    assert folder.refusal(str(given)) == ""
    given.chmod(0o777)
    assert "can be changed by all users" in folder.refusal(str(given))
