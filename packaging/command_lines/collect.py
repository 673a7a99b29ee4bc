"""Command lines as data, which man pages and completions are made of: of a program what it tells of itself
(--describe-command-line, proto/records/command_line.h), of a word of ./grouser the same where it is a program's,
else its help text ("help") with the options and verbs that stand in it."""

import concurrent.futures
import json
import os
import pathlib
import re
import subprocess

VERB = re.compile(r"^ {2,4}([a-z][a-z-]+)(?: [a-z|]+)? {2,}\S", re.M)
# An option with its short name and its value, wherever it stands in a line; not --jobs-NAME, a family of them.
OPTION = re.compile(r"(?:(?<![\w-])(-\w)(?: [A-Z.]+)?, )?(?<![\w-])(--[a-z][a-z0-9]*(?:-[a-z0-9]+)*)(?![\w-])"
                    r"(?:[ =]([A-Z][A-Z_]*(?:[.=:|][\w.]+)*(?![\w])|\{[^}\s]+\}|[a-z]+(?:\|[a-z]+)+))?")
EXAMPLES = re.compile(r"^ *Examples?:.*?(?=\n\n|\Z)", re.M | re.S)  # they name options of other commands too
CASE = re.compile(r'^( *)case "\$\{1:-\}" in\n(.*?)^\1esac', re.M | re.S)
SAID = re.compile(r"^grouser: (--[a-z-]+) (\S+): (.*)", re.M)  # an option that the front door adds to a program's
WORD = re.compile(r"^  ([a-z]+) +(\S.*)$")


class Collector:
    """Of an installed tree: PREFIX/bin has programs, PREFIX/share/grouser the front door."""

    def __init__(self, prefix, home):
        self.prefix = pathlib.Path(prefix)
        self.root = self.prefix / "share" / "grouser"
        self.home = home
        self.env = {"PATH": "/usr/bin:/bin", "HOME": str(home), "MPLCONFIGDIR": str(home), "LC_ALL": "C.UTF-8",
                    "COLUMNS": "100", "GROUSER_ROOT": str(self.root)}

    def told(self, *command):
        """What a command says to --help, and to --describe-command-line where it knows that: (stdout, stderr)."""
        done = subprocess.run([*command, "--help", "--describe-command-line"], check=False, capture_output=True,
                              text=True, env=self.env, timeout=120, stdin=subprocess.DEVNULL)
        if done.returncode != 0:
            raise RuntimeError(f"{' '.join(map(str, command))} --help: exit code {done.returncode}\n{done.stderr}")
        return self.as_installed(done.stdout), self.as_installed(done.stderr)

    def as_installed(self, text):
        """Folders of this machine by those of an installation and its user; the front door by its name."""
        for here, there in ((str(self.root), "/usr/share/grouser"), (str(self.prefix), "/usr"), (str(self.home), "~"),
                            ("./grouser", "grouser")):
            text = text.replace(here, there)
        return text

    def program(self, name):
        text, _ = self.told(self.prefix / "bin" / name)
        if not text.startswith("{"):
            raise RuntimeError(f"{name}: expected that it tells its command line, got: {text[:200]}")
        return json.loads(text) | {"name": name}

    def words(self):
        """`grouser` with its words as subcommands."""
        text, _ = self.told(self.prefix / "bin" / "grouser")
        intro, _, rest = text.partition("\n\nUsage:")
        table = rest.split("\n\n")[1].splitlines()
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            words = list(pool.map(lambda line: self.word(*WORD.match(line).groups()), table))
        return {"name": "grouser", "program": "grouser", "path": [], "above": [], "text": " ".join(intro.split()),
                "footer": "", "falls_through": False, "options": [], "subcommands": words}

    def word(self, name, text):
        word = self.verb([name]) | {"text": text}
        known = {sub["name"] for sub in word["subcommands"]}
        further = [self.verb([name, verb]) for verb in self.own_verbs(name) if verb not in known]
        # What the word's program takes for an argument is no verb here.
        word["subcommands"] += [v for v in further if not v["program"] or (v["program"], v["path"]) !=
                                (word["program"], word["path"])]
        return word

    def own_verbs(self, word):
        """Verbs that the front door does not leave to a program."""
        for part in sorted((self.root / "cmake" / "frontdoor").glob("*.sh")):
            body = re.search(rf"^word_{word}\(\) \{{.*?^\}}", part.read_text(), re.M | re.S)
            if body:
                verbs = re.findall(r'"\$\{1:-\}" !?= (\w+)', body[0])
                for indent, arms in CASE.findall(body[0]):
                    for arm in re.findall(rf"^{indent}  ([a-z][a-z-]*(?: \| [a-z][a-z-]*)*)\)", arms, re.M):
                        verbs += arm.split(" | ")
                return list(dict.fromkeys(verbs))
        return []

    def verb(self, words, above=None):
        text, said = self.told(self.prefix / "bin" / "grouser", *words)
        added = [option([name], value, text) for name, value, text in SAID.findall(said)]
        if text.startswith("{"):
            command = json.loads(text)
            return command | {"name": words[-1], "added": added, "options": command["options"] + added}
        command = {"name": words[-1], "program": "", "path": [], "above": [], "text": "", "footer": "", "help": text,
                   "falls_through": False, "options": added, "subcommands": []}
        if words != ["help"]:  # which tells of the words, not of itself
            command["options"] = options_of(text) + added
        if text == above:  # the whole word's, again
            return command | {"help": "", "options": []}
        if len(words) == 1 and words != ["help"]:
            verbs = dict.fromkeys(VERB.findall(text))
            used = re.findall(rf"^(?:Usage:| {{7}}) *grouser {words[0]} ([a-z][a-z0-9-]*)(?=\s|$)", text, re.M)
            subs = [self.verb([*words, verb], text) for verb in verbs | dict.fromkeys(used)]
            # Lines of explanation look like verbs; only what has a help of its own, or stands in the usage, is one.
            command["subcommands"] = [sub for sub in subs if sub.get("help", "x") or sub["name"] in used]
        return command


def option(names, value, text=""):
    return {"names": names, "positional": False, "required": False, "text": text, "default": "", "type": value or "",
            "values": 1 if value else 0}


def options_of(text):
    """The options that stand in a help text, each once."""
    found = {}
    for short, name, value in OPTION.findall(EXAMPLES.sub("", text)):
        if value.startswith("{") or value[:1].islower():  # one of these words
            value = ":{" + value.strip("{}").replace("|", ",") + "}"
        one = found.setdefault(name, option([name], value))
        if value and not one["values"]:
            one |= {"type": value, "values": 1}
        if short and short not in one["names"]:
            one["names"].append(short)
    return list(found.values())
