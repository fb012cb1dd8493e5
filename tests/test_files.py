"""Files and folders are there whole or not at all: two writers, full disks, links, devices, pipes, killed processes."""

import errno
import os
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from mechlab import files
from mechlab.files import CannotWrite, tidy, unfinished, whole_folder, write

POSIX = pytest.mark.skipif(os.name == "nt", reason="links, devices, modes and signals of POSIX")


def names(folder):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*"))


def full(path, content):
    """A disk that is full: some of the content is there, then the error of the system, which names no file."""
    with Path(path).open("wb") as file:
        file.write(content[: len(content) // 2])
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_file_its_folder_and_its_mode(tmp_path):
    umask = os.umask(0o027)
    try:
        path = write(tmp_path / "new" / "a.txt", "été")
    finally:
        os.umask(umask)
    assert path.read_bytes() == "été".encode()
    assert names(tmp_path) == ["new", "new/a.txt"]
    if os.name != "nt":
        assert stat.S_IMODE(path.stat().st_mode) == 0o640
        path.chmod(0o604)
        assert stat.S_IMODE(write(path, b"again").stat().st_mode) == 0o604


@POSIX
def test_links_are_followed(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "a").write_text("old")
    (tmp_path / "link").symlink_to("real/a")
    (tmp_path / "loose").symlink_to("real/b")
    write(tmp_path / "link", "new")
    write(tmp_path / "loose", "made")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "real" / "a").read_text() == "new"
    assert (tmp_path / "loose").is_symlink() and (tmp_path / "real" / "b").read_text() == "made"
    assert names(tmp_path / "real") == ["a", "b"]


@POSIX
def test_a_device_stays_a_device():
    with pytest.raises(CannotWrite, match=r"cannot write /dev/full: No space left"):
        write("/dev/full", b"x" * 100)
    assert stat.S_ISCHR(os.stat("/dev/full").st_mode)
    write("/dev/null", b"x")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


@POSIX
def test_a_pipe_gets_the_content(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    got = []
    reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()))
    reader.start()
    write(pipe, b"all of it")
    reader.join(30)
    assert got == [b"all of it"] and stat.S_ISFIFO(pipe.stat().st_mode)


@POSIX
def test_standard_output_keeps_its_place(tmp_path):
    code = "from mechlab.files import write; import os; os.write(1, b'before '); write('/dev/stdout', b'it'); os.write(1, b' after')"
    with (tmp_path / "out").open("wb") as out:
        subprocess.run([sys.executable, "-c", code], stdout=out, check=True)
    assert (tmp_path / "out").read_bytes() == b"before it after"


def test_what_cannot_be_written_says_where(tmp_path):
    (tmp_path / "file").write_text("")
    for path, why in ((tmp_path, "it is a folder"), (tmp_path / "file" / "x", "file is a file, no folder")):
        with pytest.raises(CannotWrite, match=why) as error:
            write(path, b"")
        assert str(path) in str(error.value)
    assert names(tmp_path) == ["file"]


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere")
def test_what_is_read_only_stays(tmp_path):
    (tmp_path / "a").write_text("mine")
    (tmp_path / "a").chmod(0o400)
    with pytest.raises(CannotWrite, match="read-only"):
        write(tmp_path / "a", b"")
    assert (tmp_path / "a").read_text() == "mine"


def test_a_full_disk_changes_nothing(tmp_path, monkeypatch):
    write(tmp_path / "a", b"old")
    monkeypatch.setattr(Path, "write_bytes", full)
    for path in (tmp_path / "a", tmp_path / "b", tmp_path / "deep" / "er" / "c"):
        with pytest.raises(CannotWrite, match="No space left on device") as error:
            write(path, b"new content")
        assert str(path) in str(error.value)
    assert names(tmp_path) == ["a"] and (tmp_path / "a").read_bytes() == b"old"


def test_an_error_in_the_block_changes_nothing(tmp_path):
    for error in (ValueError, KeyboardInterrupt):
        with pytest.raises(error), unfinished(tmp_path / "x" / "a.png") as temporary:
            assert temporary.suffix == ".png"
            temporary.write_bytes(b"half")
            raise error
    assert names(tmp_path) == []


