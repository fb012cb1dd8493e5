"""Recordings that are damaged, crafted or oversized: refused in one sentence that names the file, within bounded memory."""

import io
import json
import struct
import tracemalloc
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from mechanism_zoo import fourbar

from mechlab.errors import MechlabError
from mechlab.experiment.recording import Finding, Health, Recording
from mechlab.formats import load_recording, save_recording

N = 5
NAN, INF = float("nan"), float("inf")


def run():
    t = np.linspace(0.0, 1.0, N)
    q = np.outer(t, [1.0, 2.0, 3.0])
    return Recording(
        fourbar(), t, q, 2.0 * q, {"crank": q[:, 0], "rocker": q[:, 1]}, {"crank": "rad"}, errors={"crank": 1e-6},
        health=Health((Finding("loop_gap", 1e-9, 1e-6, "m", "ok", "closed"),)), scene="test",
    )  # fmt: skip


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    return save_recording(run(), tmp_path_factory.mktemp("good") / "run.npz")


def npy(array):
    out = io.BytesIO()
    np.lib.format.write_array(out, np.asarray(array))
    return out.getvalue()


def crafted(good, path, header=None, arrays=None, entries=None):
    """The good recording with a changed header (a function of the dict, or a text), arrays (None: left out), or raw
    entries, written as a sound zip."""
    with zipfile.ZipFile(good) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    if header is not None:
        text = header
        if callable(header):
            data = json.loads(str(np.load(io.BytesIO(content["header.npy"]))))
            header(data)
            text = json.dumps(data)
        content["header.npy"] = npy(np.array(text))
    for name, array in (arrays or {}).items():
        if array is None:
            del content[f"{name}.npy"]
        else:
            content[f"{name}.npy"] = npy(array)
    content |= entries or {}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, raw in content.items():
            archive.writestr(name, raw)
    return path


def put(*keys, value):
    def change(data):
        for key in keys[:-1]:
            data = data[key]
        data[keys[-1]] = value

    return change


def drop(*keys):
    def change(data):
        for key in keys[:-1]:
            data = data[key]
        del data[keys[-1]]

    return change


