"""How a design, its description and files are printed."""

from __future__ import annotations

from mechlab.lab.design import AtFidelity, Design
from mechlab.lab.results import FilesResult
from mechlab.lab.sheet import Description, describe_design
from mechlab.results import html_of, line_of, text_of
from mechlab.tables import counted, html_sheet, table


@line_of.register
def _(design: Design) -> str:
    given = ", ".join(f"{k}={v}" for k, v in design.given.items())
    return f"Design of {design.name}: {design.entry.title}{f' with {given}' if given else ''}"


@text_of.register
def _(design: Design) -> str:
    return text_of(describe_design(design))


@text_of.register
def _(at: AtFidelity) -> str:
    return text_of(describe_design(at.design, at.fidelity))


@html_of.register
def _(design: Design) -> str:
    return html_of(describe_design(design))


@line_of.register
def _(description: Description) -> str:
    return f"Description of {description.title}"


@text_of.register
def _(description: Description) -> str:
    d = description
    tables = (f"\n{name}\n{table(headers, rows)}" for name, (headers, rows) in d.tables.items())
    return "\n".join([d.title, "=" * len(d.title), *d.sentences, *tables])


@html_of.register
def _(description: Description) -> str:
    return html_sheet(description.title, description.sentences, description.tables)


@line_of.register
def _(files: FilesResult) -> str:
    return f"{counted(len(files.files), 'file')} in {files.folder}"


@text_of.register
def _(files: FilesResult) -> str:
    parts = [table(["what", "file"], [[kind, str(path)] for kind, path in files.files.items()])]
    if files.sentence:
        parts.append(files.sentence)
    return "\n".join([*parts, *(f"warning: {w}" for w in files.warnings)])