def test_the_last_of_many_writers_wins(tmp_path):
    """Eight processes' worth of threads write the same name; at every moment the file is one of theirs."""
    contents = [bytes([65 + k]) * 100_000 for k in range(8)]
    write(tmp_path / "a", contents[0])
    stop = threading.Event()
    seen = set()

    def look():
        while not stop.is_set():
            seen.add((tmp_path / "a").read_bytes())

    watcher = threading.Thread(target=look)
    watcher.start()
    writers = [threading.Thread(target=lambda c=c: [write(tmp_path / "a", c) for _ in range(20)]) for c in contents]
    for w in writers:
        w.start()
    for w in writers:
        w.join()
    stop.set()
    watcher.join()
    assert seen <= set(contents) and names(tmp_path) == ["a"]


def test_a_folder_is_whole(tmp_path):
    out = tmp_path / "x" / "out"
    with whole_folder(out) as stage:
        write(stage / "a", b"1")
        write(stage / "deep" / "b", b"2")
        assert not out.exists()
    assert names(out) == ["a", "deep", "deep/b"] and names(tmp_path / "x")[0] == "out"
    (out / "mine").write_text("mine")
    with whole_folder(out) as stage:
        write(stage / "a", b"3")
        write(stage / "deep" / "c", b"4")
    assert names(out) == ["a", "deep", "deep/b", "deep/c", "mine"] and (out / "a").read_bytes() == b"3"


@pytest.mark.parametrize("there", [False, True])
def test_a_folder_on_a_full_disk(tmp_path, monkeypatch, there):
    out = tmp_path / "x" / "out"
    if there:
        write(out / "a", b"old")
    before = names(tmp_path)
    with pytest.raises(CannotWrite) as error, whole_folder(out) as stage:
        write(stage / "a", b"new")
        monkeypatch.setattr(Path, "write_bytes", full)
        write(stage / "deep" / "b", b"new")
    assert str(error.value) == f"cannot write {out / 'deep' / 'b'}: No space left on device."
    assert names(tmp_path) == before
    assert not there or (out / "a").read_bytes() == b"old"


def test_a_move_that_fails_is_taken_back(tmp_path, monkeypatch):
    out = tmp_path / "out"
    write(out / "a", b"old")
    (out / "c").mkdir()  # a folder cannot become a file
    with pytest.raises(CannotWrite) as error, whole_folder(out) as stage:
        for name in ("a", "b/b", "c"):
            write(stage / name, b"new")
    assert str(out / "c") in str(error.value)
    assert names(tmp_path) == ["out", "out/a", "out/c"] and (out / "a").read_bytes() == b"old"


def leftover(folder, process, suffix=".png"):
    name = f".mechlab-{files._place()}-{process}-0123abcd.part{suffix}"
    (folder / name).write_bytes(b"half")
    return folder / name


@POSIX
def test_leftovers_of_dead_processes_go(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    gone = leftover(tmp_path, dead.pid)
    stage = tmp_path / gone.name.replace("0123abcd.part.png", "00000000.part")
    (stage / "deep").mkdir(parents=True)
    mine = leftover(tmp_path, os.getpid())
    elsewhere = mine.with_name(mine.name.replace(files._place(), "00000000"))
    elsewhere.write_bytes(b"")
    stranger = tmp_path / ".mechlab-notes.part"
    stranger.write_text("not ours")
    write(tmp_path / "a", b"")
    assert names(tmp_path) == sorted(p.name for p in (mine, elsewhere, stranger, tmp_path / "a"))
    long_ago = time.time() - 2 * files.DAY
    os.utime(elsewhere, (long_ago, long_ago))
    tidy(tmp_path)
    assert not elsewhere.exists() and mine.exists()


@POSIX
@pytest.mark.parametrize("what", ["write", "whole_folder"])
def test_a_killed_process_leaves_what_the_next_one_removes(tmp_path, what):
    code = {
        "write": "with files.unfinished('x/a.bin') as f: f.write_bytes(b'half'); print(1, flush=True); time.sleep(60)",
        "whole_folder": "with files.whole_folder('x') as d: files.write(d / 'a', b''); print(1, flush=True); time.sleep(60)",
    }[what]
    (tmp_path / "x").mkdir()
    child = subprocess.Popen(
        [sys.executable, "-c", f"import time; from mechlab import files\n{code}"],
        cwd=tmp_path, stdout=subprocess.PIPE, env=os.environ | {"PYTHONPATH": str(Path(files.__file__).parents[1])},
    )  # fmt: skip
    assert child.stdout is not None
    child.stdout.readline()
    child.kill()
    child.wait()
    child.stdout.close()
    assert any(n.startswith("x/.mechlab-") for n in names(tmp_path))
    with whole_folder(tmp_path / "x") as stage:
        write(stage / "b", b"")
    assert names(tmp_path) == ["x", "x/b"]
