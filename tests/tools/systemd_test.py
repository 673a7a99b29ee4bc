#!/usr/bin/python3
"""What grouser-server and grouser-jobs tell systemd, and how far their units shut them in.
Usage: systemd_test.py BIN UNITS    (folders of the programs and of the configured units)
Exit code 77: the services passed, but systemd-analyze, which judges the units, is not here."""
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile

EXPOSURE = 30  # most that systemd-analyze may find, in tenths
PROGRAMS = {"grouser-server": ["--no-lcm"], "grouser-jobs": []}


def told(program, options, folder):
    """Starts the program as a notify service, ends it by SIGTERM; its messages and exit code."""
    path = f"{folder}/notify"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(path)
        manager.settimeout(60)  # a guard against hanging
        process = subprocess.Popen(
            [program, "--state", f"{folder}/state", "--grpc", "127.0.0.1:0", *options],
            env={"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "200000"}, stderr=subprocess.DEVNULL)
        messages = []

        def wait_for(text, times):
            while messages.count(text) < times:
                messages.append(manager.recv(4096).decode())

        try:
            wait_for("READY=1", 1)
            wait_for("WATCHDOG=1", 3)
            process.send_signal(signal.SIGTERM)
            wait_for("STOPPING=1", 1)
            return messages, process.wait(60)
        finally:
            process.kill()
            process.wait()


def check_notices(bin_dir):
    for name, options in PROGRAMS.items():
        with tempfile.TemporaryDirectory() as folder:
            messages, code = told(f"{bin_dir}/{name}", options, folder)
        assert code == 0, f"{name}: exit code {code}, expected 0"
        assert messages[0] == "READY=1", f"{name}: first told {messages[0]}, expected READY=1"
        assert messages[-1] == "STOPPING=1", f"{name}: last told {messages[-1]}"
        print(f"{name}: {len(messages)} messages")


def check_units(bin_dir, units):
    """Both are well-formed, and exposed by at most EXPOSURE."""
    with tempfile.TemporaryDirectory() as folder:
        for name in PROGRAMS:
            text = (pathlib.Path(units) / f"{name}.service").read_text()
            assert "@" not in text.replace("@system-service", "").replace("@privileged", ""), \
                f"{name}.service: a name between @ is left"
            lines = [f"ExecStart={bin_dir}/{name}" if line.startswith("ExecStart=") else line
                     for line in text.splitlines()]
            unit = pathlib.Path(folder, f"{name}.service")
            unit.write_text("\n".join(lines) + "\n")
            for command in (["verify", "--man=no"], ["security", "--offline=true", f"--threshold={EXPOSURE}"]):
                done = subprocess.run(["systemd-analyze", "--no-pager", *command, unit], check=False,
                                      capture_output=True, text=True)
                assert done.returncode == 0, f"{command[0]}:\n{done.stdout[-2000:]}{done.stderr}"
                if command[0] == "security":
                    print(done.stdout.strip().splitlines()[-1])


def main(bin_dir, units):
    bin_dir = pathlib.Path(bin_dir).resolve()  # as units name programs
    check_notices(bin_dir)
    if not shutil.which("systemd-analyze"):
        print("systemd-analyze: not here (Debian: systemd); the units were not judged")
        return 77
    check_units(bin_dir, units)
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    sys.exit(main(*sys.argv[1:]))
