"""The way to a server: channel, credentials, limits of time, and what goes wrong as exceptions.

Addresses, options and limits are those of the C++ client (clients/cpp/channel.cc, credentials.cc).
"""

import math
import pathlib
import re
import socket
import ssl
import threading
import time
from collections.abc import Iterator
from typing import Any, Optional, TypeVar

try:
    import grpc
except ImportError as error:  # optional: all but the clients works without
    raise ImportError(f"{error}: grouser.client needs grpcio and protobuf (Debian: python3-grpcio)") from None

from ._core import Error

T = TypeVar("T", bound="Connection")
_MEGABYTE = 1024 * 1024
_OPTIONS = (
    ("grpc.max_receive_message_length", 64 * _MEGABYTE),
    ("grpc.keepalive_time_ms", 15000),  # a server that is gone without a word
    ("grpc.keepalive_timeout_ms", 5000),
    ("grpc.http2.max_pings_without_data", 0),
    ("grpc.initial_reconnect_backoff_ms", 100),  # between tries to reach one that is not there
    ("grpc.max_reconnect_backoff_ms", 1000),
    ("grpc.min_reconnect_backoff_ms", 1000),  # one try
)
_PROBE_S = 2.0
_PROBE_EVERY_S = 5.0
_LONGEST_S = 1e9  # gRPC counts nanoseconds since 1970 in 64 bits
_MOST_ENTRIES = 100_000


class ServerError(Error):
    """A call that the server refused or that did not reach it. Its text is 'CODE: text of the server'.

    code: the grpc.StatusCode. retry_after: how long an overloaded server asks to wait before the next
    try [s], else None.
    """

    def __init__(self, code: Any, text: str, retry_after: Optional[float] = None) -> None:
        super().__init__(f"{code.name}: {text}")
        self.code = code
        self.retry_after = retry_after
        self._text = text

    def __reduce__(self) -> tuple[Any, ...]:  # by default unpickled with the whole text alone
        return type(self), (self.code, self._text, self.retry_after), self.__dict__


def _read(name: str, path: str, expected: str) -> bytes:
    if not str(path):
        raise Error(f"{name}: an empty path, expected a file with {expected}")
    try:
        content = pathlib.Path(path).read_bytes()
    except (OSError, ValueError) as error:  # a path with a zero byte
        raise Error(f"{name}: {path}: {getattr(error, 'strerror', None) or error}") from None
    if not content.strip():
        raise Error(f"{name}: {path}: is empty, expected {expected}")
    return content


def _token(path: str) -> str:
    word = _read("token_file", path, "a token").strip()
    if not all(0x20 < c <= 0x7E for c in word):
        raise Error(f"token_file: {path}: expected one word of ASCII")
    return word.decode("ascii")


def _is_local(address: str) -> bool:
    return address.startswith(("localhost:", "127.", "[::1]:", "unix:"))


def _socket_to(address: str) -> tuple[socket.socket, str]:
    """A connection, and the server's name in its certificate."""
    if address.startswith("unix:"):
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            connection.settimeout(_PROBE_S)
            connection.connect(address[7 if address.startswith("unix:///") else 5:])
        except OSError:
            connection.close()
            raise
        return connection, "localhost"
    host, _, port = address.rpartition(":")
    host = host.strip("[]")
    return socket.create_connection((host, int(port)), _PROBE_S), host


