"""Thousands of seeded mutations of all that the package reads: no traceback, no hang, no silently wrong result.

``EVOLVENT_HOSTILE=N`` asks for N mutations in all; a failure names the seed of each that went wrong, and
``EVOLVENT_HOSTILE_SEED`` the first seed.
"""

from __future__ import annotations

import functools
import io
import json
import os
import pathlib
import random
import shutil
import warnings
from collections.abc import Callable
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
import yaml

from evolvent import cases, parts, results
from evolvent.analysis.system import System
from evolvent.assembly import expressions, references
from evolvent.design import studies
from evolvent.design.calibration import data as calibration_data
from evolvent.design.studies import store
from evolvent_base import signals, units
from evolvent_base.errors import InputError
from evolvent_base.signals import timebase
from evolvent_massprops import description, uncertain
from security import mutations

#: Mutations in all, and the first seed.
COUNT = int(os.environ.get("EVOLVENT_HOSTILE", "2000"))
FIRST = int(os.environ.get("EVOLVENT_HOSTILE_SEED", "0"))
EXAMPLES = pathlib.Path(__file__).parents[2] / "examples"
CASES = ("heliogyro", "film-blade", "inertia-stand", "wrapped-rib", "wire-booms", "two-booms", "yo-yo-despin")

pytestmark = pytest.mark.filterwarnings("ignore")


def every(share: float) -> range:
    """Seeds of a share of all mutations."""
    return range(FIRST, FIRST + max(1, round(share * COUNT)))


def check(share: float, one: Callable[[random.Random], str]) -> None:
    """Try a share of the mutations; `one` says what is wrong with the one that it makes."""
    wrong = []
    for seed in every(share):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = one(random.Random(seed))
        if found:
            wrong.append(f"seed {seed}: {found}")
    assert not wrong, "\n".join([f"{len(wrong)} of {len(every(share))}", *wrong[:30]])


# ------------------------------------------------------------------------------------------------ cases


def check_case(found: Any) -> str:
    """A case that was accepted is finite, and the same after it was written and read again."""
    if found is None:
        return ""
    wrong = mutations.not_finite(found.model_dump())
    if wrong:
        return f"{wrong} are not finite"
    again = cases.load(cases.parse_yaml(cases.to_yaml(found), "again"))
    return "" if again.model_dump() == found.model_dump() else "its text gives another case"


