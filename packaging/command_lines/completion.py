"""Completions for bash of command lines as collect.py gives them."""

import shlex

FILE_TYPES = ("TEXT", "FILE", "DIR", "PATH", "FOLDER", "OUT", "MODEL")
NUMBER, FILE = "@nothing", "@file"

BODY = """\
  local current="${COMP_WORDS[COMP_CWORD]}" previous="${COMP_WORDS[COMP_CWORD-1]}" at=. word
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    if [[ -n $word && " ${verbs[$at]-} " == *" $word "* ]]; then at+=" $word"; fi
  done
  COMPREPLY=()
  word="${values["$at $previous"]-}"
  if [[ $word == @nothing ]]; then
    compopt +o default 2>/dev/null
  elif [[ -n $word && $word != @file ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$word" -- "$current")
  elif [[ -z $word && $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "${options[$at]-}" -- "$current")
  elif [[ -z $word && -n ${verbs[$at]-} ]]; then
    mapfile -t COMPREPLY < <(compgen -W "${verbs[$at]}" -- "$current")
  fi
"""


def value_of(option):
    """What is offered as a value: words, files or nothing."""
    kind, _, check = option["type"].partition(":")
    if check.startswith("{"):
        return check.strip("{}").replace(",", " ")
    return FILE if "." in kind or kind.strip("=[]") in FILE_TYPES else NUMBER


def tables(command, at, above, verbs, options, values):
    """Fills the three tables of a completion: by the verbs that lead there, '.' at the top."""
    own = command["options"] + above
    named = [o for o in own if not o["positional"]]
    options[at] = " ".join(dict.fromkeys(name for o in named for name in o["names"]))
    for option in named:
        for name in option["names"] if option["values"] else ():
            values[f"{at} {name}"] = value_of(option)
    if command["subcommands"]:
        verbs[at] = " ".join(sub["name"] for sub in command["subcommands"])
    for sub in command["subcommands"]:
        handed_on = sub.get("above") or (own if sub["falls_through"] else [])
        tables(sub, f"{at} {sub['name']}", handed_on, verbs, options, values)


def completion(command):
    """A file that bash-completion loads for the command of that name."""
    verbs, options, values = {}, {}, {}
    tables(command, ".", command["above"], verbs, options, values)
    name = command["name"]
    function = "_" + name.replace("-", "_")
    lines = [f"# Completion of {name} in bash, made from its command line.", f"{function}() {{"]
    for table, entries in (("verbs", verbs), ("options", options), ("values", values)):
        lines.append(f"  local -A {table}=(")
        lines += [f"    [{shlex.quote(key)}]={shlex.quote(value)}" for key, value in entries.items()]
        lines.append("  )")
    return "\n".join(lines) + "\n" + BODY + "}\n" + f"complete -o default -F {function} {name}\n"
