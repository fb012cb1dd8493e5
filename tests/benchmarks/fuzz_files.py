"""Mutated model files against the command line: `python tests/benchmarks/fuzz_files.py SEED COUNT [FOLDER ...]`.

Takes the .xml, .urdf, .json and .npz files of the folders (default: models/), changes values, structure, length or bytes of one at a time,
and runs a verb on it in a child process with limits of time and memory. Reports crashes, internal errors, tracebacks, time-outs,
errors without a message, and files with a number that is not finite which are taken without a word. Exit 1 if there is any.
"""

import json
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SECONDS, CPU, MEMORY = 300.0, 60, 6 * 2**30
"""Limits of one run: wall time (other work may share the machine) and CPU time [s], address space [bytes]."""
VERBS = {
    ".xml": (["show"], ["doctor"], ["simulate", "--duration", "0.02"]),
    ".urdf": (["show"], ["doctor"], ["simulate", "--duration", "0.02"]),
    ".json": (["show"], ["simulate", "--duration", "0.02"]),
    ".npz": (["view", "--html"],),
}
VALUES = [
    "nan", "inf", "-inf", "1e400", "1e308", "-1e308", "1e-320", "0", "-1", "-0", "1", "2 3", "", " ", "x", "0 0 0", "1 0 0", "1e30",
    "999999999", "-2147483649", "9223372036854775808", "true", "0x10", "1,5", "١", "1e", "../../../../etc/passwd", "/dev/zero",
    "http://a/b", "\u0000", "world", "main", "a" * 5000, "&amp;", "null", "[]", "{}", "1/0",
]  # fmt: skip
ATTRIBUTE = re.compile(r'([\w:]+)="([^"]*)"')
ELEMENT = re.compile(r"<(\w+)[^<>]*/>")
NOT_FINITE = ("nan", "inf", "-inf", "1e400")


def files_of(folders):
    """The files to change: those of moderate size."""
    found = [p for folder in folders for p in sorted(folder.rglob("*")) if p.suffix in VERBS and p.is_file()]
    return [p for p in found if p.stat().st_size < 400_000 and not p.name.startswith("scene")]


def mutated(rng, data, suffix):
    """Changed bytes, and what was done."""
    kind = rng.random()
    if suffix == ".npz" or kind < 0.1:
        return damaged(rng, data)
    text = data.decode("utf-8", "replace")
    if suffix == ".json":
        return changed_json(rng, text)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        text, what = changed_xml(rng, text)
    return text.encode("utf-8", "surrogatepass"), what


