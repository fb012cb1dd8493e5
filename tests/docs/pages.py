"""Runs the code of a page as a reader would, from top to bottom in one empty folder, and compares what it prints with the page.

    python -m tests.docs.pages docs/howto/read_reactions.md     # what differs
    python -m tests.docs.pages --write docs/howto/*.md          # the printed text is put into the page

What a page may hold:

- ```` ```python ````: run in the page's one namespace. ```` ```sh ````: run line by line; a line that ends in `# exit 3` must end so.
- ```` ```text ```` right below such a block: what the block prints. `...` stands for anything, also in a line. Words are compared to
  the letter, numbers to 1 % and not below 1e-4, where the last digits of a residual are the machine's.
- `` ```{code-block} python `` with `:caption: my.py`: the file my.py, written and not run.
- `<!-- not run: why -->` above a block: it is left alone.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
FENCE = re.compile(
    r"^(?:<!-- not run: (?P<reason>[^\n]+) -->\n+)?(?P<fence>`{3,})(?P<kind>[^\n]*)\n(?P<body>.*?)^(?P=fence)[ ]*$", re.M | re.S
)
CAPTION = re.compile(r"\A(?::[a-z-]+:[^\n]*\n)*?:caption: (?P<name>[^\n]+)\n(?::[a-z-]+:[^\n]*\n)*\n?")
NUMBER = r"[-+]?(?:\d+(?:\.(?!\.)\d*)?|(?<!\.)\.\d+)(?:[eE][-+]?\d+)?"
LOOSE = {"rtol": 1e-2, "atol": 1e-4}
WIDTH = "140"
"""Columns of the terminal in which the commands of the pages print."""


@dataclass(frozen=True)
class Block:
    """A fenced block: language, text, name of the file that it is (or ""), why it is not run (or ""), place in the page; and the
    text that stands below it as what it prints, with its place (None where nothing is shown)."""

    kind: str
    body: str
    file: str
    reason: str
    start: int
    end: int
    shown: str | None = None
    shown_at: tuple[int, int] = (0, 0)


@dataclass(frozen=True)
class Ran:
    """A block that was run, and what it printed."""

    block: Block
    printed: str


def blocks_of(text: str) -> list[Block]:
    """All fenced blocks of a page that are code, files, or left alone with a reason."""
    out: list[Block] = []
    last_end = 0
    for found in FENCE.finditer(text):
        kind, body = found["kind"].strip(), found["body"]
        named = CAPTION.match(body)
        if kind == "text":
            if out and not text[last_end : found.start()].strip() and not out[-1].file and not out[-1].reason:
                out[-1] = replace(out[-1], shown=body, shown_at=(found.start("body"), found.end("body")))
        elif named and kind.startswith("{code-block}"):
            out.append(Block(kind.split()[-1], body[named.end() :], named["name"].strip(), "", *found.span()))
        elif kind in ("python", "sh"):
            out.append(Block(kind, body, "", found["reason"] or "", *found.span()))
        last_end = found.end()
    return out


def run_page(path: Path) -> list[Ran]:
    """Run the blocks of a page in an empty folder, stop at the first error. Raises what the code raises."""
    with tempfile.TemporaryDirectory() as folder, _inside(Path(folder)):
        names: dict[str, object] = {"__name__": "__main__"}
        return [_run(block, names, path) for block in blocks_of(path.read_text(encoding="utf-8")) if not block.reason]


def _run(block: Block, names: dict[str, object], path: Path) -> Ran:
    if block.file:
        assert not Path(block.file).is_absolute() and ".." not in block.file, f"{path.name}: {block.file}"
        Path(block.file).parent.mkdir(parents=True, exist_ok=True)
        Path(block.file).write_text(block.body, encoding="utf-8")
        return Ran(block, "")
    if block.kind == "sh":
        return Ran(block, "".join(_command(line) for line in _lines(block.body)))
    out = io.StringIO()
    with contextlib.redirect_stdout(out), warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        line = path.read_text(encoding="utf-8")[: block.start].count("\n") + 2
        exec(compile("\n" * (line - 1) + block.body, str(path), "exec"), names)
    return Ran(block, out.getvalue())


def _lines(body: str) -> list[str]:
    return [line for line in body.replace("\\\n", " ").splitlines() if line.strip() and not line.lstrip().startswith("#")]


def _command(line: str) -> str:
    """What one line of a shell prints. Commands of mechlab run here, without starting Python; all others in a shell."""
    expected = re.search(r"#\s*exit (\d)", line)
    code = int(expected[1]) if expected else 0
    command = re.sub(r"\s+#.*", "", line)
    words = shlex.split(command)
    if words[0] == "mechlab" and not {"|", ">", ";", "&&", "<"} & {*shlex.split(command, posix=False)} and ";" not in command:
        from mechlab.cli import main

        out, errors = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
            try:
                got = main(words[1:])
            except SystemExit as stop:
                got = int(stop.code or 0)
        printed = out.getvalue() + (errors.getvalue() if code else "")
        complaint = errors.getvalue()
    else:
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        source = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
        done = subprocess.run(
            ["bash", "-c", command], capture_output=True, text=True, env=os.environ | {"PATH": path, "PYTHONPATH": source}, timeout=300
        )
        got, printed, complaint = done.returncode, done.stdout + (done.stderr if code else ""), done.stderr
    assert got == code, f"{line}: exit {got}, the page says {code}.\n{complaint[-2000:]}"
    return printed


@contextlib.contextmanager
def _inside(folder: Path) -> Iterator[None]:
    """The folder as working folder and first place to import from; no colour, a fixed width."""
    old, width, path = Path.cwd(), os.environ.get("COLUMNS"), sys.path[:]
    modules = {*sys.modules}
    os.chdir(folder)
    os.environ["COLUMNS"] = WIDTH
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        os.chdir(old)
        sys.path[:] = path
        if width is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = width
        for name in {*sys.modules} - modules:  # files of the page, which the next page may name alike
            if str(getattr(sys.modules[name], "__file__", "") or "").startswith(str(folder)):
                del sys.modules[name]


def difference(shown: str, printed: str) -> str:
    """A sentence on how what is printed differs from what the page shows; empty where it does not."""
    pattern, numbers = "", []
    for part in re.split(rf"(\.\.\.|{NUMBER}|\s+)", shown.strip()):
        if part == "...":
            pattern += r".*?"
        elif re.fullmatch(NUMBER, part):
            pattern += f"({NUMBER})"
            numbers.append(float(part))
        else:
            pattern += r"\s+" if part.isspace() else re.escape(part)
    found = re.fullmatch(pattern, printed.strip(), re.S)
    if found is None:
        return f"the page shows\n{shown}\nprinted is\n{printed}"
    got = np.array([float(x) for x in found.groups()])
    off = ~np.isclose(got, numbers, **LOOSE)
    return ", ".join(f"{a:g} on the page, {b:g} printed" for a, b in zip(np.array(numbers)[off], got[off], strict=True))


def written(path: Path) -> str:
    """The text of the page with what its blocks print now; a shown text with `...` stays as it is."""
    text = path.read_text(encoding="utf-8")
    for ran in reversed(run_page(path)):
        if ran.block.shown is not None and "..." not in ran.block.shown:
            start, end = ran.block.shown_at
            text = text[:start] + ran.printed.rstrip() + "\n" + text[end:]
    return text


def main(arguments: list[str]) -> int:
    """Compare or write the pages that are named; all of docs/ without names. Returns 1 where a page differs."""
    pages = [Path(a).resolve() for a in arguments if a != "--write"] or sorted(DOCS.rglob("*.md"))
    wrong = 0
    for path in pages:
        if "--write" in arguments:
            path.write_text(written(path), encoding="utf-8")
            continue
        for ran in run_page(path):
            if ran.block.shown is not None and (how := difference(ran.block.shown, ran.printed)):
                wrong = 1
                print(f"{path}: {how}")
    return wrong


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
