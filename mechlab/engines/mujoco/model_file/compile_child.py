"""The process that compiles a stranger's file first: `python compile_child.py LIBRARY PLUGINS FILE` (FILE "-": text from standard input).

It loads the engine's library alone, without numpy and mechlab, which takes about 20 ms. It sets its own limits of memory and CPU time,
compiles, makes the data and evaluates the equations of motion once. Exit 0: the engine took the file. Exit REFUSED: it did not, its
words are on standard output. Exit FATAL: it gave up. Any other end is a crash.
"""

from __future__ import annotations

import ctypes
import os
import sys

MEMORY = 4 * 2**30
"""Largest address space of the process [bytes]."""
CPU = 20
"""Largest CPU time of the process [s]."""
REFUSED, FATAL = 7, 8


def _limit() -> None:
    try:
        import resource
    except ImportError:  # Windows: the parent's wall clock is the only limit
        return
    limits = {resource.RLIMIT_AS: MEMORY, resource.RLIMIT_CPU: CPU, resource.RLIMIT_CORE: 0, resource.RLIMIT_FSIZE: 0}
    for kind, most in limits.items():
        hard = resource.getrlimit(kind)[1]
        value = most if hard == resource.RLIM_INFINITY else min(most, hard)
        try:
            resource.setrlimit(kind, (value, hard))
        except (OSError, ValueError):  # macOS refuses RLIMIT_AS
            continue


def _leave(code: int, message: bytes = b"") -> None:
    os.write(1, message)
    os._exit(code)


def main() -> None:
    """Compile as the arguments say, and leave without cleaning up."""
    library, plugins, path = sys.argv[1:4]
    text = sys.stdin.buffer.read() if path == "-" else b""
    _limit()
    engine = ctypes.CDLL(library)
    handler = ctypes.CFUNCTYPE(None, ctypes.c_char_p)
    fatal, quiet = handler(lambda message: _leave(FATAL, message)), handler(lambda message: None)
    ctypes.c_void_p.in_dll(engine, "mju_user_error").value = ctypes.cast(fatal, ctypes.c_void_p).value
    ctypes.c_void_p.in_dll(engine, "mju_user_warning").value = ctypes.cast(quiet, ctypes.c_void_p).value
    for name in ("mj_loadXML", "mj_parseXMLString", "mj_compile", "mj_makeData"):
        getattr(engine, name).restype = ctypes.c_void_p
    if os.path.isdir(plugins):
        engine.mj_loadAllPluginLibraries(os.fsencode(plugins), None)
    words = ctypes.create_string_buffer(1000)
    if path == "-":
        spec = engine.mj_parseXMLString(text, None, words, len(words))
        model = engine.mj_compile(ctypes.c_void_p(spec), None) if spec else None
    else:
        model = engine.mj_loadXML(os.fsencode(path), None, words, len(words))
    if not model:
        if path == "-" and spec:
            engine.mjs_getError.restype = ctypes.c_char_p
            _leave(REFUSED, engine.mjs_getError(ctypes.c_void_p(spec)))
        _leave(REFUSED, words.value)
    data = engine.mj_makeData(ctypes.c_void_p(model))
    if not data:
        _leave(FATAL, b"its data need too much memory")
    engine.mj_forward(ctypes.c_void_p(model), ctypes.c_void_p(data))
    _leave(0)


if __name__ == "__main__":
    main()
