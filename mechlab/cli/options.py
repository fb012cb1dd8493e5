"""The options of a verb, read from the signatures of the API: name, type, default, choices and help.

A keyword of the function becomes an option: `max_error: Error | None` is `--max-error E`, a number in the units of the type
`Error`. Its metavar and help stand in the docstring, under "Options:", as `max_error=E: help`. No engine is imported.
"""

from __future__ import annotations

import argparse
import builtins
import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, NoReturn, Union, get_args, get_origin

from mechlab.cli.arguments import split_tokens, with_flags
from mechlab.cli.examples import EXAMPLES
from mechlab.cli.output import write
from mechlab.cli.verbs import NOT_OPTIONS, Verb
from mechlab.errors import UsageError, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.values import Range, Written, parse_number

SUBJECTS = ("source", "sources", "task", "kind", "data", "values")
"""Parameters of the API that are no options: they are given by position, before all others."""
ENTRY = re.compile(r"(\w+)(?:=(.+?))?: (.*)")


@dataclass(frozen=True)
class Option:
    """One option: its keyword in Python, its flag, and what its text is read as."""

    keyword: str
    flag: str
    kinds: tuple[Any, ...]
    default: object
    metavar: str
    text: str

    @property
    def is_flag(self) -> bool:
        """Whether it stands alone, without a value."""
        return bool in self.kinds

    @property
    def repeated(self) -> bool:
        """Whether it may be given several times."""
        return any(_list_of(k) is not None for k in self.kinds) and str in self.kinds or self.mapping is not None

    @property
    def mapping(self) -> tuple[Any, ...] | None:
        """The types of the values of an option that takes key=value; None for every other option."""
        return next((_members(get_args(k)[1]) for k in self.kinds if get_origin(k) is Mapping), None)

    @property
    def choices(self) -> tuple[str, ...]:
        """The words that its type lists."""
        return next((get_args(k) for k in self.kinds if get_origin(k) is Literal), ())

    @property
    def help(self) -> str:
        """The help, with the choices or the default behind it."""
        if self.choices:
            return f"{self.text}: {', '.join(self.choices)}"
        number = isinstance(self.default, int) and not self.is_flag
        return f"{self.text} (default: {self.default})" if number else self.text

    def read(self, text: str | list[str]) -> object:
        """The value for Python. Raises UsageError for what is no value of the kind, MechlabError for a wrong number."""
        if isinstance(text, list):
            return text if self.mapping is None else self._pairs(text)
        for kind in self.kinds:
            item = _list_of(kind)
            if item is not None:
                parts = [x.strip() for x in text.split(",")]
                if get_origin(kind) is tuple and len(parts) != len(get_args(kind)):
                    raise UsageError(f"{self.flag} takes {len(get_args(kind))} numbers {self.metavar}, got {text!r}.")
                if not all(parts):
                    raise UsageError(f"{self.flag} takes values with commas between them, got {text!r}.")
                return tuple(self._one(item, x, text) for x in parts)
        return self._one(self.kinds[0], text, text)

    def _one(self, kind: Any, text: str, whole: str) -> object:
        units: Sequence[Any] = ()
        if get_origin(kind) is Annotated:
            kind, *units = get_args(kind)
        if kind is float:
            return parse_number(self.flag, text, *units)
        if kind is int:
            if not re.fullmatch(r"-?\d{1,9}", text, re.ASCII) or any(int(text) < low for low in units):
                least = f" of at least {units[0]}" if units else ""
                numbers = f"whole numbers{least} {self.metavar}" if text != whole else f"a whole number{least}"
                raise UsageError(f"{self.flag} takes {numbers}, got {whole!r}.")
            return int(text)
        return Path(text) if {*self.kinds} == {str, Path} else text

    def _pairs(self, texts: list[str]) -> object:
        """`a=1,b=2,3` as values: a comma before `key=` begins the next one. "none" stands for no pair."""
        assert self.mapping is not None
        if texts == ["none"]:
            return {}
        if float in self.kinds and "=" not in "".join(texts):
            try:
                return float(texts[-1])
            except ValueError:
                raise UsageError(f"{self.flag}: expected {self.metavar}, got {texts[-1]!r}.") from None
        stray, values = split_tokens([t for text in texts for t in re.split(r",(?=\s*[\w\[\]]+\s*=)", text)])
        if stray or not values:
            raise UsageError(f"{self.flag}: expected {self.metavar}, got {', '.join(texts)!r}.")
        if str not in self.mapping:  # a single value is none of its kinds
            return {key: self._axis(key, value) for key, value in values.items()}
        return values

    def _axis(self, key: str, value: Written) -> Range | tuple[float, ...]:
        if isinstance(value, Range):
            return value
        if isinstance(value, tuple) and not any(isinstance(x, str) for x in value):
            return tuple(map(float, value))
        raise UsageError(f"{self.flag} {key}: expected a range such as {key}=80mm:120mm:9, or a list of values.")


