"""Files whose values lie outside them, or take more memory than they have bytes, are refused in one sentence."""

from __future__ import annotations

import io
import json
import os
import pathlib
import shutil
import struct
import zlib
from collections.abc import Callable

import h5py
import numpy as np
import pytest
import scipy.io

from evolvent import InputError, results
from evolvent.design import studies
from evolvent_base import safe_open, signals

SECRET = b"0123456789abcdef" * 64


def external_storage(file: h5py.File, outside: pathlib.Path) -> None:
    """Values of a data set are the bytes of another file."""
    file.create_dataset("stolen", shape=(128,), dtype="f8", external=[(str(outside), 0, 1024)])


def virtual(file: h5py.File, outside: pathlib.Path) -> None:
    """A data set that is part of one in another file."""
    with h5py.File(outside.with_suffix(".h5"), "w") as other:
        other["x"] = np.arange(5.0)
    layout = h5py.VirtualLayout(shape=(5,), dtype="f8")
    layout[:] = h5py.VirtualSource(str(outside.with_suffix(".h5")), "x", shape=(5,))
    file.create_virtual_dataset("stolen", layout)


def virtual_on_a_pipe(file: h5py.File, outside: pathlib.Path) -> None:
    """A virtual data set of unlimited size, whose shape would be asked of a pipe without an end."""
    os.mkfifo(outside.with_suffix(".pipe"))
    layout = h5py.VirtualLayout(shape=(5,), dtype="f8", maxshape=(None,))
    source = h5py.VirtualSource(str(outside.with_suffix(".pipe")), "x", shape=(5,), maxshape=(None,))
    layout[: h5py.h5s.UNLIMITED] = source[: h5py.h5s.UNLIMITED]
    file.create_virtual_dataset("stolen", layout)


def external_link(file: h5py.File, outside: pathlib.Path) -> None:
    """A name that stands for a data set of another file."""
    with h5py.File(outside.with_suffix(".h5"), "w") as other:
        other["x"] = np.arange(5.0)
    file["stolen"] = h5py.ExternalLink(str(outside.with_suffix(".h5")), "x")


def soft_link(file: h5py.File, outside: pathlib.Path) -> None:
    """A name that stands for one that is not there."""
    file["stolen"] = h5py.SoftLink("/nothing/there")


def soft_link_in_group(file: h5py.File, outside: pathlib.Path) -> None:
    """A name in a group that stands for the group above."""
    file.create_group("inner")["up"] = h5py.SoftLink("/")


def cycle(file: h5py.File, outside: pathlib.Path) -> None:
    """A group that holds itself."""
    inner = file.create_group("inner")
    inner["again"] = inner


def doubling(file: h5py.File, outside: pathlib.Path) -> None:
    """Twenty groups, each with two names for the next one: a million paths."""
    group = file.create_group("inner")
    for _ in range(20):
        below = group.create_group("a")
        group["b"] = below
        group = below


def nested(file: h5py.File, outside: pathlib.Path) -> None:
    """Groups in groups, a thousand levels deep."""
    group = file
    for _ in range(1000):
        group = group.create_group("g")


def declared(file: h5py.File, outside: pathlib.Path) -> None:
    """A data set of 1e12 numbers, none of which is stored."""
    file.create_dataset("bomb", shape=(10**12,), dtype="f8", chunks=(1024,), fillvalue=1.0)


def many_declared(file: h5py.File, outside: pathlib.Path) -> None:
    """Thirty data sets of 1e7 numbers, each below the limit."""
    for k in range(30):
        file.create_dataset(f"bomb {k}", shape=(10**7,), dtype="f8", chunks=(1024,), fillvalue=1.0)


def deflated(file: h5py.File, outside: pathlib.Path) -> None:
    """5e7 zeros, which take a thousandth of their memory in the file."""
    bomb = file.create_dataset("bomb", shape=(5 * 10**7,), dtype="f8", chunks=(10**6,), compression="gzip")
    bomb.id.write_direct_chunk((0,), zlib.compress(bytes(8 * 10**6)))