@pytest.mark.slow
def test_texts_of_cases(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "case.yaml"

    def one(random_: random.Random) -> str:
        text = mutations.changed_text(cases.text(random_.choice(CASES)), random_)
        path.write_bytes(text.encode("utf-8", "replace"))
        found, wrong = mutations.judged(lambda: cases.load(path))
        return wrong or check_case(found)

    check(0.1, one)


def test_values_of_cases() -> None:
    contents = {name: cases.content_of(name) for name in CASES}

    def one(random_: random.Random) -> str:
        name = random_.choice(CASES)
        content = mutations.changed_values(contents[name], random_)
        found, wrong = mutations.judged(lambda: cases.load(content))
        return wrong or check_case(found)

    check(0.22, one)


def test_assignments_are_reflected() -> None:
    """What --set changes is what the case then holds, or it is refused."""
    name = "heliogyro"
    before = cases.load(name).model_dump()
    keys = [".".join(path) for path in mutations.leaves(before) if all(isinstance(key, str) for key in path)]

    def one(random_: random.Random) -> str:
        key = random_.choice(keys)
        value = random_.choice((*mutations.HOSTILE, random_.uniform(0.1, 3.0), random_.uniform(2.0, 9.0)))
        found, wrong = mutations.judged(lambda: cases.load(name, {key: value}))
        if wrong or found is None:
            return wrong
        held: Any = found.model_dump()
        for part in key.split("."):
            held = held[part]
        if isinstance(value, float) and not isinstance(held, (dict, list, tuple)) and held != value:
            return f"{key} was set to {value!r} and is {held!r}"
        return check_case(found)

    check(0.11, one)


def test_plans_of_changed_cases() -> None:
    """Cases that were accepted are assembled, or refused then."""
    content = cases.content_of("yo-yo-despin")

    def one(random_: random.Random) -> str:
        changed = mutations.changed_values(content, random_)

        def plan() -> Any:
            case = cases.load(changed)
            return cases.system(case.system).plan(case)

        return mutations.judged(plan)[1]

    check(0.04, one)


# ------------------------------------------------------------------------------------------------ signals


def recordings(folder: pathlib.Path) -> dict[str, bytes]:
    """A recording in every format, name -> bytes."""
    t = np.arange(60) / 50.0
    x = np.column_stack([np.cos(14.0 * t), np.sin(9.0 * t)])
    rows = "".join(f"{a:.4f},{b:.6f},{c:.6f}\n" for a, (b, c) in zip(t, x, strict=True))
    found = {"a.csv": ("time (s),left (mm),right (mm)\n" + rows).encode()}
    found["b.tsv"] = ("# by hand\ntime\tleft\ns\tmm\n" + rows.replace(",", "\t")).encode()
    found["c.csv"] = ("t;A [mm];B [mm]\n" + rows.replace(",", ";").replace(".", ",")).encode()
    for version, compressed in (("4", False), ("5", False), ("5", True)):
        stream = io.BytesIO()
        scipy.io.savemat(stream, {"x": x, "fs": 50.0}, format=version, do_compression=compressed)
        found[f"{version}{compressed}.mat"] = stream.getvalue()
    out = {"time": t, "signals": {"values": x, "label": "left"}, "names": np.array(["a", "b"], dtype=object)}
    scipy.io.savemat(stream := io.BytesIO(), {"out": out})
    found["struct.mat"] = stream.getvalue()
    with h5py.File(folder / "d.h5", "w") as file:
        file.create_dataset("left", data=x[:, 0], chunks=(20,), compression="gzip")
        file["right"] = x[:, 1]
        file.attrs["fs"] = 50.0
        file["table"] = np.rec.fromarrays([t, x[:, 0]], names="time,left")
    found["d.h5"] = (folder / "d.h5").read_bytes()
    for kind in ("float32", "int16"):
        scipy.io.wavfile.write(folder / "e.wav", 50, (0.5 * x * (32000 if kind == "int16" else 1)).astype(kind))
        found[f"{kind}.wav"] = (folder / "e.wav").read_bytes()
    try:
        import nptdms
        import pyuff
    except ImportError:
        return found
    with nptdms.TdmsWriter(str(folder / "f.tdms")) as writer:
        channels = [nptdms.ChannelObject("rig", name, x[:, k], {"wf_increment": 0.02}) for k, name in enumerate("ab")]
        writer.write_segment(channels)
    found["f.tdms"] = (folder / "f.tdms").read_bytes()
    sets = [
        pyuff.prepare_58(
            binary=binary, func_type=1, rsp_node=k + 1, rsp_dir=1, ref_dir=1, ref_node=1, data=x[:, k], x=t,
            id1="knock", rsp_ent_name="NONE", ref_ent_name="NONE", abscissa_spacing=1, abscissa_spec_data_type=17,
            ordinate_spec_data_type=8, orddenom_spec_data_type=0,
        )
        for k, binary in ((0, 0), (1, 0))
    ]  # fmt: skip
    pyuff.UFF(str(folder / "g.uff")).write_sets(sets, mode="overwrite")
    found["g.uff"] = (folder / "g.uff").read_bytes()
    for one in sets:  # pyuff overwrites heads of binary sets as well
        pyuff.UFF(str(folder / "h.uff"))._write_set(one | {"binary": 1}, "add")
    found["h.uff"] = (folder / "h.uff").read_bytes()
    return found


@pytest.mark.slow
def test_recordings(tmp_path: pathlib.Path) -> None:
    known = recordings(tmp_path)

    def one(random_: random.Random) -> str:
        name = random_.choice(sorted(known))
        raw = known[name]
        is_text = name.endswith((".csv", ".tsv", "g.uff"))
        if is_text and random_.random() < 0.7:
            raw = mutations.changed_text(raw.decode(), random_).encode("utf-8", "replace")
        else:
            raw = mutations.changed_bytes(raw, random_)
        path = tmp_path / name
        path.write_bytes(raw)
        found, wrong = mutations.judged(lambda: signals.read(path))
        if found is None:
            return f"{name}: {wrong}" if wrong else ""
        if len(set(found.names)) != len(found.names):
            return f"{name}: columns of equal names"
        if any(one.rate is not None and not 0.0 < one.rate < np.inf for one in found.columns):
            return f"{name}: rates of {[one.rate for one in found.columns]}"
        for column in found.names:
            values, wrong = mutations.judged(functools.partial(found.column, column))
            if wrong or (values is not None and (np.isinf(values).any() or values.ndim != 1)):
                return f"{name}: {wrong or 'an infinite sample'}"
        chosen, wrong = mutations.judged(functools.partial(timebase.choose, found, (), time=None, rate=None))
        return f"{name}: {wrong}" if wrong and not chosen else ""

    check(0.23, one)


def test_units_and_expressions() -> None:
    """Texts of values, references and expressions, put together from what means something to their readers."""
    pieces = (
        "1", "9", "-", "+", ".", "e", "1e9", " ", "  ", "m", "kg", "s", "rad", "*", "**", "^", "/", "(", ")", "²", "⁹",
        "%", "squared", "cubed", "per", "max(", "min(", "where(", "t < 1", ",", "x", "hub", "[5]", "boom.tip",
        "unknown near ", "+-", "±", "\u202e", "[", "]",
    )  # fmt: skip

    def one(random_: random.Random) -> str:
        text = "".join(random_.choices(pieces, k=random_.choice((2, 4, 8, 30)))) * random_.choice((1, 1, 1, 100))
        readers: tuple[Callable[[], Any], ...] = (
            lambda: units.parse(text, "m"),
            lambda: expressions.compile_expression(text, ["x", "t"]),
            lambda: references.split_reference(text),
            lambda: uncertain.Position.__metadata__[0].read(text),
            lambda: cases.parse_yaml(text, "text"),
        )
        for reader in readers:
            wrong = mutations.judged(reader)[1]
            if wrong and not wrong.startswith(("UnitError", "PydanticCustomError")):
                return f"{text[:60]!r}: {wrong}"
        return ""

    check(0.06, one)


def test_stands() -> None:
    content = yaml.safe_load((EXAMPLES / "stand.yaml").read_text(encoding="utf-8"))
    unknown = mutations.not_finite(description.load(content).model_dump())  # what is to be found

    def one(random_: random.Random) -> str:
        changed = mutations.changed_values(content, random_)
        found, wrong = mutations.judged(lambda: description.load(changed))
        extra = set() if found is None else mutations.not_finite(found.model_dump()) - unknown
        return wrong or (f"{extra} are not finite" if extra else "")

    check(0.08, one)


def test_texts_of_stands(tmp_path: pathlib.Path) -> None:
    text, path = (EXAMPLES / "stand.yaml").read_text(encoding="utf-8"), tmp_path / "stand.yaml"

    def one(random_: random.Random) -> str:
        path.write_bytes(mutations.changed_text(text, random_).encode("utf-8", "replace"))
        return mutations.judged(lambda: description.load(path))[1]

    check(0.05, one)


def test_tables_and_logs_of_calibrations(tmp_path: pathlib.Path) -> None:
    log = pathlib.Path(cases.system("wire-booms").data_files["rbsp-a.csv"]).read_text(encoding="utf-8")
    log = "".join(log.splitlines(keepends=True)[:8])
    history = "time (s),spin (rad/s)\n" + "".join(f"{k / 10},{6.0 - k / 10}\n" for k in range(10))
    runs = "blade.length (m),spin (rad/s)\n" + "".join(f"{k},{6.0 - k / 10}\n" for k in range(1, 6))
    known = (
        ("wire-booms", log, ["spin_rate"]),
        ("heliogyro", history, ["body_rate=spin"]),
        ("heliogyro", runs, ["body_rate.last=spin"]),
    )
    path = tmp_path / "data.csv"

    def one(random_: random.Random) -> str:
        case, text, observed = random_.choice(known)
        path.write_bytes(mutations.changed_text(text, random_).encode("utf-8", "replace"))
        found, wrong = mutations.judged(lambda: calibration_data.read(str(path), case, observed))
        if found is None:
            return wrong
        return "" if all(np.all(np.isfinite(s.values)) for s in found.series) else "a value that is not finite"

    check(0.05, one)


# ------------------------------------------------------------------------------------------------ runs


@pytest.fixture(scope="module")
def small_run(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A run of one body, as bytes."""
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.1, 1.2), velocity=(0.1, 0.0, 1.0)), "body")
    path = tmp_path_factory.mktemp("small") / "run.nc"
    results.save(system.simulate(until=0.5, every=0.1), path)
    return path.read_bytes()


def change_run(path: pathlib.Path, random_: random.Random) -> str:
    """Change a variable or an attribute of a run; returns what was changed."""
    with h5py.File(path, "r+") as file:
        names: list[str] = []
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        name = random_.choice(names)
        holder = random_.choice((file, file[name], file[name].parent))
        own = [key for key in holder.attrs if key not in ("DIMENSION_LIST", "REFERENCE_LIST", "CLASS", "NAME")]
        key, how = random_.choice(own or ["none"]), random_.randrange(6)
        if how == 0:
            del file[name]
        elif how == 1 and file[name].dtype.kind in "fi" and file[name].size:
            place = tuple(random_.randrange(n) for n in file[name].shape)
            file[name][place] = random_.choice((np.nan, np.inf, 7.25, -1e300)) if file[name].dtype.kind == "f" else 77
        elif how == 2 and key in holder.attrs:
            del holder.attrs[key]
        elif how == 3 and key in holder.attrs:
            value = random_.choice(("", "x", "{}", "[]", "null", "x" * 50_000, 3.5, np.arange(3), "[1, 2", '{"a": 1}'))
            del holder.attrs[key]
            holder.attrs[key] = value
        elif how == 4:
            shape, kind = file[name].shape, random_.choice(("f4", "i8", "S3", "f8"))
            del file[name]
            file.create_dataset(name, data=np.zeros(random_.choice((shape, (), (3,), (0,), (2, 3))), dtype=kind))
        else:
            text = str(holder.attrs.get(key, ""))
            if key in holder.attrs and text:
                del holder.attrs[key]
                changed = mutations.changed_text(text, random_).encode("utf-8", "replace").decode()
                holder.attrs[key] = changed.replace("\0", "")
        return f"{how} {name} {key}"


#: Values in JSON that an attribute may not hold.
NESTED = (
    "[" * 900 + "]" * 900, '{"a": ' * 500 + "1" + "}" * 500, '{"x": {"y": [1]}}', '[{"line": {}}]', '["x"]', "[[1]]",
    '[{"symbol": {"body": "nobody"}}]', '[{"frame": 5}]', '[{"marks": {"points": ["x"]}}]', '{"steps": "x"}',
)  # fmt: skip


def change_groups(path: pathlib.Path, random_: random.Random) -> str:
    """Change an attribute in JSON, the groups or the dimensions of a run of parts; returns what was changed."""
    with h5py.File(path, "r+") as file:
        groups = [name for name, item in file.items() if isinstance(item, h5py.Group)]
        one, other = random_.sample(groups, 2)
        how = random_.randrange(7)
        if how < 2:
            holder = random_.choice((file, file[one]))
            key = random_.choice(("laws", "statistics", "variables", "parts", "drawn", "plots", "title", "kind"))
            holder.attrs[key] = value = random_.choice((*NESTED, "", "x\x1b[2J", "=1+1", "\u202e", 5))
            return f"{how} {holder.name} {key} {value!s:.40}"
        if how == 2:
            file.move(one, "moved")
            file.move(other, one)
            file.move("moved", other)
        elif how == 3:
            file.copy(one, random_.choice(("copy", f"{other}/inner")))
        elif how == 4:
            del file[other]
            file.copy(one, other)
        elif how == 5:
            file[random_.choice((f"{one}.rate", "a[1]", "x y"))] = np.zeros(random_.choice(((), 3, (2, 3))))
        else:
            names = [name for name, item in file[one].items() if "DIMENSION_LIST" in item.attrs]
            name = random_.choice(names)
            del file[one][name].attrs["DIMENSION_LIST"]
            if random_.random() < 0.7:
                file[one][name].attrs["DIMENSION_LIST"] = random_.choice((5, np.zeros(2), "x"))
    return f"{how} {one} {other}"


@pytest.mark.slow
def test_runs_of_parts(structure_run: pathlib.Path, tmp_path: pathlib.Path, call: Any) -> None:
    """A run of several parts that was altered is refused, or opened with a warning and shown."""
    path = tmp_path / "run.nc"
    commands = (("info", "run.nc"), ("export", "run.nc", "--to", "csv", "-o", "csv"))

    def one(random_: random.Random) -> str:
        shutil.copy(structure_run, path)
        what, words = change_groups(path, random_), random_.choice(commands)
        found, wrong = mutations.judged(lambda: results.open(path))
        if wrong or found is None:
            return f"{what}: {wrong}" if wrong else ""
        if "altered" not in found.attrs.get("warning", ""):
            return f"{what}: altered, and no warning"
        if random_.random() < 0.7:  # the commands take longer than all else
            return ""
        ended, wrong = mutations.judged(lambda: call(*words))
        if ended is None:
            return f"{what}: {words}: {wrong}"
        code, _, err = ended
        return "" if code in (0, 2) and err.count("\n") == (code == 2) else f"{what}: {words}: code {code}, {err[:200]}"

    check(0.005, one)


@pytest.mark.slow
def test_runs(small_run: bytes, tmp_path: pathlib.Path) -> None:
    """A run that is read is the one that was written, or its warning says that it was altered."""
    path = tmp_path / "run.nc"
    path.write_bytes(small_run)
    whole = results.open(path)

    def one(random_: random.Random) -> str:
        path.write_bytes(small_run)
        what = "bytes"
        if random_.random() < 0.3:
            path.write_bytes(mutations.changed_bytes(small_run, random_))
        else:
            what = change_run(path, random_)
        found, wrong = mutations.judged(lambda: results.open(path))
        if found is None:
            return f"{what}: {wrong}" if wrong else ""
        altered = "altered" in found.attrs.get("warning", "")
        return "" if altered or found.identical(whole) else f"{what}: altered, and no warning"

    check(0.015, one)


@pytest.mark.slow
def test_commands_on_altered_runs(small_run: bytes, tmp_path: pathlib.Path, call: Any) -> None:
    commands = (("info", "run.nc"), ("export", "run.nc", "--to", "csv", "-o", "csv"), ("report", "run.nc"))

    def one(random_: random.Random) -> str:
        (tmp_path / "run.nc").write_bytes(small_run)
        what, words = change_run(tmp_path / "run.nc", random_), random_.choice(commands)
        found, wrong = mutations.judged(lambda: call(*words))
        if found is None:
            return f"{what}: {words}: {wrong}"
        code, _, err = found
        well = code in (0, 2) and err.count("\n") == (code == 2) and len(err) < mutations.LONGEST
        return "" if well else f"{what}: {words}: code {code}, {err[:200]}"

    check(0.005, one)


# ------------------------------------------------------------------------------------------------ studies


def change_study(folder: pathlib.Path, random_: random.Random) -> str:
    """Damage a file of a study; returns which and how."""
    files = sorted(p for p in folder.rglob("*") if p.is_file() and p.name != "lock")
    path, how = random_.choice(files), random_.randrange(6)
    raw = path.read_bytes()
    if how == 0:
        path.unlink()
    elif how == 1:
        path.write_bytes(raw + raw)
    elif how == 2:
        path.write_bytes(raw[: random_.randrange(len(raw) + 1)])
    elif how == 3:
        path.write_bytes(b"")
    elif path.suffix == ".json" or path.name.startswith(".z"):
        path.write_text(json.dumps(mutations.changed_values(json.loads(raw), random_)))
    else:
        path.write_bytes(mutations.changed_bytes(raw, random_))
    return f"{how} {path.relative_to(folder)}"


@pytest.mark.slow
def test_studies(whole_study: pathlib.Path, tmp_path: pathlib.Path) -> None:
    """Results that are read are those that were written; a sweep of the same study gives them again, or is refused."""
    whole = studies.open(whole_study)
    study = studies.read(whole_study / "study.yaml")
    folder = tmp_path / "study"

    def continued() -> Any:
        with store.opened(folder, study) as found:
            return found.done if found.done >= study.count else None

    def one(random_: random.Random) -> str:
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(whole_study, folder)
        what = change_study(folder, random_)
        found, wrong = mutations.judged(lambda: studies.open(folder))
        if found is not None and not found.identical(whole):
            wrong = "other results"
        done, wrong = (None, wrong) if wrong else mutations.judged(continued)
        if done not in (None, study.count):
            wrong = f"{done} of {study.count} cases are done"
        return f"{what}: {wrong}" if wrong else ""

    check(0.03, one)


# ------------------------------------------------------------------------------------------------ single attacks


@pytest.mark.slow
def test_aliases_and_depths_of_yaml(tmp_path: pathlib.Path, call: Any) -> None:
    """A billion laughs, a text that holds itself, ten thousand brackets, a great file: one sentence each."""
    laughs = "a: &a [x, x, x, x, x, x, x, x, x, x]\n"
    for k in range(9):
        laughs += f"{chr(98 + k)}: &{chr(98 + k)} [{', '.join([f'*{chr(97 + k)}'] * 10)}]\n"
    texts = {
        "laughs": laughs,
        "itself": "a: &a [*a]\n",
        "deep": f"system: {'[' * 10_000}{']' * 10_000}\n",
        "deep mappings": "".join(f"{' ' * k}a:\n" for k in range(1000)),
        "python": "system: !!python/object/apply:os.system ['touch hacked']\n",
        "great": "a: 1\n" + "# comment\n" * 600_000,
        "long": f"system: heliogyro\n{'x' * 100_000}: 1\n",
        "long value": f"system: heliogyro\nbody: {{rate: '{'1' * 100_000}'}}\n",
        "integer": f"system: heliogyro\nblade: {{nodes: {10**400}}}\n",
        "many": "system: heliogyro\nblade: {nodes: 1000000000000000000}\n",
    }
    for name, text in texts.items():
        (tmp_path / "case.yaml").write_text(text)
        for words in (("show", "./case.yaml"), ("run", "./case.yaml", "--no-figures")):
            found, wrong = mutations.judged(lambda words=words: call(*words))
            assert not wrong, f"{name}: {wrong}"
            code, _, err = found
            assert code == 2, name
            assert err.count("\n") == 1, name
            assert len(err) < mutations.LONGEST, f"{name}: {err[:300]}"
            assert ("nested more than 100 levels deep" in err) == name.startswith("deep"), name
    assert not (tmp_path / "hacked").exists()


@pytest.mark.parametrize("name", ["cases.sqlite", "hashes", "cases", "study"])
def test_named_damages_of_studies(name: str, study_copy: pathlib.Path) -> None:
    study = studies.read(study_copy / "study.yaml")
    if name == "cases.sqlite":
        path = study_copy / name
        path.write_bytes(2 * path.read_bytes())
        with store.opened(study_copy, study) as found:
            assert found.done == study.count
        return
    path = study_copy / "study.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {name: None}))
    with pytest.raises(InputError, match=r"study\.json': it does not describe a study"):
        studies.sweep(study, output=study_copy, workers=1)
    with pytest.raises(InputError, match=r"study\.json': it does not describe a study"):
        studies.open(study_copy)
