"""One spelling: British with -ize (Oxford), in comments, docstrings, messages, pages and Markdown. Names of code are left alone, and so are
phrases that are names themselves (KEPT). What is misspelled in every English is codespell's work (`.pre-commit-config.yaml`)."""

import io
import json
import re
import tokenize
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

STEMS = {
    # stem: (ours, endings); an ending of its own where the stem changes with it
    **{stem: (stem[:-2] + "our", "s|ed|ing|ful|less|able|hood") for stem in (
        "armor behavior color discolor endeavor favor flavor harbor honor humor labor neighbor odor rumor vapor vigor".split()
    )},
    **{stem: (stem + "l", "ed|ing|er|ers") for stem in (
        "bevel cancel channel counsel dial fuel funnel label level marvel model pedal remodel signal spiral swivel travel tunnel".split()
    )},
    **{stem: (stem[:-2] + "re", "s") for stem in (
        "caliber center centimeter epicenter fiber kilometer liter luster meter micrometer millimeter nanometer specter theater".split()
    )},
    **{stem: (ours, "s|al|ed|ing|ly|ness|or|ic|ically") for stem, ours in {
        "acknowledgment": "acknowledgement", "aluminum": "aluminium", "analog": "analogue", "artifact": "artefact", "defense": "defence",
        "fulfill": "fulfil", "gage": "gauge", "gray": "grey", "judgment": "judgement", "maneuver": "manoeuvre", "mold": "mould",
        "offense": "offence", "plow": "plough", "skeptic": "sceptic", "skillful": "skilful", "sulfur": "sulphur", "toward": "towards",
        "counterclockwise": "counter-clockwise",
    }.items()},
    "centered": ("centred", ""), "centering": ("centring", ""), "recenter": ("recentre", "s|d"),
}  # fmt: skip
NEVER_BARE = {stem for stem, (ours, _) in STEMS.items() if ours == stem + "l"}
"""`label` is right, `labeled` is not."""
KEPT_ISE = set(
    "advis appris apprais bruis chastis clockwis compris compromis concis demis despis devis disguis enterpris equipois excis exercis "
    "expertis franchis imprecis improvis incis likewis merchandis nonis otherwis paradis prais precis premis promis revis stepwis supervis "
    "surmis surpris televis treatis unrais bitwis lengthwis piecewis pairwis elementwis columnwis rowwis anticlockwis edgewis".split()
)
"""What stands before -e, -ed, -ing ... in words that end in -ise in every English."""
ISE = re.compile(r"(?P<stem>[a-z]+is)(?P<ending>e|es|ed|er|ers|ing|able|ation|ations|ational)")
YZE = re.compile(r"(anal|paral|catal|hydrol|electrol)yz(e|es|ed|er|ers|ing)")
AMERICAN = re.compile(
    "|".join(
        rf"(?P<s{k}>{stem})(?P<e{k}>{endings}){'' if stem in NEVER_BARE else '?'}" for k, (stem, (_, endings)) in enumerate(STEMS.items())
    )
)
KEPT = re.compile(
    r"(soft|stiff) stabilisation"  # names of methods
    r"|flow meters?"  # instruments
    r"|outside upper center|upper center"  # matplotlib's places
    r"|color-scheme|prefers-color-scheme|(align-items|place-items|align-self|justify-content|text-align): center"  # CSS
    r"|upload-artifact",
    re.IGNORECASE,
)
WORD = re.compile(r"(?<![\w./\\#@$%&=])(?<!--)[A-Za-z]{4,}(?![\w(=\\/]|\.\w)")
HIDDEN = (KEPT, re.compile(r"`[^`\n]*`"), re.compile(r"https?://\S+"))
TAGS = re.compile(r"</?[a-z!][^<>]*>", re.IGNORECASE)
BRACES = re.compile(r"\{[^{}]*\}")


@cache
def british(word: str) -> str:
    """The word in our spelling: itself where it is right."""
    lower = word.lower()
    ours = lower
    if match := AMERICAN.fullmatch(lower):
        stem = next(name for name, text in match.groupdict().items() if name[0] == "s" and text)
        ending = match[f"e{stem[1:]}"] or ""
        ours = STEMS[match[stem]][0]
        ours = ours if ours.endswith("s") and ending == "s" else ours + ending
    elif (match := ISE.fullmatch(lower)) and match["stem"] not in KEPT_ISE and len(match["stem"]) > 4:
        ours = match["stem"][:-1] + "z" + match["ending"]
    elif match := YZE.fullmatch(lower):
        ours = f"{match[1]}ys{match[2]}"
    if ours == lower:
        return word
    return ours if word.islower() else ours.capitalize()


def blanked(text: str, *patterns: re.Pattern[str], by: str = "_") -> str:
    """The text with what the patterns match replaced by as many characters, so that places stay."""
    for pattern in patterns:
        text = pattern.sub(lambda match: re.sub(r"[^\n]", by, match[0]), text)
    return text


def wrong_words(text: str, named: bool = False) -> Iterator[tuple[int, str, str]]:
    """Places of words in another spelling, the words, and ours. named: arguments before a colon, or last behind one, are names."""
    seen = blanked(blanked(text, *HIDDEN), TAGS, by=" ")
    for match in WORD.finditer(seen):
        word, after = match[0], seen[match.end() : match.end() + 1]
        before = seen[match.start() - 1 : match.start()]
        if word.islower() and before and before in "'\"" and after in ("'", '"'):
            continue
        if named and (after == ":" or (seen[: match.start()].endswith(": ") and after in ("'", '"'))):
            continue
        if word[1:].islower() and british(word) != word:
            yield match.start(), word, british(word)