def great_chunk(file: h5py.File, outside: pathlib.Path) -> None:
    """Few values in a chunk of 4 GB."""
    file.create_dataset("bomb", shape=(3,), maxshape=(None,), dtype="f8", chunks=(5 * 10**8,), fillvalue=1.0)


def long_texts(file: h5py.File, outside: pathlib.Path) -> None:
    """A million texts that are one and the same text of 1 MB in the file."""
    bomb = file.create_dataset("bomb", shape=(1000,), dtype=h5py.string_dtype(), chunks=(1000,))
    bomb[0] = "x" * 10**6
    file.flush()
    raw = bomb.id.read_direct_chunk((0,))[1]
    bomb.id.write_direct_chunk((0,), raw[:16] * 1000)


def plug_in(file: h5py.File, outside: pathlib.Path) -> None:
    """A data set whose filter would be loaded from a folder of plug-ins."""
    layout = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    layout.set_chunk((5,))
    layout.set_filter(32015, h5py.h5z.FLAG_OPTIONAL, (3,))
    h5py.h5d.create(file.id, b"stolen", h5py.h5t.NATIVE_DOUBLE, h5py.h5s.create_simple((5,)), layout)


ATTACKS = {
    external_storage: "takes its values from other files, which are not opened",
    virtual: "takes its values from other files, which are not opened",
    virtual_on_a_pipe: "takes its values from other files, which are not opened",
    external_link: "'/stolen' is a link into another file, which is not followed",
    soft_link: "'/stolen' is a soft link, which is not followed",
    soft_link_in_group: "'/inner/up' is a soft link, which is not followed",
    cycle: "the group '/inner/again' has two parents",
    doubling: "has two parents",
    nested: "its groups are nested more than 32 levels deep",
    declared: "its values would take 8 TB; of a file of",
    many_declared: "its values would take",
    deflated: "its values would take 400 MB",
    great_chunk: "its values would take",
    long_texts: "its values would take",
    plug_in: "is compressed by a plug-in of HDF5, which is not loaded",
}


@pytest.fixture
def outside(tmp_path: pathlib.Path) -> pathlib.Path:
    """A file of the user that no other file may give away."""
    path = tmp_path / "private" / "key"
    path.parent.mkdir()
    path.write_bytes(SECRET)
    return path


def hdf5(path: pathlib.Path, attack: Callable[[h5py.File, pathlib.Path], None], outside: pathlib.Path) -> pathlib.Path:
    """A recording with an attack in it."""
    with h5py.File(path, "w", libver="latest", userblock_size=512 if path.suffix == ".mat" else 0) as file:
        file["left"], file["right"] = np.sin(np.arange(50.0)), np.cos(np.arange(50.0))
        attack(file, outside)
    if path.suffix == ".mat":
        with path.open("r+b") as raw:
            raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    return path


@pytest.mark.slow
@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.__name__)
@pytest.mark.parametrize("name", ["knock.h5", "knock.mat"])
def test_a_recording_cannot_reach_other_files(
    attack: Callable[[h5py.File, pathlib.Path], None], name: str, outside: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    path = hdf5(tmp_path / name, attack, outside)
    with pytest.raises(InputError) as refused:
        signals.read(path)
    assert ATTACKS[attack] in str(refused.value)
    assert str(path) in str(refused.value)


@pytest.mark.slow
@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.__name__)
def test_a_run_cannot_reach_other_files(
    attack: Callable[[h5py.File, pathlib.Path], None], outside: pathlib.Path, run_copy: pathlib.Path
) -> None:
    with h5py.File(run_copy, "r+", libver="latest") as file:
        attack(file, outside)
    for read in (results.open, signals.read):
        with pytest.raises(InputError) as refused:
            read(run_copy)
        assert ATTACKS[attack] in str(refused.value)


