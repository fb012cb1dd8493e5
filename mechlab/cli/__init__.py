"""The command line: find the verb, call the API, print, turn errors into exit codes. No logic of its own.

`verbs` is the table of verbs, `options` reads their options from the signatures of the API, `arguments` splits what is typed,
`output` and `terminal` print.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechlab import algebra_threads
from mechlab.cli import output
from mechlab.cli.arguments import one_name, refuse_bytes, split_tokens, with_flags
from mechlab.cli.terminal import bar
from mechlab.cli.verbs import VERBS
from mechlab.errors import DISTRIBUTION, MechlabError, UsageError, unknown, user_fault
from mechlab.values import Written

if TYPE_CHECKING:
    from mechlab.cli.options import Route
    from mechlab.experiment.model_file import ModelFile

STATUS = {1: "bad input", 2: "wrong usage", 3: "not to be trusted", 4: "no solution exists"}
HELP = """usage: mechlab VERB NAME [key=value ...] [options]

Describe a mechanism once; get model files, answers from three witnesses, motion and a page.

verbs:
{verbs}

NAME: a catalog name, file.py:function, or a .json, .xml or .urdf file.
key=value: parameters, given quantities, initial state, loads. Numbers are SI;
  37deg, 5mm, 300rpm, 17/22, lists a,b,c and ranges lo:hi or lo:hi:n are understood.
--json: print exactly one JSON document, also on failure.

exit: 0 answered and trustworthy, 1 bad input, 2 usage, 3 finished but do not trust it, 4 no solution exists

start with: mechlab run delta6 -o out          more on a verb: mechlab VERB --help
words for the TAB key: source <(mechlab --completion)"""
GREETING = """mechlab is a mechanism lab: linkages, gear trains, parallel robots, and a witness for every number.

Three commands to try:
  mechlab solve fourbar crank_angle=60deg    its other angles: closed form, Pinocchio, MuJoCo
  mechlab run fourbar -o out                 model files, checks, a run; open out/fourbar.html
  mechlab list --family coupling             what the catalog has

All verbs: mechlab --help. One verb: mechlab VERB --help."""
PRINTS_STAGES = ("run", "gallery")
"""Functions whose stages are printed; those of others are for Python alone."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code. Never raises for what a user can cause."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if argv is None:
        _spare()
        gc.set_threshold(20_000)  # what a command imports and makes lives to its end: seldom looked through for garbage
    call = _Call(arguments[0] if arguments else "", "--json" in arguments)
    try:
        with Signals() as signals:
            code = _exit_code(call, arguments, signals)
    except output.CannotPrint as error:
        output.complain(f"cannot write to the standard output: {error}.")
        return 1
    if argv is None and call.as_json:
        output.close_stdout()
    return code


def _spare() -> None:
    """Before numpy and MuJoCo load. Algebra starts no threads, unless the user says how many: the matrices of mechanisms are small, the
    threads would burn a tenth of a second of CPU waiting for work. MuJoCo does not look for a library of windows, which takes as long:
    pictures are drawn without one."""
    os.environ.setdefault("MUJOCO_GL", "disable")
    if "OMP_NUM_THREADS" not in os.environ:
        for name in algebra_threads.NAMES:
            os.environ.setdefault(name, "1")


def _exit_code(call: _Call, arguments: list[str], signals: Signals) -> int:
    try:
        return call.perform(arguments)
    except output.CannotPrint:
        raise
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt) or signals.received:
            word = "terminated" if signals.received == signal.SIGTERM else "interrupted"
            kept = str(error) if isinstance(error, KeyboardInterrupt) else ""
            return call.fail(
                error, 128 + (signals.received or signal.SIGINT), word, f"{word}: {kept}." if kept else f"{word}."
            )
        if isinstance(error, MechlabError):
            status = getattr(error, "status", None) or STATUS[error.exit_code]
            return call.fail(error, error.exit_code, status, with_flags(str(error), call.flags))
        if (fault := user_fault(error)) is not None:
            return call.fail(error, 1, STATUS[1], fault)
        if isinstance(error, OSError):
            where = f"{error.filename}: " if error.filename else ""
            return call.fail(error, 1, STATUS[1], f"{where}{error.strerror or error}.")
        # a bug of ours: still one message and, with --json, one document
        text = f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"
        report = "Please report this, with the command and what MECHLAB_DEBUG=1 prints."
        return call.fail(error, 1, "internal error", f"internal error: {text}. {report}")