def python_prose(source: str) -> Iterator[tuple[int, str]]:
    """Places and texts of comments and of strings with prose, without what stands in braces."""
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        kind = tokenize.tok_name[token.type]
        if kind not in ("COMMENT", "STRING", "FSTRING_MIDDLE"):
            continue
        at = starts[token.start[0] - 1] + token.start[1]
        text = source[at : starts[token.end[0] - 1] + token.end[1]]
        if kind == "COMMENT" or is_prose(text):
            yield at, without_braces(text) if kind != "COMMENT" else text


def is_prose(text: str) -> bool:
    """More than one word, or one that begins with a capital letter; other strings are names."""
    return re.search(r"\S\s+\S|^\W?[A-Z][a-z]", text) is not None


def without_braces(text: str) -> str:
    """Fields of f-strings, rules of style sheets, blocks of scripts: innermost braces first."""
    while BRACES.search(text):
        text = blanked(text, BRACES)
    return text


SCRIPT = re.compile(r"""//[^\n]*|/\*.*?\*/|"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*'|`(?:[^`\\]|\\.)*`""", re.DOTALL)


def script_prose(source: str) -> Iterator[tuple[int, str]]:
    """Comments and strings with prose of JavaScript and CSS."""
    for match in SCRIPT.finditer(source):
        text = match[0]
        if text.startswith("/"):
            yield match.start(), text
        elif is_prose(text):
            yield match.start(), without_braces(text).replace("`", "'")


FENCE = re.compile(r"^(?P<fence>`{3,})[^\n]*\n.*?^(?P=fence)[ ]*$", re.MULTILINE | re.DOTALL)


def markdown_prose(source: str) -> Iterator[tuple[int, str]]:
    """All but fenced blocks and targets of links; of fenced blocks the comments."""
    yield 0, blanked(source, FENCE, re.compile(r"\]\([^)]*\)"))
    for block in FENCE.finditer(source):
        for comment in re.finditer(r"# [^\n]*", block[0]):
            yield block.start() + comment.start(), comment[0]


def page_prose(source: str) -> Iterator[tuple[int, str]]:
    """The visible words of a page."""
    yield 0, blanked(source, re.compile(r"<(style|script)\b.*?</\1>", re.DOTALL | re.IGNORECASE))


READERS = {
    ".py": python_prose, ".js": script_prose, ".css": script_prose, ".md": markdown_prose, ".html": page_prose,
    ".yml": markdown_prose, ".cff": markdown_prose,
}  # fmt: skip
FILES = sorted(
    path
    for part in ("*.md", "*.cff", ".github/**/*.*", "mechlab/**/*.*", "docs/**/*.*", "examples/*.*", "tests/**/*.*", "assets/lessons/*.*")
    for path in ROOT.glob(part)
    if path.suffix in (*READERS, ".ipynb") and "generated" not in path.parts
)


def findings(path: Path) -> list[tuple[int, str, str]]:
    """Offsets in the file, words and ours."""
    source = path.read_text(encoding="utf-8")
    if all(british(word) == word for word in set(re.findall(r"[A-Za-z]?[a-z]{3,}", source))):  # most files: no prose need be looked for
        return []
    if path.suffix == ".ipynb":
        cells = ["".join(cell["source"]) for cell in json.loads(source)["cells"] if cell["cell_type"] == "markdown"]
        return [found for cell in cells for _, text in markdown_prose(cell) for found in wrong_words(text)]
    named = path.suffix in (".py", ".js", ".css")
    return [(at + place, word, ours) for at, text in READERS[path.suffix](source) for place, word, ours in wrong_words(text, named)]


def test_one_spelling_throughout() -> None:
    assert len(FILES) > 1000
    wrong = []
    for path in FILES:
        if path == Path(__file__).resolve():
            continue
        for place, word, ours in findings(path):
            line = path.read_text(encoding="utf-8").count("\n", 0, place) + 1
            wrong.append(f"{path.relative_to(ROOT)}:{line}: {word}: write {ours}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    ("word", "ours"),
    [
        ("color", "colour"), ("Neighbors", "Neighbours"), ("center", "centre"), ("centered", "centred"), ("centers", "centres"),
        ("labeled", "labelled"), ("label", "label"), ("modeling", "modelling"), ("analyzed", "analysed"), ("toward", "towards"),
        ("towards", "towards"), ("linearise", "linearize"), ("Optimisation", "Optimization"), ("generalised", "generalized"),
        ("gray", "grey"), ("millimeters", "millimetres"), ("behavior", "behaviour"),
        *((right, right) for right in "raised otherwise precise clockwise noise promises parameter analysis bases size colour".split()),
    ],
)  # fmt: skip
def test_words_have_one_spelling(word: str, ours: str) -> None:
    """Against the Oxford spelling of these words."""
    assert british(word) == ours


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.py", '"""Optimises x."""\ncolor = 1  # its color\n', ["Optimises", "color"]),
        ("a.py", 'raise E(f"{color}: the behavior of {center}")\n', ["behavior"]),
        ("a.py", '"""A `color` of COLORS.\n\n    color: red, or `center`; x.color, color=1.\n    """\nd = {"color": "center"}\n', []),
        ("a.md", "The color.\n\n```python\ncolor = 1  # the gray one\n```\n[x](center.md) `color`\n", ["color", "gray"]),
        ("a.js", 'const color = "center"; // toward\nsay("its color " + x, `normalised ${color} x`);', ["toward", "color", "normalised"]),
        ("a.html", '<p style="color: red">its color</p><style>p { color: red }</style>', ["color"]),
    ],
)  # fmt: skip
def test_prose_is_read_and_names_are_not(name: str, text: str, words: list[str], tmp_path: Path) -> None:
    """Each text has the wrong words that are listed, and names beside them."""
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    assert sorted(word for _, word, _ in findings(path)) == sorted(words)