@pytest.mark.parametrize(
    "words",
    [
        ("info", "run.nc"),
        ("plot", "run.nc"),
        ("report", "run.nc", "-o", "report.html"),
        ("export", "run.nc", "--to", "csv"),
        ("identify", "run.nc", "--variables", "body_rate"),
        ("run", "wrapped-rib-deploy", "--set", "start=run.nc", "--no-figures"),
        ("calibrate", "heliogyro", "run.nc", "--fit", "blade.stiffness", "--observe", "body_rate"),
    ],
    ids=lambda words: words[0],
)
def test_no_command_opens_such_a_run(words, call, outside, whole_run, tmp_path) -> None:
    shutil.copy(whole_run, tmp_path / "run.nc")
    with h5py.File(tmp_path / "run.nc", "r+") as file:
        external_storage(file, outside)
    code, out, err = call(*words)
    assert code == 2
    assert out == ""
    assert err.count("\n") == 1
    assert "takes its values from other files" in err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["private", "run.nc"]


def test_whole_files_pass(whole_run: pathlib.Path, structure_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    """What evolvent and others write: groups, texts, named types, compressed chunks, a data set of two names."""
    for path in (whole_run, structure_run):
        results.open(path)
    with h5py.File(tmp_path / "knock.h5", "w") as file:
        file.create_dataset("left", data=np.sin(np.arange(5e5)), compression="gzip", shuffle=True, fletcher32=True)
        file["again"] = file["left"]
        file["type"] = np.dtype("f8")
        file["words"] = ["a", "long one"]
        file.attrs["names"] = ["a", "b"]
        file.create_group("inner").attrs["units"] = "mm"
        file["nothing"] = h5py.Empty("f8")
        file["reference"] = file["left"].ref
        file.create_dataset("few", data=np.arange(3.0), track_order=True)
        del file["few"]
    assert signals.read(tmp_path / "knock.h5").names == ("again",)


def test_the_largest_file_is_a_setting(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with h5py.File(tmp_path / "long.h5", "w") as file:
        file["left"] = np.zeros(20_000)
    monkeypatch.setenv(safe_open.VARIABLE, "100e3")
    with pytest.raises(
        InputError, match=r"it has 162 kB; at most 100 kB are read \(EVOLVENT_LARGEST_FILE raises this\)"
    ):
        signals.read(tmp_path / "long.h5")
    monkeypatch.setenv(safe_open.VARIABLE, "200e3")
    assert signals.read(tmp_path / "long.h5").data.size == 20_000
    monkeypatch.setenv(safe_open.VARIABLE, "much")
    with pytest.raises(InputError, match="EVOLVENT_LARGEST_FILE is 'much'; it must be a number of bytes"):
        signals.read(tmp_path / "long.h5")


@pytest.mark.parametrize("name", ["knock.csv", "run.nc", "case.yaml", "knock.mat", "knock.uff"])
def test_pipes_and_devices_are_not_read(name: str, call, tmp_path: pathlib.Path) -> None:
    """They have no end."""
    os.mkfifo(tmp_path / name)
    words = {".yaml": ("run", f"./{name}"), ".nc": ("info", name)}.get(pathlib.Path(name).suffix, ("identify", name))
    assert call(*words)[::2] == (2, f"evolvent: cannot read {words[1]!r}: it is not a regular file\n")


# ------------------------------------------------------------------------------------------------ MAT, version 5


@pytest.mark.slow
def test_a_mat_file_that_grows_a_thousand_times_is_refused(tmp_path: pathlib.Path) -> None:
    stream = io.BytesIO()
    scipy.io.savemat(stream, {"left": np.sin(np.arange(50.0))}, do_compression=True)
    head = stream.getvalue()[:128]
    machine = zlib.compressobj(9)
    tag, zeros = (  # after a full flush, a block can be repeated
        machine.compress(data) + machine.flush(zlib.Z_FULL_FLUSH)
        for data in (struct.pack("<II", 14, 3 * 10**8), bytes(10**6))
    )
    content = tag + 300 * zeros + machine.flush()
    (tmp_path / "knock.mat").write_bytes(head + struct.pack("<II", 15, len(content)) + content)
    with pytest.raises(InputError, match=r"its values would take .* MB; of a file of 297 kB 256 MB are read at most"):
        signals.read(tmp_path / "knock.mat")
    (tmp_path / "whole.mat").write_bytes(stream.getvalue())
    assert signals.read(tmp_path / "whole.mat").data.size == 50


# ------------------------------------------------------------------------------------------------ Zarr


def chunk_link(store: pathlib.Path, outside: pathlib.Path) -> None:
    chunk = store / "tip_lag" / "0.0.0"
    chunk.unlink()
    chunk.symlink_to(outside)


def folder_link(store: pathlib.Path, outside: pathlib.Path) -> None:
    shutil.move(store / "tip_lag", outside.parent / "tip_lag")
    (store / "tip_lag").symlink_to(outside.parent / "tip_lag")


def metadata_link(store: pathlib.Path, outside: pathlib.Path) -> None:
    shutil.move(store / ".zmetadata", outside.parent / "metadata")
    (store / ".zmetadata").symlink_to(outside.parent / "metadata")


def change(store: pathlib.Path, array: str, **entries: object) -> None:
    """Change the metadata of an array in both places."""
    whole, own = store / ".zmetadata", store / array / ".zarray"
    metadata = json.loads(whole.read_text())
    metadata["metadata"][f"{array}/.zarray"] |= entries
    whole.write_text(json.dumps(metadata))
    own.write_text(json.dumps(json.loads(own.read_text()) | entries))


def outer_key(store: pathlib.Path, outside: pathlib.Path) -> None:
    whole = store / ".zmetadata"
    metadata = json.loads(whole.read_text())
    array = {"shape": [128], "chunks": [128], "dtype": "<f8", "compressor": None, "filters": None, "order": "C",
             "fill_value": 0, "zarr_format": 2}  # fmt: skip
    metadata["metadata"]["../../private/.zarray"] = array
    whole.write_text(json.dumps(metadata))


def pickled(store: pathlib.Path, outside: pathlib.Path) -> None:
    change(store, "tip_lag", dtype="|O", filters=[{"id": "pickle"}])


def objects(store: pathlib.Path, outside: pathlib.Path) -> None:
    change(store, "tip_lag", dtype="|O", filters=None)


def great_shape(store: pathlib.Path, outside: pathlib.Path) -> None:
    change(store, "tip_lag", shape=[2, 10**12, 2])


def one_great_chunk(store: pathlib.Path, outside: pathlib.Path) -> None:
    change(store, "tip_lag", shape=[2, 10**12, 2], chunks=[2, 10**12, 2])


def lost_chunk(store: pathlib.Path, outside: pathlib.Path) -> None:
    (store / "tip_lag" / "0.0.0").unlink()


def references(store: pathlib.Path, outside: pathlib.Path) -> None:
    (store / "references.json").write_text(json.dumps({"version": 1, "refs": {"x/0": [f"file://{outside}"]}}))


def pipe(store: pathlib.Path, outside: pathlib.Path) -> None:
    lost_chunk(store, outside)
    os.mkfifo(store / "tip_lag" / "0.0.0")


STORES = {
    chunk_link: "'tip_lag/0.0.0' is a link; a store must hold all its values",
    folder_link: "'tip_lag' is a link",
    metadata_link: "'.zmetadata' is missing or damaged",
    outer_key: "its metadata name '../../private/.zarray', which is no file of the store",
    pickled: "the array 'tip_lag' has the codec 'pickle', which is not allowed",
    objects: "the array 'tip_lag' is not one of numbers or texts in chunks",
    great_shape: "the array 'tip_lag' has more than 100000 chunks",
    one_great_chunk: "its values would take 32 TB",
    lost_chunk: "'tip_lag/0.0.0' is missing",
    references: "'references.json' belongs to no array",
    pipe: "'tip_lag/0.0.0' is no regular file",
}


@pytest.mark.parametrize("attack", STORES, ids=lambda attack: attack.__name__)
def test_a_study_cannot_reach_other_files(
    attack: Callable[[pathlib.Path, pathlib.Path], None], outside: pathlib.Path, study_copy: pathlib.Path
) -> None:
    studies.open(study_copy)
    attack(study_copy / "results.zarr", outside)
    with pytest.raises(InputError) as refused:
        studies.open(study_copy)
    assert STORES[attack] in str(refused.value)
    assert "remove it and sweep the study again" in str(refused.value)