class Signals:
    """In this block SIGTERM raises KeyboardInterrupt, as Ctrl-C does, so that both clean up. `received`: number of the
    signal, or 0; needed because C code may turn the exception into another. An ignored signal stays ignored."""

    def __init__(self) -> None:
        self.received = 0
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Signals:
        usual = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}
        if threading.current_thread() is threading.main_thread():
            self._before = {n: handler for n, handler in usual.items() if signal.getsignal(n) == handler}
        for number in self._before:
            signal.signal(number, self._stop)
        return self

    def __exit__(self, *error: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _stop(self, number: int, frame: object) -> None:
        self.received = number
        raise KeyboardInterrupt


class _Call:
    """One command and what is known of it so far, so that a failure at any point can say what was asked."""

    def __init__(self, verb: str, as_json: bool) -> None:
        self.verb = verb
        self.as_json = as_json
        self.names: list[str] = []
        self.values: dict[str, Written] = {}
        self.flags: dict[str, str] = {}
        self.files: list[ModelFile] = []

    def perform(self, arguments: list[str]) -> int:
        if not arguments:
            output.write(GREETING)
            return 0
        if self.verb in ("-h", "--help", "help"):
            output.write(HELP.format(verbs="\n".join(f"  {name:11}{verb.text}" for name, verb in VERBS.items())))
            return 0
        if self.verb == "--version":
            output.write(f"mechlab {output.package_version(DISTRIBUTION) or 'not installed'}")
            return 0
        if self.verb == "--completion":
            from mechlab.cli.completion import script

            output.write(script())
            return 0
        if self.verb not in VERBS:
            raise unknown("the verb", self.verb, VERBS, UsageError)
        refuse_bytes(arguments)
        from mechlab import api  # like `options` not before --help, which needs neither
        from mechlab.cli.options import chosen, flags_of, parser_of, routes_of

        verb = VERBS[self.verb]
        routes = routes_of(self.verb, verb, api)
        self.flags = flags_of(routes)
        try:
            parser = parser_of(self.verb, verb, routes)
            parser.refuse_unknown(arguments[1:])
            given = vars(parser.parse_intermixed_args(arguments[1:]))
        except SystemExit:  # --help has printed
            return 0
        self.names, self.values = split_tokens(given.pop("tokens"))
        given.pop("json", None)
        if any(Path(name).is_dir() for name in self.names):
            given |= {flag: True for flag, switch in verb.switches.items() if switch.folders}
        route, keywords = chosen(routes, given)
        positional, more = self._bound(route, given.get(route.switch))
        if "command" in route.parameters:
            import shlex

            more["command"] = shlex.join(["mechlab", *arguments])

        def call() -> Any:
            if "progress" not in route.parameters:
                return route.function(*positional, **keywords, **more)
            if route.name in PRINTS_STAGES:
                return route.function(*positional, **keywords, **more, progress=output.stage_printer(self.as_json))
            if route.parameters["progress"].annotation == "Stages":
                return route.function(*positional, **keywords, **more)
            with bar(" ".join([self.verb, *self.names]), lines=self.verb == "view") as progress:
                return route.function(*positional, **keywords, **more, progress=progress)

        if not self.as_json:
            with output.files_read(self.files):
                result = call()
            output.write_result(result.text())
            for file in self.files:
                output.write(f"\n{file.name}, what of it was read:\n" + "\n".join(f"  {remark}" for remark in file.remarks))
            return self.finish(result.exit_code, result.to_dict() if result.exit_code else {})
        with output.stdout_kept_clean(), output.files_read(self.files):
            result = call()
            document = output.envelope(self.verb, self.names, self.values)
            if result.exit_code:
                document["status"] = STATUS[result.exit_code]
            document |= result.to_dict()
        output.write(output.encode(document | output.reading(self.files) | {"exit_code": result.exit_code}))
        return self.finish(result.exit_code, document)

    def _bound(self, route: Route, kind: object) -> tuple[list[object], dict[str, object]]:
        """What the function takes by position: source or names, kind, key=value pairs; and its keyword `names`.

        Raises UsageError for too many or too few names or pairs.
        """
        words = " ".join([self.verb, route.switch]).strip() if not route.implied else self.verb
        positional: list[object] = []
        more: dict[str, object] = {}
        takes = route.parameters
        for name in takes:
            if name == "source":
                positional.append(one_name(self.names if "data" not in takes else self.names[:1], self.verb))
            elif name == "data":
                positional.append(one_name(self.names[1:], self.verb, "table", ("NAME data.csv",)))
            elif name == "task":
                positional.append(one_name(self.names, self.verb, "TASK", route.task_names))
            elif name == "sources":
                positional.append(self.names)
            elif name == "names":
                more["names"] = self.names
            elif name == "kind":
                positional.append(kind)
            elif name == "values":
                positional.append(self.values)
        if self.names and not {"source", "task", "sources", "names"} & takes.keys():
            raise UsageError(f"mechlab {words} takes no NAME. More on one mechanism: mechlab show {self.names[0]}.")
        if self.values and "values" not in takes:
            raise UsageError(f"mechlab {words} takes no key=value, got {', '.join(self.values)}.")
        return positional, more

    def finish(self, code: int, document: dict[str, Any]) -> int:
        if code:
            output.complain(str(document.get("message") or document.get("status") or STATUS[code]))
        return code

    def fail(self, error: BaseException, code: int, status: object, message: str) -> int:
        if os.environ.get("MECHLAB_DEBUG") == "1":
            import traceback

            traceback.print_exception(error)
        output.complain(message)
        if self.as_json:
            document = output.envelope(self.verb, self.names, self.values)
            problem = {"kind": type(error).__name__, "message": message}
            failure = {"status": status, "exit_code": code, "error": problem}
            output.write(output.encode(document | output.reading(self.files) | failure))
        return code