T, Q = np.linspace(0.0, 1.0, N), np.zeros((N, 3))
HEADERS = {
    "no json": ("{", "not JSON"),
    "a list": ("[]", "expected a JSON object"),
    "nested": ("[" * 60_000, "nested too deeply"),
    "nothing": ("{}", "schema None"),
    "a digit too many": ('{"schema": 1' + "0" * 5000 + "}", "header"),
    "a key twice": ('{"schema": 1, "schema": 1}', "twice"),
    "half a surrogate pair": (put("scene", value="\ud800"), "no character"),
    "schema 99": (put("schema", value=99), "schema 99; this version of mechlab reads schema 1"),
    "schema true": (put("schema", value=True), "schema True"),
    "no schema": (drop("schema"), "schema None"),
    "another key": (put("extra", value=1), "'extra' does not exist"),
    "no mechanism": (drop("mechanism"), "lacks mechanism"),
    "mechanism a text": (put("mechanism", value="fourbar"), "mechanism: expected an object"),
    "mechanism without bodies": (drop("mechanism", "bodies"), "bodies is missing"),
    "mechanism of schema 7": (put("mechanism", "schema", value=7), "schema 7"),
    "mechanism with a NaN": (put("mechanism", "gravity", value=[0, 0, NAN]), "NaN"),
    "mechanism with 400 digits": (put("mechanism", "gravity", value=[0, 0, 10**400]), "outside the range of a double"),
    "scene a number": (put("scene", value=3), "scene: expected a text"),
    "parameters a list": (put("parameters", value=[]), "parameters: expected an object"),
    "settings a text": (put("settings", value="fast"), "settings: expected an object"),
    "engine unknown": (put("settings", "engine", value="warp"), "'warp' does not exist"),
    "timestep a text": (put("settings", "timestep", value="1 ms"), "timestep: expected a number"),
    "timestep zero": (put("settings", "timestep", value=0.0), "timestep"),
    "tolerance a NaN": (put("settings", "tolerance", value=NAN), "tolerance: expected a finite number"),
    "setting unknown": (put("settings", "warp", value=9), "'warp' does not exist"),
    "cost a number": (put("cost", value=3), "cost: expected an object"),
    "steps a fraction": (put("cost", "steps", value=0.5), "steps: expected a whole number"),
    "units a list": (put("units", value=["rad"]), "units: expected an object"),
    "a unit a number": (put("units", "crank", value=1), "units: crank: expected a text"),
    "versions a text": (put("versions", value="1.0"), "versions: expected an object"),
    "channels a text": (put("channels", value="crank"), "channels: expected a list"),
    "a channel twice": (put("channels", value=["crank", "crank"]), "there twice"),
    "a channel too many": (put("channels", value=["crank", "rocker", "third"]), r"channels: expected the shape \(3, 5\)"),
    "health an object": (put("health", value={}), "health: expected a list"),
    "a finding a text": (put("health", 0, value="fine"), r"health\[0\]: expected an object"),
    "severity unknown": (put("health", 0, "severity", value="fine"), "severity 'fine' does not exist"),
    "a finding without a limit": (drop("health", 0, "limit"), "limit is missing"),
    "a finding with a text for a number": (put("health", 0, "value", value="1"), "value: expected a number"),
    "a negative error": (put("errors", "crank", value=-1.0), "expected a number >= 0"),
    "an error that is a NaN": (put("errors", "crank", value=NAN), "expected a number >= 0"),
    "an error of no channel": (put("errors", value={"wheel": 1.0}), "'wheel' does not exist"),
}  # fmt: skip
ARRAYS = {
    "no t": ({"t": None}, "t missing"),
    "no header": ({"header": None}, "header missing"),
    "header of bytes": ({"header": np.frombuffer(b"{}", np.uint8)}, "header is not a text"),
    "t empty": ({"t": T[:0]}, "n >= 1"),
    "t without dimension": ({"t": np.float64(0.0)}, "n >= 1"),
    "t short": ({"t": T[:-1]}, r"q: expected the shape \(4, 3\)"),
    "t reversed": ({"t": T[::-1].copy()}, "increase strictly"),
    "t that rests": ({"t": np.zeros(N)}, "increase strictly"),
    "t with a NaN": ({"t": np.where(T == 0.5, NAN, T)}, "finite times"),
    "t infinite": ({"t": np.where(T == 1.0, INF, T)}, "finite times"),
    "t of whole numbers": ({"t": np.arange(N)}, "expected doubles"),
    "t of single precision": ({"t": T.astype(np.float32)}, "expected doubles"),
    "q of texts": ({"q": Q.astype(str)}, "expected doubles"),
    "q too narrow": ({"q": Q[:, :2]}, r"q: expected the shape \(5, 3\), got \(5, 2\)"),
    "q flat": ({"q": Q.ravel()}, "q: expected the shape"),
    "q with a NaN": ({"q": np.where(Q == 0.0, NAN, Q)}, "q: not all values are finite"),
    "v infinite": ({"v": Q + INF}, "v: not all values are finite"),
    "v complex": ({"v": Q.astype(complex)}, "expected doubles"),
    "channels too few": ({"channels": np.zeros((1, N))}, r"channels: expected the shape \(2, 5\)"),
    "channels by columns": ({"channels": np.asfortranarray(np.arange(2.0 * N).reshape(2, N))}, "row by row"),
}


def refused(good, path, words):
    """The file is refused with these words; its twin, put together in the same way without the fault, is read."""
    again = load_recording(crafted(good, path.with_name("twin.npz")))
    assert again.mechanism == fourbar() and np.array_equal(again.q, run().q)
    with pytest.raises(MechlabError, match=words) as error:
        load_recording(path)
    assert str(error.value).startswith(f"{path} is not a recording of mechlab: ")
    assert len(str(error.value)) < 1000 + len(str(path))


@pytest.mark.parametrize("name", HEADERS)
def test_headers(good, tmp_path, name):
    change, words = HEADERS[name]
    refused(good, crafted(good, tmp_path / "bad.npz", header=change), words)


@pytest.mark.parametrize("name", ARRAYS)
def test_arrays(good, tmp_path, name):
    arrays, words = ARRAYS[name]
    refused(good, crafted(good, tmp_path / "bad.npz", arrays=arrays), words)


def pickled():
    out = io.BytesIO()
    np.lib.format.write_array(out, np.array([{}], dtype=object), allow_pickle=True)
    return out.getvalue()


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ({"q.npy": b""}, "magic|EOF"),
        ({"q.npy": b"\x93NUMPY\x01\x00\x02\x00{}"}, "."),
        ({"q.npy": pickled()}, "expected doubles"),
        ({"header.npy": pickled()}, "."),
        ({"t.npy": npy(T)[:-8]}, r"t.npy has \d+ bytes, its shape \(5,\) takes"),
        ({"t.npy": npy(T).replace(b"(5,)", b"(9999999999999999999,)".ljust(4))}, "."),
        ({"t.npy": npy(T).replace(b"(5,), ", b"(-5,),")}, "."),
        ({"t": npy(T)}, "holds t(.npy)? twice"),
    ],
)
def test_entries(good, tmp_path, entries, words):
    refused(good, crafted(good, tmp_path / "bad.npz", entries=entries), words)