@dataclass(frozen=True)
class Route:
    """A function of the API that a verb leads to: its name, the switch that chooses it ("" for the usual one), its options by
    flag, and whether an option that it alone has chooses it too."""

    name: str
    function: Callable[..., object]
    switch: str
    options: dict[str, Option]
    implied: bool = False

    @property
    def parameters(self) -> Mapping[str, inspect.Parameter]:
        """The parameters of the function."""
        return inspect.signature(self.function).parameters

    @property
    def task_names(self) -> tuple[str, ...]:
        """The words that a parameter `task` takes."""
        return get_args(_hint(self.function, self.parameters["task"]))


def routes_of(name: str, verb: Verb, api: object) -> list[Route]:
    """The functions of `api` that a verb can lead to, the usual one first."""

    def route(function: str, switch: str, flags: Mapping[str, str], implied: bool = False) -> Route:
        found = getattr(api, function)
        return Route(function, found, switch, {o.flag: o for o in options_of(found, flags)}, implied)

    others = [route(s.function, flag, dict(verb.flags) | dict(s.flags), s.implied) for flag, s in verb.switches.items()]
    return [route(verb.function or name, "", verb.flags), *others]


class Parser(argparse.ArgumentParser):
    """An ArgumentParser that raises UsageError instead of ending the process, so that --json can answer. examples: commands that
    its help ends with."""

    examples: tuple[str, ...] = ()

    def error(self, message: str) -> NoReturn:
        """Raise UsageError with the usage line and where to read more."""
        usage = " ".join(self.format_usage().split())
        raise UsageError(f"{message}. {usage[0].upper()}{usage[1:]}. More: {self.prog} --help.")

    def refuse_unknown(self, arguments: Sequence[str]) -> None:
        """Raise UsageError that suggests the nearest name for a word --LIKE-THIS that is no option; argparse only lists such words."""
        known = {name for action in self._actions for name in action.option_strings}
        for word in arguments:
            name = word.partition("=")[0]
            if name.startswith("--") and name != "--" and name not in known:
                raise UsageError(f"{unknown('the option', name, known)} More: {self.prog} --help.")

    def format_help(self) -> str:
        """The help, and below it the examples, a line each."""
        return super().format_help() + "\nexamples:\n" + "".join(f"  {line}\n" for line in self.examples)

    def print_help(self, file: object = None) -> None:
        """Print the help as every other answer."""
        write(self.format_help().rstrip())


def parser_of(name: str, verb: Verb, routes: Sequence[Route]) -> Parser:
    """The parser of a verb: names and key=value tokens, the options of its functions, the switches between these."""
    parser = Parser(
        prog=f"mechlab {name}",
        usage=f"mechlab {name} {verb.usage} [options]".replace("  ", " "),
        description=verb.text,
        epilog="Numbers are SI; 37deg, 5mm, 300rpm, 17/22, lists a,b,c and ranges lo:hi or lo:hi:n are "
        "understood. Options may stand anywhere among the key=value pairs.",
        allow_abbrev=False,
        argument_default=argparse.SUPPRESS,
    )
    parser.examples = EXAMPLES[name]
    parser.add_argument("tokens", nargs="*", default=[], metavar="NAME key=value", help=argparse.SUPPRESS)
    parser.add_argument("--json", action="store_true", help="print exactly one JSON document, also on failure")
    one_of = parser.add_mutually_exclusive_group()
    flags = flags_of(routes)
    seen: set[str] = set()
    for route in routes:
        about = ""
        if route.switch:
            switch = verb.switches[route.switch]
            value: dict[str, Any] = {"metavar": switch.metavar} if switch.metavar else {"action": "store_true"}
            parser.add_argument(route.switch, dest=route.switch, help=switch.text, **value)
            about = "" if route.implied else f"with {route.switch}: "
        for flag, option in route.options.items():
            if flag in seen:
                continue
            seen.add(flag)
            how: dict[str, Any] = {"action": "store_true"} if option.is_flag else {"metavar": option.metavar or "X"}
            if option.metavar.startswith("["):  # its value may be left out
                how |= {"nargs": "?", "const": "all", "metavar": option.metavar.strip("[]")}
            if option.repeated:
                how["action"] = "append"
            text = with_flags(about + option.help, flags).replace("%", "%%")
            group = one_of if option.keyword in verb.either else parser
            group.add_argument(flag, dest=flag, required=option.keyword in verb.required, help=text, **how)
    return parser


