#!/usr/bin/python3
"""Manual pages and completions (packaging/command_lines) beside what the programs' own --help says, and ./grouser
as it is installed. Usage: command_lines_test.py ROOT BUILD [--words]
--words: those of ./grouser as well, and an installation in a prefix of its own: 15 s instead of 5."""
import concurrent.futures
import gzip
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

# How a completion is asked: one line of words each, the last to be completed.
ASK = """
for file in "$1"/*; do . "$file"; done
while read -ra COMP_WORDS; do
  COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
  [ "${COMP_WORDS[COMP_CWORD]}" != @ ] || COMP_WORDS[COMP_CWORD]=''
  function="_${COMP_WORDS[0]//-/_}"
  "$function"
  echo "${COMPREPLY[*]}"
done
"""


def run(*command, **options):
    return subprocess.run(command, check=False, capture_output=True, text=True, timeout=120, **options)


def helps(program, path=()):
    """Of a program and each of its subcommands: (their names, help text)."""
    done = run(program, *path, "--help")
    assert done.returncode == 0, f"{program} {path}: {done.stderr}"
    yield path, done.stdout
    _, _, listed = done.stdout.partition("\nSubcommands:\n")
    for name in re.findall(r"^  ([a-z][\w-]*)", listed.split("\n\n")[0], re.M):
        yield from helps(program, (*path, name))


def long_options(text):
    lines = re.findall(r"^  (-[^ ]+)", text, re.M)
    return {name for line in lines for name in line.split(",") if name.startswith("--")}


def plain(page):
    """A manual page without its markup."""
    return re.sub(r"\\f[BIR]|\\&", "", page).replace("\\-", "-")


def complete(folder, queries):
    asked = "".join(" ".join(query) + "\n" for query in queries)
    done = run("bash", "-c", ASK, "bash", folder, input=asked)
    assert done.returncode == 0 and not done.stderr, done.stderr
    return [line.split() for line in done.stdout.splitlines()]


def check_programs(build, out):
    """Every option that --help knows stands in the page and is completed."""
    programs = [page.name[:-len(".1.gz")] for page in sorted((out / "man1").iterdir())]
    assert len(programs) >= 10, programs
    queries, expected = [], []
    programs = [name for name in programs if name != "grouser"]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        texts = list(pool.map(lambda name: list(helps(build / "bin" / name)), programs))
    for name, helped in zip(programs, texts, strict=True):
        page = plain(gzip.decompress((out / "man1" / f"{name}.1.gz").read_bytes()).decode())
        for path, text in helped:
            options = long_options(text)
            assert "--help" in options, f"{name} {path}: {text}"
            for option in options:
                assert re.search(rf"(^|, ){option}\b", page, re.M), f"{name} {' '.join(path)} {option}: not in its page"
            queries.append([name, *path, "--"])
            expected.append(options)
    for query, options, offered in zip(queries, expected, complete(out / "completions", queries), strict=True):
        missing = options - set(offered)
        assert not missing, f"{' '.join(query)}: not completed: {missing}"
    print(f"{len(programs)} commands, {len(queries)} with options: {sum(map(len, expected))} options")


def check_word_options(out, prefix):
    """What the front door's own help texts name, but for their examples, is completed, and nothing else."""
    env = {"PATH": "/usr/bin:/bin", "HOME": str(prefix), "MPLCONFIGDIR": str(prefix)}
    words = [line.split() for line in ("serve", "config", "doctor", "reproduce", "bevameter", "validate", "calibrate",
                                       "calibrate grains", "campaign adapt", "campaign converge", "dem view",
                                       "model plot", "vehicle plot")]
    count = 0
    completed = complete(out / "completions", [["grouser", *path, "--"] for path in words])
    for path, offered in zip(words, completed, strict=True):
        done = run(prefix / "bin" / "grouser", *path, "--help", cwd="/", env=env)
        assert done.returncode == 0, f"{path}: {done.stderr}"
        text = re.sub(r"^ *Examples?:\n(?:.+\n)*", "", done.stdout, flags=re.M)
        named = {name for name in re.findall(r"(?<![\w-])--[a-z][\w-]*", text) if name == name.lower()}
        assert set(offered) == named, f"grouser {' '.join(path)}: completed or named, not both: {set(offered) ^ named}"
        count += len(named)
    assert {"--jobs-http", "--idle-s", "--rights"} <= set(completed[0]), completed[0]
    print(f"{len(words)} words of ./grouser: {count} options")


