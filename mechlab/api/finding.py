"""Finding a mechanism: in the catalog, in a user's file, or as an object."""

from __future__ import annotations

import importlib.util
import inspect
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechlab import catalog
from mechlab.errors import USER_MODULE, MechlabError, described, unknown
from mechlab.experiment.entry import Entry
from mechlab.lab.design import Design, design, entry_of, entry_of_function
from mechlab.mechanism import Mechanism

if TYPE_CHECKING:
    pass


Source = str | Path | Mechanism | Design | Entry | Callable[..., Mechanism]
"""What can be loaded; see `load`."""


def load(source: Source, **parameters: Any) -> Design:
    """A Design from a catalog name, "file.py:function", a .json, .xml (MJCF) or .urdf file, a function or a Mechanism.

    Keyword arguments are parameters. Raises MechlabError for an unknown name, listing the catalog.
    """
    if isinstance(source, Design):
        return design(source.entry, dict(source.given) | parameters)
    return design(find(source), parameters)


def find(source: Source) -> Entry:
    """The entry behind a source; see `load`."""
    if isinstance(source, Entry):
        return source
    if isinstance(source, Design):
        return source.entry
    if isinstance(source, Mechanism):
        return entry_of(source)
    if callable(source):
        return entry_of_function(source)
    text = str(source)
    if text in catalog.NAMES:
        return catalog.entry(text)
    path, _, name = text.rpartition(":") if ".py:" in text else (text, "", "")
    if text.endswith(".py") or path.endswith(".py"):
        return _from_python(Path(path or text), name)
    suffix = Path(text).suffix.lower()
    if suffix in (".json", ".xml", ".urdf"):
        return entry_of(_from_file(Path(text), suffix))
    raise unknown("mechanism", text, [*catalog.NAMES, "FILE.py:FUNCTION", "FILE.json", "FILE.xml", "FILE.urdf"])


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise MechlabError(f"cannot read {path}: {getattr(error, 'strerror', None) or error}.") from None


def _from_file(path: Path, suffix: str) -> Mechanism:
    from mechlab.formats import from_json, from_mjcf, from_urdf

    reader = {".json": from_json, ".xml": from_mjcf, ".urdf": from_urdf}[suffix]
    try:
        return reader(_read(path))
    except MechlabError as error:
        raise MechlabError(f"{path}: {error}") from None


def _from_python(path: Path, name: str) -> Entry:
    """The entry of a user's function. Errors of the file are told with its own line."""
    if not path.is_file():
        raise MechlabError(f"there is no file {path}.")
    spec = importlib.util.spec_from_file_location(f"{USER_MODULE}{path.stem}", path)
    if spec is None or spec.loader is None:
        raise MechlabError(f"{path} is not a Python file.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    _guarded(path, lambda: spec.loader.exec_module(module))  # type: ignore[union-attr]
    own = {
        n: f
        for n, f in vars(module).items()
        if callable(f) and getattr(f, "__module__", "") == spec.name and not isinstance(f, type)
    }
    if not name:
        if len(own) != 1:
            raise MechlabError(f"{path} defines {', '.join(own) or 'no function'}: say which one, as {path}:FUNCTION.")
        name = next(iter(own))
    if isinstance(getattr(module, name, None), Entry):
        return getattr(module, name)
    if name not in own:
        raise unknown(f"{path}: function", name, own)
    function = own[name]

    def guarded(**values: Any) -> Mechanism:
        return _guarded(path, lambda: function(**values))

    guarded.__name__, guarded.__doc__ = function.__name__, function.__doc__
    guarded.__signature__ = inspect.signature(function)  # type: ignore[attr-defined]
    return entry_of_function(guarded, name)


def _guarded(path: Path, work: Callable[[], Any]) -> Any:
    try:
        return work()
    except KeyboardInterrupt:  # Ctrl-C, and SIGTERM
        raise
    except MechlabError as error:
        text = f"{path}{_line(error, path)}: {error}"
        try:
            told = type(error)(text)
        except Exception:  # a class with more arguments than a text
            told = MechlabError(text)
        raise told from None
    except SyntaxError as error:
        where = path if error.filename is None else error.filename
        raise MechlabError(f"{where}, line {error.lineno}: {error.msg}.") from None
    except BaseException as error:  # also SystemExit: a user's file must not end this process
        raise MechlabError(f"{path}{_line(error, path)}: {described(error)}") from None


def _line(error: BaseException, path: Path) -> str:
    own = path.resolve()
    lines = [n for f, n in traceback.walk_tb(error.__traceback__) if Path(f.f_code.co_filename).resolve() == own]
    return f", line {lines[-1]}" if lines else ""
