"""The words for the TAB key: a shell function, made from the verbs, their options and the names of the catalog."""

from __future__ import annotations

from mechlab.cli.options import routes_of
from mechlab.cli.verbs import VERBS

SCRIPT = """# mechlab: completion for bash, and for zsh
[ -n "$ZSH_VERSION" ] && autoload -U +X bashcompinit && bashcompinit
_mechlab() {{
    local word="${{COMP_WORDS[COMP_CWORD]}}" before="${{COMP_WORDS[COMP_CWORD-1]}}" words="{verbs}"
    if [ "$COMP_CWORD" -gt 1 ]; then
        case "${{COMP_WORDS[1]}} $before" in
{choices}
        *) case "${{COMP_WORDS[1]}}" in
{options}
            esac
            case "$word" in -*) ;; *) words="$words {names}" ;; esac ;;
        esac
    fi
    COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _mechlab mechlab"""


def script() -> str:
    """A script for bash and zsh; `source <(mechlab --completion)` makes the TAB key know mechlab."""
    from mechlab import api, catalog

    options, choices = [], []
    for name, verb in VERBS.items():
        routes = routes_of(name, verb, api)
        flags = dict.fromkeys(
            [*(f for r in routes for f in r.options), *(r.switch for r in routes[1:]), "--json", "--help"]
        )
        options.append(f'            {name}) words="{" ".join(flags)}" ;;')
        for option in routes[0].options.values():
            if option.choices:
                choices.append(f'        "{name} {option.flag}") words="{" ".join(option.choices)}" ;;')
    return SCRIPT.format(
        verbs=" ".join(VERBS), choices="\n".join(choices), options="\n".join(options), names=" ".join(catalog.NAMES)
    )