def check_words(out):
    page = plain(gzip.decompress((out / "man1" / "grouser.1.gz").read_bytes()).decode())
    for wanted in ("grouser query is grouser-client query", "grouser jobs get is grouser-client job"):
        assert wanted in " ".join(page.split()), f"grouser(1) lacks: {wanted}"
    words, model, plot, kinds, added, campaign, formats, folder = complete(out / "completions", [
        ["grouser", "@"], ["grouser", "model", "@"], ["grouser", "query", "--"], ["grouser", "dem", "run", "--device", "@"],
        ["grouser", "model", "explain", "--pl"], ["grouser", "campaign", "@"],
        ["grouser", "serve", "--log-format", "@"], ["grouser", "validate", "--out", "@"]])
    assert {"serve", "query", "model", "doctor"} <= set(words) and not {"setup", "build", "test"} & set(words), words
    assert {"list", "eval", "explain", "gate"} <= set(model), model
    assert {"--slip", "--server", "--plot"} <= set(plot), plot
    assert "cpu" in kinds, kinds
    assert added == ["--plot"] and {"run", "adapt", "converge"} <= set(campaign), (added, campaign)
    assert formats == ["text", "json"] and not folder, (formats, folder)
    table = (out / "completions" / "grouser").read_text()
    for option in ("validate --out", "validate --model"):
        assert f"['. {option}']=@file" in table, f"{option}: expected files"


def check_texts(root, build, out):
    """Well-formed, and nothing of this machine in them."""
    for file in sorted((out / "completions").iterdir()):
        done = run("bash", "-n", file)
        assert done.returncode == 0, done.stderr
    texts = {page: gzip.decompress(page.read_bytes()).decode() for page in (out / "man1").iterdir()}
    if shutil.which("groff"):
        for page, text in texts.items():
            done = run("groff", "-man", "-ww", "-Tutf8", input=text)
            assert done.returncode == 0 and not done.stderr, f"{page.name}: {done.stderr}"
    else:
        print("groff: not here (Debian: groff-base); the pages were not set")
    texts |= {file: file.read_text() for file in (out / "completions").iterdir()}
    home = os.path.expanduser("~")
    for file, text in texts.items():
        for foreign in (str(root), str(build), tempfile.gettempdir() + "/tmp", f"{home}/", "--describe-command-line"):
            assert foreign not in plain(text), f"{file.name}: has {foreign}"


def check_installed(build, prefix):
    """./grouser and a program in a prefix of their own."""
    def grouser(*words):
        return run(prefix / "bin" / "grouser", *words, cwd="/", env={"PATH": "/usr/bin:/bin", "HOME": str(prefix)})

    (prefix / "bin" / "grouser-soil").unlink()
    lacking = grouser("soil", "list")
    assert lacking.returncode == 1 and "the package grouser has it" in lacking.stderr, lacking
    shutil.copy(build / "bin" / "grouser-soil", prefix / "bin")
    for done in (grouser("soil", "list"), run(prefix / "bin" / "grouser-soil", "list", cwd="/", env={})):
        assert done.returncode == 0 and "LETE sand" in done.stdout, done.stderr
    setup = grouser("setup")
    assert setup.returncode == 2 and "needs a checkout" in setup.stderr, setup
    text = grouser("help").stdout
    assert "./grouser" not in text and "  serve " in text and "  setup " not in text, text
    assert re.fullmatch(r"grouser \d+\.\d+\.\d+\n", grouser("--version").stdout)
    model = prefix / "share/grouser/surrogate/pairs/cmu-smooth-62.5-8mm/hybrid.model"
    shown = grouser("model", "eval", str(model), "--slip", "0.2", "--load", "24", "--json")
    assert shown.returncode == 0 and '"f_x"' in shown.stdout, shown


def main(root, build, words=False):
    root, build = pathlib.Path(root).resolve(), pathlib.Path(build).resolve()
    tool = root / "packaging" / "command_lines" / "write.py"
    sys.path.insert(0, str(tool.parent))
    import write  # noqa: E402 (found only now)
    with tempfile.TemporaryDirectory() as folder:
        out, prefix = pathlib.Path(folder, "out"), pathlib.Path(folder, "prefix")
        subprocess.run([tool, "--build", build, "--out", out, *([] if words else ["--programs"])], check=True)
        check_programs(build, out)
        check_texts(root, build, out)
        if words:
            check_words(out)
            write.install(build, prefix)
            check_word_options(out, prefix)
            check_installed(build, prefix)


if __name__ == "__main__":
    if sys.argv[3:] not in ([], ["--words"]) or len(sys.argv) < 3:
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    main(*sys.argv[1:3], words=len(sys.argv) > 3)
