#!/usr/bin/python3
"""Checks by ldd what a program loads. Usage: check_loads.py PROGRAM WORD...
Fails when the name of a loaded library contains one of the words."""

import subprocess
import sys


def main(arguments):
    if len(arguments) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    program, words = arguments[0], arguments[1:]
    result = subprocess.run(["ldd", program], capture_output=True, text=True, check=True)
    libraries = [line.split()[0] for line in result.stdout.splitlines() if line.strip()]
    if not any("grpc" in name for name in libraries):
        print("ldd names no gRPC: this test would not see the others either")
        return 1
    found = [name for name in libraries if any(word in name.lower() for word in words)]
    print(f"{len(libraries)} libraries, not allowed among them: {found or 'none'}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