def flags_of(routes: Sequence[Route]) -> dict[str, str]:
    """Keyword -> flag of all options of a verb."""
    return {option.keyword: flag for route in reversed(routes) for flag, option in route.options.items()}


def chosen(routes: Sequence[Route], given: Mapping[str, object]) -> tuple[Route, dict[str, object]]:
    """The function that the given options ask for, and its keywords. Raises UsageError for options that do not go together."""
    usual = routes[0]
    route = next(
        (
            r
            for r in routes[1:]
            if r.switch in given or (r.implied and given.keys() & r.options.keys() - usual.options.keys())
        ),
        usual,
    )
    strange = [flag for flag in given if flag not in route.options and flag != route.switch]
    if strange and route is usual:
        owner = next(r.switch for r in routes if strange[0] in r.options)
        raise UsageError(f"{strange[0]} belongs to {owner}: add it.")
    if strange:
        raise UsageError(f"{route.switch} does not go with {', '.join(strange)}.")
    keywords = {o.keyword: _read(o, given[f]) for f, o in route.options.items() if f in given}
    for option in route.options.values():
        if option.default is inspect.Parameter.empty and option.keyword not in keywords:
            raise UsageError(f"{route.switch} needs {option.flag}.")
    return route, keywords


def _read(option: Option, value: Any) -> object:
    if value in ([], [[]]):  # argparse makes this of `--key=--`
        raise UsageError(f"{option.flag} needs a value.")
    return value if option.is_flag else option.read(value)


def options_of(function: Callable[..., object], flags: Mapping[str, str]) -> list[Option]:
    """The options of a function of the API, in the order of its signature. flags: keywords with another name."""
    entries = _entries(inspect.getdoc(function) or "")
    out = []
    for name, parameter in inspect.signature(function).parameters.items():
        if name in SUBJECTS or name in NOT_OPTIONS or parameter.kind is parameter.VAR_KEYWORD:
            continue
        kinds = _members(_hint(function, parameter))
        metavar, text = entries.get(name, ("", ""))
        flag = flags.get(name) or ("-o" if name == "out" else f"--{name.replace('_', '-')}")
        out.append(Option(name, flag, kinds, parameter.default, metavar, text))
    return sorted(out, key=lambda option: option.flag == "-o")


def _hint(function: Callable[..., object], parameter: inspect.Parameter) -> Any:
    """The type of a parameter, as far as its names exist without the packages that only type checkers import."""
    return eval(parameter.annotation, {"__builtins__": {}}, _Names(inspect.unwrap(function).__globals__))


class _Names(dict[str, Any]):
    """The names of a module; one that only type checkers import stands for some object."""

    def __missing__(self, name: str) -> Any:
        return getattr(builtins, name, object)


def _members(hint: Any) -> tuple[Any, ...]:
    """The members of a union without None."""
    if get_origin(hint) in (Union, UnionType):
        return tuple(m for part in get_args(hint) for m in _members(part) if m is not type(None))
    return (hint,)


def _list_of(kind: Any) -> Any:
    """What a list or tuple holds; None for every other kind."""
    return get_args(kind)[0] if get_origin(kind) in (Sequence, tuple) else None


def _entries(doc: str) -> dict[str, tuple[str, str]]:
    """Keyword -> (metavar, help) of the entries below "Options:"."""
    out: dict[str, tuple[str, str]] = {}
    last = ""
    for line in doc.partition("Options:\n")[2].split("\n"):
        if not line.startswith("    "):
            break
        found = ENTRY.fullmatch(line.strip())
        if found and not line.startswith("     "):
            last = found[1]
            out[last] = found[2] or "", found[3]
        else:
            out[last] = out[last][0], f"{out[last][1]} {line.strip()}"
    return out
