"""Runs a Python program of ours as a child of a test that has its imports already: they take longer than most calls."""

import os
import subprocess
import sys
import tempfile
import traceback


def _run(main, words):
    """Its exit code, as an interpreter would give it."""
    sys.argv = [words[0], *words[1:]]
    try:
        code = main()
    except SystemExit as stop:
        code = stop.code
    except BaseException:
        traceback.print_exc()
        return 1
    if code is not None and not isinstance(code, int):  # sys.exit("why")
        print(code, file=sys.stderr)
        return 1
    return code or 0


def call(main, *words):
    """`main()` with sys.argv = words; what subprocess.run gives with captured text."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as error:
        sys.stdout.flush()
        sys.stderr.flush()
        child = os.fork()
        if child == 0:
            code = 70
            try:
                os.dup2(out.fileno(), 1)
                os.dup2(error.fileno(), 2)
                code = _run(main, words)
                sys.stdout.flush()
                sys.stderr.flush()
            finally:
                os._exit(code)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        out.seek(0)
        error.seek(0)
        return subprocess.CompletedProcess(words, status, out.read(), error.read())
