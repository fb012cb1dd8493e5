"""Finding a mechanism: in the catalog, in a user's file, or as an object; and sources that travel to other processes."""

from __future__ import annotations

import importlib.util
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

from mechlab.api.arguments import Values, key_values
from mechlab.api.suggestions import suggesting
from mechlab.errors import USER_MODULE, LeftOutWarning, MechlabError, described, explained, unknown, warn
from mechlab.lazy_dataclass import dataclass
from mechlab.values import Range, Value

if TYPE_CHECKING:
    from mechlab.experiment.entry import Entry
    from mechlab.experiment.model_file import ModelFile
    from mechlab.lab.design import Design
    from mechlab.mechanism import Mechanism

Source = Union[str, Path, "Mechanism", "Design", "Entry", Callable[..., "Mechanism"]]  # noqa: UP007 - names in quotes
"""What can be loaded; see `load`."""


@explained
@suggesting
def load(source: Source, values: Values | None = None, /, **parameters: Value) -> Design:
    """A Design from a catalog name, "file.py:function", a .json, .xml (MJCF) or .urdf file, a function or a Mechanism.

    Keyword arguments are parameters. Raises MechlabError for an unknown name, listing the catalog.
    """
    return load_design(source, key_values(values, parameters))


def load_design(source: Source, parameters: Mapping[str, Any]) -> Design:
    """As `load`, with parameters that are read already."""
    from mechlab.lab.design import Design, design

    if isinstance(source, Design):
        return design(source.entry, dict(source.given) | dict(parameters))
    return design(find(source), parameters)


def design_and_rest(source: Source, given: Mapping[str, Any]) -> tuple[Design, dict[str, Any]]:
    """The design with those of the keys that are its parameters, and the other keys."""
    from mechlab.lab.ask import parameters_and_rest

    base = load_design(source, {})
    parameters, rest = parameters_and_rest(base.entry.parameters, given)
    return load_design(base, parameters), rest


@explained
def find(source: Source) -> Entry:
    """The entry behind a source; see `load`."""
    from mechlab import catalog
    from mechlab.experiment.entry import Entry
    from mechlab.lab.design import Design
    from mechlab.lab.own_mechanism import entry_of, entry_of_class, entry_of_function
    from mechlab.mechanism import Builder, Mechanism

    if isinstance(source, Entry):
        return source
    if isinstance(source, Design):
        return source.entry
    if isinstance(source, Mechanism):
        return entry_of(source)
    if isinstance(source, Builder):
        raise MechlabError(f"{source.name}: a Builder is no mechanism yet; end it with .build() or .assemble(guess).")
    if isinstance(source, type):
        return entry_of_class(source)
    if callable(source):
        return entry_of_function(source)
    text = str(source)
    if text in catalog.NAMES:
        return catalog.entry(text)
    path, function = python_file(text)
    if path:
        return _from_python(Path(path), function)
    suffix = Path(text).suffix.lower()
    if suffix in MODEL_FILES:
        file = read_file(Path(text))
        if file.remarks:
            warn(LeftOutWarning(file))
        return entry_of(file.mechanism, file)
    if Path(text).is_file():
        hint = " Expand it first: `xacro FILE.urdf.xacro > FILE.urdf`." if suffix == ".xacro" else ""
        raise MechlabError(f"cannot read {text}: expected a name that ends in {', '.join(MODEL_FILES)} or .py:FUNCTION.{hint}")
    raise unknown("mechanism", text, [*catalog.NAMES, "FILE.py:FUNCTION", *(f"FILE{s}" for s in MODEL_FILES)])


def find_all(sources: Source | Sequence[Source]) -> list[Entry]:
    """The entries behind one source or several; the whole catalog for none."""
    from mechlab import catalog

    if isinstance(sources, Sequence) and not isinstance(sources, str):
        return [find(s) for s in sources or catalog.NAMES]
    return [find(sources)]


MODEL_FILES = (".json", ".xml", ".urdf")


def python_file(text: str) -> tuple[str, str]:
    """Path and function of "FILE.py:FUNCTION" or "FILE.py"; an empty path for anything else."""
    path, _, function = text.rpartition(":") if ".py:" in text else (text, "", "")
    return (path, function) if path.endswith(".py") else ("", "")


