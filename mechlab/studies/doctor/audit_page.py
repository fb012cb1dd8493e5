"""The page of an audit: one HTML file, a row a model, sorted and filtered without a library; readable without scripts, too."""

from __future__ import annotations

import re
from html import escape

from mechlab.studies.doctor.audit import VERDICTS, Audit, AuditRow
from mechlab.studies.doctor.ranking import CONSEQUENCES
from mechlab.tables import counted, number

MEANING = {
    "healthy": "nothing found that changes results",
    "to be known": "runs, and something about it matters for some uses",
    "do not trust": "results of the file as it is are wrong",
    "refused": "MuJoCo, or the reader, does not take the file",
    "not examined": "the examination did not end in time",
}
MARK = {"healthy": "ok", "to be known": "know", "do not trust": "bad", "refused": "stop", "not examined": "open"}
SIGN = {"ok": "\u2713", "know": "!", "bad": "\u2715", "stop": "\u2298", "open": "?"}
TITLES = {
    "beyond_range": "starts outside a joint's range",
    "control_beyond_range": "commands beyond a joint's range",
    "soft_equalities": "soft loops",
    "softer_than_it_could_be": "loops softer than they could be",
    "trial": "the run is off",
    "pushed": "off as soon as it is pushed",
    "memory": "the memory for contacts is full",
    "degrees": "angles in the wrong unit",
    "contacts": "parts overlap at the start",
    "refsafe": "softness below two timesteps",
    "gap": "the start is not assembled",
    "not_meshes": "meshes missing",
    "fixed_range": "joints without a range",
    "mimic": "mimic joints",
    "massless": "moving parts without mass or inertia",
    "triangle": "impossible inertias",
    "held_friction": "friction that does nothing",
    "refused": "not taken",
    "first_order": "integrator of first order",
    "sparse_jacobian": "sparse Jacobian",
    "freedoms_differ": "two counts of the freedoms",
    "pinocchio_reader": "other readers",
    "masses_changed": "masses changed by the compiler",
    "spins": "parts that spin freely",
    "mocap_weld": "dragged by a mocap body",
    "soft_friction": "soft dry friction",
}  # fmt: skip
"""Names of findings in words, where the name alone does not say it."""
_HEADS = (
    ("Model", "text"), ("Kind", "text"), ("Bodies", "number"), ("Freedoms", "number"), ("Loops", "number"), ("mechlab reads", "text"),
    ("Verdict", "number"), ("Gravest finding", "text"), ("CPU s", "number"),
)  # fmt: skip


def audit_page(audit: Audit, title: str = "Robot and mechanism models, examined") -> str:
    """The whole page."""
    heads = "".join(
        f'<th scope="col" aria-sort="none"><button type="button" data-kind="{kind}">{escape(name)}</button></th>' for name, kind in _HEADS
    )
    rows = "\n".join(_row(r) for r in audit.rows)
    engines = ", ".join(f"{k} {v}" for k, v in audit.versions.items())
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head><body><main>"
        f"<h1>{escape(title)}</h1>"
        f'<p class="lead">{len(audit.rows)} model files as their authors publish them: compiled by MuJoCo, freedoms and loops '
        "counted, every MJCF run for half a second as it is, against a run with hard loops, a quarter of the step and a better "
        "integrator. A part that is meant to be included by another file is judged as it stands alone.</p>"
        f"{_summary(audit)}"
        '<div class="tools"><label>Find <input id="find" type="search" placeholder="name, finding, licence"></label>'
        '<span id="shown" role="status"></span></div>'
        f'<table><caption class="hidden">Diagnoses</caption><thead><tr>{heads}</tr></thead><tbody>\n{rows}\n</tbody></table>'
        f"{_legend()}"
        f'<footer>Made by <code>mechlab doctor FOLDER -o audit.html</code>{f" with {escape(engines)}" if engines else ""}. '
        f"{audit.skipped} files that others include were not counted on their own. The licences are those of the sources; "
        "the files are not part of this page.</footer>"
        f"</main><script>{_SCRIPT}</script></body></html>\n"
    )


