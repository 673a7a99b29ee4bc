"""Manual pages (section 1) of command lines as collect.py gives them."""

import re


def escaped(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return re.sub(r"^([.'])", r"\\&\1", text, flags=re.M)


def block(text):
    """As it is typed."""
    return [".nf", escaped(text.strip("\n")), ".fi"]


def sentence(text):
    text = " ".join(text.split())
    return text if not text or text[-1] in ".:!?" else text + "."


def kind(option):
    """(name of the value, what else is known of it): of CLI11's TYPE:CHECK."""
    name, _, check = option["type"].partition(":")
    if check.startswith("{"):
        return check.strip("{}").replace(",", "|"), ""
    bounds = re.search(r"in (\[.*\])", check)
    return name, f"Within {bounds[1]}." if bounds else "" if check in ("", name) else f"Expected: {check}."


def option_lines(option):
    value, more = kind(option)
    if option["values"] > 1:
        value += " ..."
    names = ", ".join(f"\\fB{escaped(name)}\\fR" for name in option["names"])
    if option["positional"]:
        names = f"\\fI{escaped(option['names'][0])}\\fR"
    elif option["values"]:
        names += f" \\fI{escaped(value)}\\fR"
    text = [sentence(option["text"]), more]
    if option["default"] and "default:" not in option["text"]:
        text.append(f"Default: {option['default']}.")
    if option["required"]:
        text.append("Required.")
    return [".TP", names, escaped(" ".join(t for t in text if t)) or "\\&"]


def usage(command, name):
    words = [f"\\fB{escaped(name)}\\fR"]
    if any(not o["positional"] for o in command["options"]):
        words.append("[options]")
    words += [f"\\fI{escaped(o['names'][0])}\\fR" + (" ..." if o["values"] > 1 else "")
              for o in command["options"] if o["positional"]]
    if command["subcommands"]:
        words.append("\\fICOMMAND\\fR ...")
    return " ".join(words)


def subcommand_lines(command, name):
    """Of all below `command`. A footer that is the one above it is not said again."""
    lines = []
    for sub in command["subcommands"]:
        path = f"{name} {sub['name']}"
        lines += [f".SS {escaped(path)}", usage(sub, path), ".PP", escaped(sentence(sub["text"]))]
        for one in sub["options"]:
            lines += option_lines(one)
        if sub["footer"].strip() and sub["footer"] != command["footer"]:
            lines += [".PP", *block(sub["footer"])]
        lines += subcommand_lines(sub, path)
    return lines


def head(name, summary, version):
    return [f'.TH {escaped(name.upper())} 1 "" "Grouser {version}" "Grouser"', ".SH NAME",
            f"{escaped(name)} \\- {escaped(' '.join(summary.split()).rstrip('.'))}", ".SH SYNOPSIS"]


def tail(name, others):
    see = ", ".join(f"\\fB{escaped(other)}\\fR(1)" for other in others if other != name)
    return [".SH SEE ALSO", see] if see else []


def program_page(command, version, others):
    """Of a program: all options of it and of each of its subcommands."""
    name = command["name"]
    summary = re.split(r"(?<=\.)\s", command["text"].removeprefix(f"{name}: "))[0]
    lines = head(name, summary, version) + [usage(command, name), ".SH DESCRIPTION", *paragraphs(command["text"])]
    lines.append(".SH OPTIONS")
    for one in command["options"]:
        lines += option_lines(one)
    if command["subcommands"]:
        lines += [".SH COMMANDS", *subcommand_lines(command, name)]
    if command["footer"].strip():
        lines += [".SH EXAMPLES", *block(re.sub(r"\A\s*Examples:\n", "", command["footer"]))]
    return "\n".join(lines + tail(name, others)) + "\n"


def paragraphs(text):
    lines = []
    for line in text.splitlines():
        lines += [escaped(line), ".br"]
    return lines[:-1]


def word_lines(word):
    lines = [f".SS {escaped('grouser ' + word['name'])}"]
    if word["program"]:
        target = " ".join([word["program"], *word["path"]])
        lines += [f"{escaped(sentence(word['text']))} \\fB{escaped('grouser ' + word['name'])}\\fR is "
                  f"\\fB{escaped(target)}\\fR: its options are in \\fB{escaped(word['program'])}\\fR(1)."]
        for one in word["added"]:
            lines += option_lines(one)
    else:
        lines += block(word["help"]) if word.get("help") else [escaped(sentence(word["text"]))]
    for sub in word["subcommands"]:
        name = f"\\fB{escaped(' '.join(['grouser', word['name'], sub['name']]))}\\fR"
        if sub.get("help"):
            lines += [".PP", f"{name}:", *block(sub["help"])]
        elif sub.get("program"):
            target = " ".join([sub["program"], *sub["path"]])
            lines += [".PP", f"{name} is \\fB{escaped(target)}\\fR: its options are in "
                      f"\\fB{escaped(sub['program'])}\\fR(1)."]
    return lines


def words_page(command, version, others):
    """Of ./grouser: its words, and the help of those that are no program's."""
    lines = head("grouser", command["text"].removeprefix("Grouser: "), version)
    lines += ["\\fBgrouser\\fR \\fIWORD\\fR [arguments]", ".SH DESCRIPTION", escaped(command["text"]), ".SH WORDS"]
    for word in command["subcommands"]:
        lines += [".TP", f"\\fB{escaped(word['name'])}\\fR", escaped(sentence(word["text"]))]
    lines.append(".SH EACH WORD")
    for word in command["subcommands"]:
        lines += word_lines(word)
    return "\n".join(lines + tail("grouser", others)) + "\n"