def read_file(path: Path) -> ModelFile:
    """A .json, .xml (MJCF) or .urdf file as it was read; raises MechlabError that names the file."""
    from mechlab.engines.mujoco.model_file.read_model import read_mjcf_file
    from mechlab.experiment.model_file import ModelFile
    from mechlab.formats import from_json, read_urdf
    from mechlab.formats.model_text import read_text

    content = read_text(path)
    try:
        match path.suffix.lower():
            case ".xml":
                return read_mjcf_file(path, content)
            case ".urdf":
                return read_urdf(path, content)
            case _:
                return ModelFile(path, "JSON", from_json(content))
    except MechlabError as error:
        raise MechlabError(f"{path}: {error}") from None


def _from_python(path: Path, name: str) -> Entry:
    """The entry of a user's function. Errors name the file and its own line."""
    from mechlab.experiment.entry import Entry
    from mechlab.lab.own_mechanism import entry_of_class, entry_of_function, is_scene

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
        if getattr(f, "__module__", "") == spec.name and not is_scene(f)
        and (hasattr(f, "build") and is_dataclass(f) if isinstance(f, type) else callable(f))
    }  # fmt: skip
    if not name:
        if len(own) != 1:
            raise MechlabError(f"{path} defines {', '.join(own) or 'no function'}: say which one, as {path}:FUNCTION.")
        name = next(iter(own))
    if isinstance(getattr(module, name, None), Entry):
        return getattr(module, name)
    if name not in own:
        raise unknown(f"{path}: function", name, own)
    entry_of_it = entry_of_class if isinstance(own[name], type) else entry_of_function
    return entry_of_it(own[name], name, lambda work: _guarded(path, work))


def _guarded(path: Path, work: Callable[[], Any]) -> Any:
    try:
        return work()
    except KeyboardInterrupt:  # Ctrl-C, and SIGTERM
        raise
    except MechlabError as error:
        text = f"{path}{_line(error, path)}: {error}"
        try:
            renamed = type(error)(text)
        except Exception:  # a class with more arguments than a text
            renamed = MechlabError(text)
        raise renamed from None
    except SyntaxError as error:
        where = path if error.filename is None else error.filename
        raise MechlabError(f"{where}, line {error.lineno}: {error.msg}.") from None
    except BaseException as error:  # also SystemExit: a user's file must not end this process
        raise MechlabError(f"{path}{_line(error, path)}: {described(error)}") from None


def _line(error: BaseException, path: Path) -> str:
    own = path.resolve()
    lines = [n for f, n in traceback.walk_tb(error.__traceback__) if Path(f.f_code.co_filename).resolve() == own]
    return f", line {lines[-1]}" if lines else ""


# -- sources on other machines -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class UserFile:
    """A user's Python file as it travels to other processes and machines: where it is here, and what it says."""

    path: str
    function: str
    content: str


def open_source(source: Source | UserFile, **parameters: Any) -> Design:
    """The design of a source that may come from another machine: where the file is not there, or says something else, its
    content is taken."""
    if not isinstance(source, UserFile):
        return load_design(source, parameters)
    path = Path(source.path)
    suffix = f":{source.function}" if source.function else ""
    if path.is_file() and path.read_text() == source.content:
        return load_design(f"{path}{suffix}", parameters)
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        copy.write_text(source.content)
        return load_design(f"{copy}{suffix}", parameters)


def travelling(source: Source) -> tuple[Source | UserFile, str]:
    """The source in a form that other processes can open, and a text that tells it from every other source."""
    from mechlab.formats import to_json
    from mechlab.lab.design import Design
    from mechlab.mechanism import Mechanism

    if isinstance(source, str | Path):
        text = str(source)
        path, function = python_file(text)
        if path:
            find(text)  # raises where the file is wrong
            content = Path(path).read_text()
            return UserFile(str(Path(path).resolve()), function, content), f"{function}\n{content}"
        if Path(text).suffix.lower() in MODEL_FILES:
            mechanism = load_design(text, {}).mechanism()
            return mechanism, to_json(mechanism)
        return text, text
    if isinstance(source, Mechanism):
        return source, to_json(source)
    if isinstance(source, Design):
        return source, f"{source.name} {dict(source.given)!r}"
    return source, find(source).name


def sweep_command(source: Source, given: Mapping[str, Any], quantities: Sequence[str]) -> str:
    """The command line that asks for the same sweep."""
    name = str(source) if isinstance(source, str | Path) else find(source).name

    def written(value: Any) -> str:
        if isinstance(value, Range | str):
            return str(value)
        return ",".join(str(x) for x in value) if hasattr(value, "__iter__") else str(value)

    words = ["mechlab", "sweep", name, *(f"{k}={written(v)}" for k, v in given.items())]
    return " ".join(words + (["--quantity", ",".join(quantities)] if quantities else []))