def _summary(audit: Audit) -> str:
    total = max(len(audit.rows), 1)
    order = [v for v in reversed(VERDICTS) if v in audit.counts]
    bar = "".join(f'<i class="{MARK[v]}" style="flex-grow:{audit.counts[v] / total:.4f}"></i>' for v in order)
    chips = "".join(
        f'<button type="button" class="chip {MARK[v]}" data-verdict="{v}" aria-pressed="false">'
        f"<span><b>{audit.counts[v]}</b> {SIGN[MARK[v]]} {v}</span><small>{MEANING[v]}</small></button>"
        for v in order
    )
    return f'<div class="bar" aria-hidden="true">{bar}</div><div class="chips">{chips}</div>'


def _row(r: AuditRow) -> str:
    short, mark = r.name.partition("/")[2] or r.name, MARK[r.verdict]
    severity, name, sentence = r.worst
    said = CONSEQUENCES.get(name, sentence) if r.verdict not in ("refused", "not examined") else _first(sentence)
    grave = f"<b>{escape(_words(name))}</b> {escape(said)}" if severity else '<span class="quiet">none</span>'
    reads = r.read + (f'<small>without {escape(", ".join(r.lost[:3]))}{_rest(len(r.lost) - 3)}</small>' if r.lost else "")
    cells = (
        ("Model", short.lower(), f'<b title="{escape(r.name)}">{escape(_title(short))}</b>{_origin(r, short)}'),
        ("Kind", r.kind, r.kind),
        ("Bodies", r.bodies, _count(r.bodies)),
        ("Freedoms", r.freedoms, _count(r.freedoms)),
        ("Loops", r.loops, _count(r.loops)),
        ("mechlab reads", r.read, reads),
        ("Verdict", VERDICTS.index(r.verdict), f'<span class="tag {mark}">{SIGN[mark]} {r.verdict}</span>'),
        ("Gravest finding", name, grave + _more(r)),
        ("CPU s", r.seconds, number(r.seconds, 2)),
    )  # fmt: skip
    words = " ".join([r.name, r.licence, r.verdict, *(f[1] for f in r.findings)]).lower()
    tds = "".join(
        f'<td data-label="{label}" data-sort="{escape("" if key is None else str(key))}">{cell}</td>' for label, key, cell in cells
    )
    return f'<tr data-verdict="{r.verdict}" data-words="{escape(words)}">{tds}</tr>'


def _origin(r: AuditRow, short: str) -> str:
    """The file, the collection it comes from, its licence."""
    source = _broken(r.collection.replace("+", "/"))
    return f"<small>{_broken(short.rpartition('/')[2])}</small><small>{source} \u00b7 {escape(r.licence or 'licence not found')}</small>"


def _words(name: str) -> str:
    """The name of a finding in words."""
    return f"{TITLES.get(name, name.replace('_', ' '))}:"


def _more(r: AuditRow) -> str:
    """Every finding of a row, folded away."""
    if not r.findings and not r.not_examined:
        return ""
    items = "".join(
        f'<li class="{severity}"><b>{severity}</b> {escape(_words(name))} {escape(sentence)}'
        f"{f' <em>So: {escape(CONSEQUENCES[name])}</em>' if name in CONSEQUENCES else ''}</li>"
        for severity, name, sentence in r.findings
    )
    items += "".join(f"<li><b>not examined</b> {escape(x)}</li>" for x in r.not_examined)
    items += f'<li class="note">{escape(r.name)}</li>'
    notes = sum(f[0] == "note" for f in r.findings)
    counts = [f"{len(r.findings) - notes} to act on"] * (len(r.findings) > notes) + [counted(notes, "note")] * (notes > 0)
    return f"<details><summary>{', '.join(counts) or 'more'}</summary><ul>{items}</ul></details>"