def damaged(rng, data):
    """Bytes cut, exchanged or repeated."""
    data = bytearray(data)
    at = rng.randrange(max(len(data), 1))
    kind = rng.choice(("cut", "flip", "repeat", "zero"))
    if kind == "cut":
        return bytes(data[:at]), f"cut at {at}"
    if kind == "flip":
        for _ in range(rng.choice((1, 4, 50))):
            data[rng.randrange(len(data))] = rng.randrange(256)
        return bytes(data), "bytes"
    if kind == "repeat":
        return bytes(data[:at] + data[at // 2 : at] + data[at:]), f"repeat {at}"
    return bytes(data[:at] + bytes(64) + data[at + 64 :]), f"zeros at {at}"


def changed_xml(rng, text):
    """A value, a name of an attribute, an element more, one less, one deeper."""
    kind = rng.random()
    attributes, elements = list(ATTRIBUTE.finditer(text)), list(ELEMENT.finditer(text))
    if (kind < 0.6 and attributes) or not elements:
        if not attributes:
            return text[: len(text) // 2], "cut"
        found = rng.choice(attributes)
        value = rng.choice(VALUES).replace('"', "")
        words = found[2].split()
        if len(words) > 1 and rng.random() < 0.7:
            words[rng.randrange(len(words))] = value
            value = " ".join(words)
        return text[: found.start(2)] + value + text[found.end(2) :], f"{found[1]}={value[:30]!r}"
    if kind < 0.7 and attributes:
        found = rng.choice(attributes)
        new = rng.choice(("foo", found[1] + "s", found[1][:-1] or "x", "class", "name", "mass", "file"))
        return text[: found.start(1)] + new + text[found.end(1) :], f"attribute {found[1]} -> {new}"
    found = rng.choice(elements)
    if kind < 0.8:
        return text[: found.start()] + text[found.end() :], f"without <{found[1]}>"
    if kind < 0.9:
        other = rng.choice(elements)
        return text[: other.start()] + found[0] + text[other.start() :], f"<{found[1]}> before <{other[1]}>"
    depth = rng.choice((2, 50, 400, 3000))
    deep = f"<{found[1]}>" * depth + f"</{found[1]}>" * depth
    return text[: found.start()] + deep + text[found.end() :], f"{depth} times <{found[1]}>"


def changed_json(rng, text):
    """A value somewhere, replaced."""
    data = json.loads(text)
    at, path = data, []
    while isinstance(at, dict | list) and at and rng.random() < 0.9:
        key = rng.choice(list(at) if isinstance(at, dict) else range(len(at)))
        path.append((at, key))
        at = at[key]
    if path:
        inside, key = path[-1]
        inside[key] = rng.choice([None, True, -1, 0, 1e308, 10**400, float("nan"), "", "nan", [], {}, [[]] * 9, "1/0", "1e9999"])
    return json.dumps(data).encode(), "/".join(str(k) for _, k in path)


LIMITED = (
    "import resource, sys; resource.setrlimit(resource.RLIMIT_AS, ({m}, {m})); resource.setrlimit(resource.RLIMIT_CPU, ({c}, {c})); "
    "from mechlab.cli import main; sys.exit(main(sys.argv[1:]))"
)


def run(command):
    """Exit code (None: out of time), the two outputs, wall time."""
    start = time.monotonic()
    try:
        done = subprocess.run(
            [sys.executable, "-c", LIMITED.format(m=MEMORY, c=CPU), *command], cwd=ROOT, capture_output=True, text=True,
            timeout=SECONDS, errors="replace",
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return None, "", "", SECONDS
    return done.returncode, done.stdout, done.stderr, time.monotonic() - start


def fault(code, out, err, text):
    """What is wrong with an answer; empty if nothing is."""
    if code is None:
        return "time-out"
    if code not in (0, 1, 2, 3, 4):
        return f"crash {code}"
    if "internal error" in err or "Traceback" in err:
        return "internal error"
    if code and not err.strip():
        return "no message"
    if code == 0 and text and any(v in number_words(text) for v in NOT_FINITE):
        return "a number that is not finite was taken"
    return ""


def number_words(text):
    """The words of all attributes that are not names."""
    words = set()
    for key, value in ATTRIBUTE.findall(text):
        if key.rstrip("0123456789") not in NAMES:
            words.update(value.split())
    return words


NAMES = (
    "name", "class", "childclass", "model", "file", "joint", "site", "body", "geom", "tendon", "mesh", "material", "link", "type",
    "filename", "texture", "reference", "actuator", "group", "upper", "lower", "effort", "velocity", "data", "encoding", "version",
    "key", "prefix",
)  # fmt: skip
"""Attributes that hold names, and those of URDF that may be infinite."""


def main():
    """Mutate, run, count."""
    seed, count = int(sys.argv[1]), int(sys.argv[2])
    files = files_of([Path(f) for f in sys.argv[3:]] or [ROOT / "models"])
    if not files:
        sys.exit(f"no {', '.join(VERBS)} file below 400 kB in {', '.join(sys.argv[3:]) or 'models/'}: name a folder with model files.")
    kept = Path(tempfile.mkdtemp(prefix="fuzz_"))
    codes, faults, slowest = Counter(), Counter(), (0.0, "")
    for k in range(count):
        rng = random.Random(f"{seed} {k}")
        source = rng.choice(files)
        verb = rng.choice(VERBS[source.suffix])
        data, what = mutated(rng, source.read_bytes(), source.suffix)
        trial = source.with_name(f".fuzz-{seed}-{k}{source.suffix}") if writable(source.parent) else kept / f"{k}{source.suffix}"
        try:
            trial.write_bytes(data)
            extra = [str(kept / "page.html")] if verb[0] == "view" else []
            code, out, err, wall = run([verb[0], str(trial), *verb[1:], *extra])
        finally:
            if trial.exists():
                shutil.move(trial, kept / f"{k}{source.suffix}")
        text = data.decode("utf-8", "replace") if source.suffix in (".xml", ".urdf") else ""
        wrong = fault(code, out, err, text)
        codes[code] += 1
        slowest = max(slowest, (wall, f"{k} {verb[0]} {source.name} {what}"))
        if wrong:
            faults[wrong] += 1
            last = (err.strip().splitlines() or [""])[-1][:300]
            print(f"{k:5d} {wrong}: {verb[0]} {source} ({what}): {last}", flush=True)
        else:
            (kept / f"{k}{source.suffix}").unlink(missing_ok=True)
    print(f"{count} mutations of {len(files)} files: exit codes {dict(codes)}, faults {dict(faults)}, slowest {slowest}; kept in {kept}")
    return 1 if faults else 0


def writable(folder):
    """True where a file can be put beside the source, so that includes and meshes are found."""
    try:
        probe = folder / ".fuzz-probe"
        probe.touch()
        probe.unlink()
    except OSError:
        return False
    return True


if __name__ == "__main__":
    sys.exit(main())
