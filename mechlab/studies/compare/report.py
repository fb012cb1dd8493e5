"""How a comparison is printed, and its files: a page (.html), a table (.csv), data (.json)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from html import escape
from pathlib import Path

from mechlab.errors import MechlabError
from mechlab.files import write
from mechlab.results import html_of, line_of, save_result, text_of
from mechlab.studies.compare.chart import svg
from mechlab.studies.compare.result import Column, Comparison, Row
from mechlab.tables import csv_text, number, table

FORMATS = (".html", ".csv", ".json")
STYLE = """
:root { color-scheme: light dark; --ink: #1c2430; --soft: #566070; --line: #dde2e9; --paper: #fff; --panel: #f6f8fa; --accent: #1b5e9e;
  --best: #e3f2e6; --c0: #0072b2; --c1: #d55e00; --c2: #009e73; --c3: #a64d79; --c4: #3b3b3b; --c5: #8f6f00; --c6: #5b3fb0;
  --c7: #b22234; --c8: #1f7a8c; --c9: #6b8e23; --c10: #a0522d; --c11: #4a6fa5; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6ebf2; --soft: #a3aebd; --line: #364150; --paper: #1a212b; --panel: #12171e;
  --accent: #7fb8f0; --best: #1e4029; --c0: #56b4e9; --c1: #ff9248; --c2: #3fd0a3; --c3: #e08cb8; --c4: #d5d9e0; --c5: #e6c84a;
  --c6: #b39cff; --c7: #ff7d8a; --c8: #6fd0e0; --c9: #b6d96a; --c10: #dfa27f; --c11: #9dbbe8; } }
* { box-sizing: border-box; }
body { margin: 0; padding: 28px clamp(14px, 4vw, 56px) 56px; font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans",
  sans-serif; color: var(--ink); background: var(--panel); overflow-wrap: break-word; }
main { max-width: 1080px; margin: 0 auto; }
h1 { margin: 0 0 8px; font-size: 28px; line-height: 1.2; }
main > p { max-width: 75ch; }
a { color: var(--accent); }
.wide { overflow-x: auto; }
.table { margin: 18px 0; background: var(--paper); border: 1px solid var(--line); border-radius: 10px; }
table { border-collapse: collapse; width: 100%; font-size: 14px; font-variant-numeric: tabular-nums; }
th, td { padding: 7px 12px; border-top: 1px solid var(--line); text-align: right; vertical-align: top; }
tr:first-child th { border-top: 0; }
th { font-weight: 600; color: var(--soft); min-width: 6em; }
th small { display: block; font-weight: 400; }
th:first-child, td:first-child { position: sticky; left: 0; background: var(--paper); text-align: left; min-width: 9em; }
td small { display: block; color: var(--soft); }
td.best { background: var(--best); font-weight: 600; }
figure { margin: 22px 0; padding: 16px 18px; background: var(--paper); border: 1px solid var(--line); border-radius: 10px; }
figcaption { font-size: 18px; font-weight: 600; margin-bottom: 6px; }
.chart { display: block; width: 100%; min-width: 460px; font-size: 12.5px; }
.chart text { fill: var(--soft); } .chart .label { fill: var(--ink); }
.grid { stroke: var(--line); fill: none; }
.curve { fill: none; stroke-width: 2; stroke-linejoin: round; }
.key { display: flex; flex-wrap: wrap; gap: 4px 18px; margin: 10px 0 0; padding: 0; list-style: none; font-size: 14px; }
.key svg { width: 30px; height: 8px; margin-right: 6px; }
dl { font-size: 14px; } dt { font-weight: 600; } dd { margin: 0 0 8px; max-width: 75ch; }
"""


@line_of.register
def _(result: Comparison) -> str:
    return result.message


def heading(column: Column) -> str:
    """Heading with the unit."""
    return f"{column.heading} [{column.unit}]" if column.unit else column.heading


@text_of.register
def _(result: Comparison) -> str:
    rows = [(_design(r), *(number(r.values[c.key], 4) for c in result.columns)) for r in result.rows]
    worst = max((r.difference for r in result.rows), default=0.0)
    notes = [f"The witnesses differ by at most {number(worst, 2)} (N, N m, m/s2, rad/s2) along the way."]
    notes += [f"Not compared: {', '.join(result.skipped)} (no path with one drive and such a point)."] if result.skipped else []
    return "\n".join([result.question, "", table(("", *map(heading, result.columns)), rows), "", *notes])


@html_of.register
def _(result: Comparison) -> str:
    return _table(result, {}) + "".join(svg(p) for p in result.panels)


@save_result.register
def _(result: Comparison, path: Path) -> Path:
    """A page, a table or data by the ending; on a page a mechanism is linked where NAME/explore.html stands beside it."""
    if path.suffix == ".html":
        links = {r.name: f"{r.name}/explore.html" for r in result.rows if (path.parent / r.name / "explore.html").is_file()}
        return write(path, page(result, links))
    if path.suffix == ".csv":
        rows = [(r.title, *("" if (x := r.values[c.key]) is None else repr(x) for c in result.columns)) for r in result.rows]
        return write(path, csv_text([("mechanism", *map(heading, result.columns)), *rows]))
    if path.suffix == ".json":
        return write(path, json.dumps(result.to_dict(), indent=1) + "\n")
    raise MechlabError(f"compare: {path} has none of the endings {', '.join(FORMATS)}.")


def page(result: Comparison, links: Mapping[str, str]) -> str:
    """The comparison as a page of its own, without scripts. links: name -> address of the page of a mechanism."""
    title = escape(result.question)
    meanings = "".join(f"<dt>{escape(heading(c))}</dt><dd>{escape(c.text)}.</dd>" for c in result.columns)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n"
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n<meta name="color-scheme" content="light dark">\n'
        f"<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n"
        + "".join(f"<p>{escape(p)}</p>\n" for p in result.about)
        + _table(result, links)
        + "\n".join(svg(p) for p in result.panels)
        + f"\n<h2>What the columns say</h2>\n<dl>{meanings}</dl>\n"
        f"<p>Made by <code>mechlab compare {escape(result.kind)}</code>. To turn one: <code>mechlab view NAME</code>.</p>\n"
        "</main>\n</body>\n</html>\n"
    )


def _design(row: Row) -> str:
    changed = ", ".join(f"{k} = {number(x, 4)}" for k, x in row.changed.items())
    return f"{row.title}, {changed}" if changed else row.title


def _table(result: Comparison, links: Mapping[str, str]) -> str:
    head = "".join(
        f'<th title="{escape(c.text, quote=True)}">{escape(c.heading)}<small>{escape(c.unit)}</small></th>' for c in result.columns
    )
    best = {c.key: result.best(c) for c in result.columns}
    body = []
    for row in result.rows:
        title = escape(row.title)
        title = f'<a href="{escape(links[row.name], quote=True)}">{title}</a>' if row.name in links else title
        small = ", ".join(f"{k} = {number(x, 4)}" for k, x in row.changed.items())
        cells = [f"<td>{title}<small>{escape(row.name)}{escape(': ' + small) if small else ''}</small></td>"]
        for c in result.columns:
            value = row.values[c.key]
            mark = ' class="best"' if value is not None and value == best[c.key] else ""
            cells.append(f"<td{mark}>{escape('–' if value is None else number(value, 4))}</td>")
        body.append(f"<tr>{''.join(cells)}</tr>")
    return f'<div class="table wide"><table><tr><th>Mechanism</th>{head}</tr>{"".join(body)}</table></div>\n'