def _title(short: str) -> str:
    """The part of a path that tells the model: the file, or its folder where the file is called robot, scene or model."""
    parts = short.rpartition(".")[0].split("/")
    plain = {"robot", "scene", "model", "reach", "urdf", "robots", "mjcf", "xml"}
    useful = [p for p in reversed(parts) if p not in plain]
    return (useful[0] if useful else parts[-1]).replace("_", " ")


def _broken(name: str) -> str:
    """A name that may be broken where its words end."""
    return re.sub(r"([_/+-])", r"\1<wbr>", escape(name))


def _first(sentence: str) -> str:
    """The first half of a sentence, as much as fits two lines."""
    return sentence if len(sentence) <= 150 else f"{sentence[:147].rsplit(' ', 1)[0]} \u2026"


def _rest(count: int) -> str:
    return f" and {count} more kinds" if count > 0 else ""


def _count(value: int | None) -> str:
    return "\u2013" if value is None else str(value)


def _legend() -> str:
    rows = (
        ("Freedoms", "coordinates less the rank of the loops, counted at general poses; local ones, such as spinning rods, included."),
        ("Loops", "closures and couplings that act; ties to mocap bodies and within deformable bodies are none."),
        ("mechlab reads", "whole: nothing that acts on the motion is lost. In part: what is lost is named. Contacts, floors and meshes "
                          "are kept in a run of the file as it is."),
    )  # fmt: skip
    return "<dl>" + "".join(f"<dt>{a}</dt><dd>{b}</dd>" for a, b in rows) + "</dl>"


