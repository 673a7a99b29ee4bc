"""Real servers on loopback for the tests of the clients, and throwaway certificates."""

import contextlib
import os
import pathlib
import signal
import subprocess
import sys
import time

try:
    import grouser.client
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)


@contextlib.contextmanager
def serving(program, folder, *options, grpc="127.0.0.1:0"):
    """grouser-server or grouser-jobs with its state in `folder`: its address, once it is ready."""
    port = pathlib.Path(folder, f"{program}.port")
    port.unlink(missing_ok=True)
    with open(f"{folder}/{program}.log", "ab") as log:
        process = subprocess.Popen(
            ["setpriv", "--pdeathsig", "KILL", f"{os.environ['GROUSER_BIN']}/{program}", "--grpc", grpc,
             "--state", f"{folder}/{program}", "--port-file", port, *options], stderr=log)
    try:
        until = time.monotonic() + 60  # a guard against hanging
        while not port.exists():
            if time.monotonic() > until or process.poll() is not None:
                raise AssertionError(f"{program} is not ready: {pathlib.Path(log.name).read_text()}")
            time.sleep(0.02)
        yield port.read_text().splitlines()[0].partition("=")[2]
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(60)


def serving_jobs(folder):
    """grouser-jobs with the shipped models and one worker."""
    source = os.environ["GROUSER_SOURCE"]
    return serving("grouser-jobs", folder, "--shipped", f"{source}/surrogate/shipped", "--scripts", source,
                   "--workers", "1")


def make_certificates(folder):
    """ca, other, server (of this machine) and caller: NAME.pem, NAME.key."""
    config = pathlib.Path(folder, "c.cnf")
    config.write_text("[req]\ndistinguished_name=dn\n[dn]\n")

    def make(name, *more):
        subprocess.run(["openssl", "req", "-x509", "-config", config, "-newkey", "ec", "-pkeyopt",
                        "ec_paramgen_curve:P-256", "-nodes", "-keyout", f"{folder}/{name}.key", "-out",
                        f"{folder}/{name}.pem", "-subj", f"/CN={name}", "-days", "2", *more],
                       check=True, stderr=subprocess.DEVNULL)

    for authority in ("ca", "other"):
        make(authority, "-addext", "basicConstraints=critical,CA:TRUE")
    signed = ("-CA", f"{folder}/ca.pem", "-CAkey", f"{folder}/ca.key")
    make("server", *signed, "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1")
    make("caller", *signed)


Client, JobsClient, ServerError = grouser.client.Client, grouser.client.JobsClient, grouser.client.ServerError