def _tls_problem(address: str, ca: Optional[str]) -> str:
    """What is wrong with TLS, where the server answers and that is why it cannot be reached."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.set_alpn_protocols(["h2"])
    if ca is not None:
        try:
            context.load_verify_locations(ca)
        except OSError as error:  # of TLS too
            return f"tls_ca: {ca}: {error.strerror or error}"
    else:
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    try:
        connection, name = _socket_to(address)
    except (OSError, ValueError):
        return ""
    with connection:
        try:
            with context.wrap_socket(connection, server_hostname=name):
                return "it speaks TLS: expected tls_ca" if ca is None else ""
        except ssl.SSLCertVerificationError as error:
            return f"its certificate: {error.verify_message} (authority by tls_ca: {ca})"
        except OSError:
            return "" if ca is None else "it does not speak TLS: expected no tls_ca, or a server with --tls-cert"


class _TlsProbe:
    """What is wrong with TLS at one address, looked at again after some seconds at the earliest."""

    def __init__(self, address: str, ca: Optional[str]) -> None:
        self._address, self._ca = address, ca
        self._lock = threading.Lock()
        self._thread: Optional[threading.Thread] = None
        self._next, self._over, self._problem = -math.inf, -math.inf, ""

    def problem(self, seconds: float) -> str:
        """Waits so long at most, and no longer than 2 s for one look. Empty: nothing is known."""
        if seconds <= 0:
            return ""
        with self._lock:
            now = time.monotonic()
            if now >= self._next and not (self._thread and self._thread.is_alive()):
                self._next, self._over, self._problem = now + _PROBE_EVERY_S, now + _PROBE_S, ""
                # By a thread, as looking up a name takes as long as it takes.
                self._thread = threading.Thread(target=self._look, daemon=True)
                self._thread.start()
            thread, left = self._thread, min(seconds, self._over - now)
        if thread is not None and left > 0:
            thread.join(left)
        return self._problem

    def _look(self) -> None:
        self._problem = _tls_problem(self._address, self._ca)


def _credentials(address: str, tls_ca: Optional[str], tls_cert: Optional[str], tls_key: Optional[str],
                 with_token: bool) -> Any:
    """None: plaintext."""
    if (tls_cert is None) != (tls_key is None):
        raise Error("tls_cert: expected with tls_key, and the other way round")
    if tls_ca is not None:
        pair = [None if path is None else _read(name, path, "PEM")
                for name, path in (("tls_key", tls_key), ("tls_cert", tls_cert))]
        return grpc.ssl_channel_credentials(_read("tls_ca", tls_ca, "PEM"), *pair)
    if tls_cert is not None:
        raise Error("tls_cert: expected with tls_ca, by which to know the server")
    if not with_token:
        return None
    if not _is_local(address):
        raise Error(f"token_file: {address} is another machine, and the token would go there in plaintext; "
                    "expected tls_ca")
    # These refuse to go off the machine, whatever the address turns out to be.
    kinds = grpc.LocalConnectionType
    return grpc.local_channel_credentials(kinds.UDS if address.startswith("unix:") else kinds.LOCAL_TCP)


#: Of every kind of client.
ABOUT = """Thread-safe; close() or a with statement ends it.

    address: HOST:PORT or unix:PATH. deadline: longest time of a call [s], 10; each call takes another as
    deadline=. tls_ca: PEM file of who signs the server's certificate: speak TLS. tls_cert, tls_key:
    PEM files, shown to the server. token_file: its word goes with every call, over TLS or to this
    machine alone. A server that went away is tried again at least every second.

    Raises Error for options that do not go together and files that cannot be read. Every call raises
    ServerError when it fails, Error for arguments that make no message."""


class Connection:
    """What Client and JobsClient share."""

    def __init__(self, address: str, *, deadline: float = 10.0, tls_ca: Optional[str] = None,
                 tls_cert: Optional[str] = None, tls_key: Optional[str] = None,
                 token_file: Optional[str] = None) -> None:
        if not address.startswith("unix:") and not address.rpartition(":")[2].isdecimal():
            raise Error(f"address: '{address}', expected HOST:PORT or unix:PATH")
        self._address, self._probe = address, _TlsProbe(address, tls_ca)
        self._deadline = _seconds(deadline)
        self._metadata = () if token_file is None else (("authorization", f"Bearer {_token(token_file)}"),)
        # A proxy is a machine elsewhere: it cannot reach this one's loopback interface.
        options = _OPTIONS + ((("grpc.enable_http_proxy", 0),) if _is_local(address) else ())
        credentials = _credentials(address, tls_ca, tls_cert, tls_key, token_file is not None)
        self._channel = (grpc.insecure_channel(address, options) if credentials is None
                         else grpc.secure_channel(address, credentials, options))

    @property
    def address(self) -> str:
        """Of the server."""
        return self._address

    def close(self) -> None:
        """Ends the connection and what is under way on it."""
        self._channel.close()

    def __enter__(self: T) -> T:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _limit(self, deadline: Optional[float], default: Optional[float] = None) -> float:
        return max(self._deadline, default or 0.0) if deadline is None else _seconds(deadline)

    def _call(self, method: Any, request: Any, deadline: Optional[float], default: Optional[float] = None) -> Any:
        """The response of a unary method; default: its own limit, where that is longer."""
        limit = self._limit(deadline, default)
        until = time.monotonic() + limit
        try:
            return method(request, timeout=limit, metadata=self._metadata)
        except grpc.RpcError as error:
            raise self._error_of(error, until) from None
        except ValueError as error:  # of a closed channel
            raise Error(f"{self._address}: {error}") from None

    def _stream(self, method: Any, request: Any, deadline: float) -> Iterator[Any]:
        """The responses of a method that streams them. Left early, the call is cancelled."""
        until = time.monotonic() + _seconds(deadline)
        try:
            call = method(request, timeout=deadline, metadata=self._metadata)
        except ValueError as error:
            raise Error(f"{self._address}: {error}") from None
        try:
            yield from call
        except grpc.RpcError as error:
            raise self._error_of(error, until) from None
        finally:
            call.cancel()

    def _open(self, method: Any, requests: Iterator[Any]) -> Any:
        """A call of a method that takes and answers streams, without a limit of its own."""
        try:
            return method(requests, metadata=self._metadata)
        except ValueError as error:
            raise Error(f"{self._address}: {error}") from None

    def _all_pages(self, method: Any, request: Any, field: str, deadline: Optional[float],
                   limit: Optional[int] = None) -> list[Any]:
        """The entries of all pages, at most `limit`. Raises Error for pages that do not come to an end."""
        entries: list[Any] = []
        tokens: set[str] = set()
        most = max(_MOST_ENTRIES, limit or 0)
        while True:
            page = self._call(method, request, deadline)
            entries += getattr(page, field)
            token = page.next_page_token
            if not token or (limit is not None and len(entries) >= limit):
                return entries[:limit]
            if token in tokens:
                raise Error(f"{field}: the server {self._address} gives the page '{token}' again and again")
            tokens.add(token)
            if max(len(entries), len(tokens)) >= most:  # pages may be empty
                raise Error(f"{field}: the server {self._address} gives more than {most} entries or pages")
            request.page_token = token

    def _error_of(self, error: Any, until: float) -> ServerError:
        """until: when the call's time is over, by time.monotonic()."""
        code, text = error.code(), error.details() or ""
        if code == grpc.StatusCode.UNAVAILABLE:
            text += f" (server {self._address}"
            # Where a connection stood, TLS is well, and the server's own words say why.
            if "received from peer" not in (error.debug_error_string() or ""):
                problem = self._probe.problem(until - time.monotonic())
                text += f"; {problem or 'is it running? ./grouser serve starts it'}"
            text += ")"
        if code == grpc.StatusCode.UNAUTHENTICATED:
            text += " (a caller shows who it is by token_file, or by tls_cert and tls_key)"
        wait = dict(error.trailing_metadata() or ()).get("grpc-retry-pushback-ms", "")
        known = re.fullmatch("[0-9]{1,9}", wait) is not None
        return ServerError(code, text, int(wait) / 1000 if known else None)


def _seconds(deadline: float) -> float:
    if not 0 < deadline <= _LONGEST_S:
        raise Error(f"deadline: {deadline:g} s, expected above 0 and at most {_LONGEST_S:g}")
    return float(deadline)