_STYLE = """
:root{--ink:#1d2330;--soft:#5b6474;--line:#e2e5ea;--paper:#fff;--back:#f6f7f9;--ok:#1b7f4b;--know:#9a6700;--bad:#c0262d;
--stop:#6b3fa0;--open:#5b6474}
@media(prefers-color-scheme:dark){:root{--ink:#e7eaf0;--soft:#9aa4b5;--line:#2c3340;--paper:#161a22;--back:#0f1218;--ok:#4cc38a;
--know:#e0b04a;--bad:#ff7b7b;--stop:#b794f6;--open:#9aa4b5}}
*{box-sizing:border-box}body{margin:0;background:var(--back);color:var(--ink);font:15px/1.5 system-ui,sans-serif}
main{max-width:1320px;margin:0 auto;padding:32px 24px 64px}h1{font-size:30px;line-height:1.2;margin:0 0 8px}
.lead{max-width:68ch;color:var(--soft);margin:0 0 20px}small{display:block;color:var(--soft);font-size:12px;overflow-wrap:break-word}
.bar{display:flex;gap:2px;height:10px;margin-bottom:12px}.bar i{border-radius:3px;min-width:4px}
.bar .ok{background:var(--ok)}.bar .know{background:var(--know)}.bar .bad{background:var(--bad)}.bar .stop{background:var(--stop)}
.bar .open{background:var(--open)}
.chips{display:flex;flex-wrap:wrap;gap:8px;margin-bottom:16px}
.chip{font:inherit;color:inherit;text-align:left;background:var(--paper);border:1px solid var(--line);border-radius:10px;
padding:8px 14px;cursor:pointer;display:flex;flex-direction:column}
.chip b{font-size:20px;margin-right:4px}.chip[aria-pressed=true]{outline:2px solid currentColor}
.ok{color:var(--ok)}.know{color:var(--know)}.bad{color:var(--bad)}.stop{color:var(--stop)}.open{color:var(--open)}
.tools{display:flex;gap:16px;align-items:baseline;margin-bottom:12px}.tools input{font:inherit;color:inherit;background:var(--paper);
border:1px solid var(--line);border-radius:8px;padding:6px 10px;width:min(320px,60vw)}#shown,.quiet{color:var(--soft)}
#shown{white-space:nowrap}
table{width:100%;border-collapse:separate;border-spacing:0;background:var(--paper);border:1px solid var(--line);border-radius:10px}
th{position:sticky;top:0;background:var(--paper);text-align:left;border-bottom:2px solid var(--line);padding:0;z-index:1}
th:first-child{border-top-left-radius:10px}th:last-child{border-top-right-radius:10px}
th button{font:inherit;font-weight:600;color:inherit;background:none;border:0;padding:10px 9px;cursor:pointer;width:100%;text-align:left;
white-space:nowrap}th[aria-sort=ascending] button:after{content:" \\2191"}th[aria-sort=descending] button:after{content:" \\2193"}
td{padding:10px 9px;border-bottom:1px solid var(--line);vertical-align:top}tbody tr:last-child td{border:0}
td:nth-child(1){min-width:210px}td:nth-child(6){max-width:160px}td:nth-child(8){width:46%}
td:nth-child(3),td:nth-child(4),td:nth-child(5),td:nth-child(9){text-align:right;font-variant-numeric:tabular-nums}
.tag{white-space:nowrap;font-weight:600}details{margin-top:4px}summary{cursor:pointer;color:var(--soft);font-size:13px}
ul{margin:6px 0 0;padding-left:18px;font-size:13px;overflow-wrap:anywhere}li{margin-bottom:4px}li.error>b{color:var(--bad)}
li.warning>b{color:var(--know)}li.note{color:var(--soft)}em{color:var(--soft)}
dl{max-width:80ch;margin:28px 0;display:grid;grid-template-columns:max-content 1fr;gap:6px 16px}
dt{font-weight:600}dd{margin:0;color:var(--soft)}
footer{color:var(--soft);font-size:13px}.hidden{position:absolute;width:1px;height:1px;overflow:hidden;clip-path:inset(50%)}
:focus-visible{outline:2px solid var(--stop);outline-offset:2px}[hidden]{display:none!important}
@media(max-width:820px){main{padding:20px 14px 48px}h1{font-size:24px}thead{display:none}table{border:0;background:none}
.chip{flex:1 1 140px}table,tbody,tr,td{display:block;width:100%!important}
tr{background:var(--paper);border:1px solid var(--line);border-radius:10px;padding:10px 14px;margin-bottom:12px}
td{border:0;padding:3px 0;text-align:left!important}td:before{content:attr(data-label) ": ";color:var(--soft)}
td:nth-child(1):before,td:nth-child(7):before,td:nth-child(8):before{content:none}
td:nth-child(3),td:nth-child(4),td:nth-child(5),td:nth-child(2){display:inline-block;width:auto!important;margin-right:14px}
td:nth-child(6){max-width:none}td:nth-child(6) small{display:inline;margin-left:6px}dl{display:block}dd{margin-bottom:10px}}
"""
_SCRIPT = """
const body=document.querySelector('tbody'),rows=[...body.rows],shown=document.getElementById('shown'),find=document.getElementById('find');
let verdict='';
function filter(){const words=find.value.toLowerCase().split(/\\s+/);let n=0;
for(const r of rows){const fits=(!verdict||r.dataset.verdict===verdict)&&words.every(w=>r.dataset.words.includes(w));r.hidden=!fits;n+=fits}
shown.textContent=n===rows.length?rows.length+' models':n+' of '+rows.length+' models'}
find.addEventListener('input',filter);
for(const chip of document.querySelectorAll('.chip'))chip.addEventListener('click',()=>{
verdict=verdict===chip.dataset.verdict?'':chip.dataset.verdict;
for(const c of document.querySelectorAll('.chip'))c.setAttribute('aria-pressed',c.dataset.verdict===verdict);filter()});
document.querySelectorAll('th').forEach((th,k)=>th.firstChild.addEventListener('click',()=>{
const up=th.getAttribute('aria-sort')!=='ascending',numeric=th.firstChild.dataset.kind==='number';
for(const other of document.querySelectorAll('th'))other.setAttribute('aria-sort','none');
th.setAttribute('aria-sort',up?'ascending':'descending');
const key=r=>{const x=r.cells[k].dataset.sort;return numeric?(x===''?-1:Number(x)):x};
rows.sort((a,b)=>{const x=key(a),y=key(b);return (x<y?-1:x>y?1:0)*(up?1:-1)});body.append(...rows)}));
filter();
"""