def test_what_save_writes_is_read(good, tmp_path):
    """Unchanged, also beside an array that a later version may add; errors may be infinite or missing."""
    again = load_recording(crafted(good, tmp_path / "a.npz", entries={"extra.npy": npy(T)}))
    assert np.array_equal(again.q, run().q) and again.errors == {"crank": 1e-6} and again.health == run().health
    assert load_recording(crafted(good, tmp_path / "b.npz", header=drop("errors"))).errors == {}
    assert (
        load_recording(crafted(good, tmp_path / "c.npz", header=put("errors", "crank", value=INF))).errors["crank"]
        == INF
    )


def test_a_run_that_blew_up_is_read(tmp_path):
    """Its own health record says so; numbers of numpy in the header come back as numbers."""
    q = run().q.copy()
    q[-1] = NAN
    lost = Finding("finite", np.int64(3), 0.0, "values", "error", "not finite")
    path = save_recording(
        replace(run(), q=q, health=Health((lost,)), parameters={"n": np.int64(3)}), tmp_path / "a.npz"
    )
    again = load_recording(path)
    assert np.isnan(again.q[-1]).all() and not again.health.trusted
    assert again.health.findings[0].value == 3.0 and again.parameters == {"n": 3}


def test_single_bits(good, tmp_path):
    """A flipped bit is found (the zip has checksums), or lies where it means nothing: then the same run is read."""
    raw = good.read_bytes()
    rng = np.random.default_rng(12)
    bad = 0
    for bit in rng.choice(8 * len(raw), 200, replace=False):
        flipped = bytearray(raw)
        flipped[bit // 8] ^= 1 << (bit % 8)
        path = tmp_path / "flipped.npz"
        path.write_bytes(flipped)
        try:
            again = load_recording(path)
        except MechlabError as error:
            assert str(error).startswith(f"{path} is not a recording"), error
            bad += 1
        else:
            assert again.mechanism == fourbar() and np.array_equal(again.q, run().q)
    assert 100 < bad < 200


@pytest.mark.parametrize("cut", [0, 1, 10, 100, -1, -30])
def test_cut_off(good, tmp_path, cut):
    path = tmp_path / "cut.npz"
    path.write_bytes(good.read_bytes()[:cut])
    refused(good, path, ".")


def bomb(good, path, name, shape):
    """The good recording with an array of zeros that is small only while it is compressed."""
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": shape})
    zeros = bytes(2**20)
    with zipfile.ZipFile(good) as source, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for entry in source.namelist():
            if entry != f"{name}.npy":
                archive.writestr(entry, source.read(entry))
        with archive.open(f"{name}.npy", "w", force_zip64=True) as out:
            out.write(head.getvalue())
            for _ in range(8 * int(np.prod(shape)) // len(zeros)):
                out.write(zeros)
    return path


@pytest.mark.parametrize(
    ("name", "shape", "words"),
    [
        ("t", (2**25,), "has 2415919104 bytes of numbers, the limit is 2147483648"),
        ("t", (2**23,), "increase strictly"),
        ("q", (2**22, 8), "q: expected the shape"),
    ],
)
def test_a_bomb_does_not_go_off(good, tmp_path, name, shape, words):
    """256 MiB of zeros in 300 kB: refused with less than a tenth of it in memory."""
    path = bomb(good, tmp_path / "bomb.npz", name, shape)
    assert path.stat().st_size < 2**20
    tracemalloc.start()
    try:
        refused(good, path, words)
        assert tracemalloc.get_traced_memory()[1] < 2**24
    finally:
        tracemalloc.stop()


def test_more_than_the_limit_is_read_only_when_asked(good):
    refused_at = 8 * N * (1 + 3 + 3 + 2) - 1
    with pytest.raises(MechlabError, match=f"the limit is {refused_at}"):
        load_recording(good, most_bytes=refused_at)
    assert len(load_recording(good, most_bytes=refused_at + 1).t) == N


def test_a_size_that_is_a_lie(good, tmp_path):
    """The directory says less than there is: no more than stated is unpacked, and the checksum does not fit."""
    path = bomb(good, tmp_path / "lie.npz", "q", (2**20, 8))
    raw = bytearray(path.read_bytes())
    at = raw.rindex(b"PK\x01\x02")  # the entry of q is the last one of the directory
    head = len(npy(np.zeros((N, 3))))
    struct.pack_into("<L", raw, at + 24, head)
    path.write_bytes(raw)
    refused(good, path, ".")
