"""Wheel queries to servers: their messages, and streams of them. By grouser.client."""

import collections
import dataclasses
import queue
import threading
import time
from typing import Any, Optional, TypeVar

import grpc
import numpy as np
from google.protobuf import duration_pb2
from google.protobuf.message import DecodeError

from . import arrays, messages
from ._core import AccuracyRequest, Error
from .arrays import Answers, Bits, Fields, States
from .channel import Connection, ServerError
from .messages import make
from .v1alpha1 import terrain_service_pb2

T = TypeVar("T", bound="WheelStream")

_MOST_UNRECEIVED = 1000  # queries of a stream


@dataclasses.dataclass(eq=False)
class ServedAnswers(Answers):
    """Answers of a server. sd_soil is None: served models are of one soil."""

    model: str = ""  #: which answered, 'name@sha256:HEX'; with an accuracy request: which was named
    generation: int = 0  #: of the server's models
    interval_level: float = 0.0  #: of low and high, e.g. 0.9
    averaging_length: float = 0.0  #: that sd_patch is stated for [m]
    latency: float = 0.0  #: in the server, decode and transport excluded [s]
    selectable_models: tuple[str, ...] = ()  #: with an accuracy request: the cheapest first
    answered_by: Optional[Bits] = None  #: the same: index into them, by state


class Query:
    """What is asked of all states of a call, or of a stream: model, accuracy request, fields."""

    def __init__(self, model: str, accuracy: Optional[AccuracyRequest], fields: Fields) -> None:
        self._wanted = arrays.chosen(messages.ANSWERED, fields, arrays.DEFAULT_ANSWERS)
        self._base = make(
            terrain_service_pb2.EvaluateWheelsRequest, model=model, fields=messages.fields_of(self._wanted),
            with_gradients=any(name.partition(".")[2].startswith("d_") for name in self._wanted))
        if accuracy is not None:
            self._base.accuracy.CopyFrom(messages.accuracy_message(accuracy))

    def request(self, states: States, sequence: int = 0) -> tuple[Any, tuple[int, ...]]:
        """As a message, and the states' shape."""
        message, shape = messages.wheel_states(states)
        request = terrain_service_pb2.EvaluateWheelsRequest(sequence=sequence, states=message)
        request.MergeFrom(self._base)
        return request, shape

    def answers(self, response: Any, shape: tuple[int, ...]) -> ServedAnswers:
        """Of a response, in new arrays."""
        r = response.responses
        out = ServedAnswers(messages.array_of(r.flags, "flags", shape, np.uint32), model=response.model,
                            generation=response.generation, interval_level=r.interval_level,
                            averaging_length=r.averaging_length_m,
                            latency=response.latency.ToNanoseconds() / 1e9,
                            selectable_models=tuple(response.selectable_models))
        if out.selectable_models:
            out.answered_by = messages.array_of(response.answered_by, "answered_by", shape, np.uint32)
        messages.fill_answers(r, self._wanted, shape, out)
        return out


def _retry_after(detail: Any) -> Optional[float]:
    """Of a google.rpc.RetryInfo, whose field 1 is a Duration of at most 18 bytes; None: of another, or one that is cut
    off. Read by hand, as protobuf has room for one error_details.proto in a process, and others bring the whole of it.
    """
    value = detail.value
    if detail.TypeName() != "google.rpc.RetryInfo" or value[:1] != b"\n" or len(value) < 2 or len(value) < 2 + value[1]:
        return None
    try:
        return duration_pb2.Duration.FromString(value[2:2 + value[1]]).ToMilliseconds() / 1000
    except DecodeError:
        return None


def _refusal(status: Any) -> ServerError:
    """Of a google.rpc.Status in band."""
    known = [code for code in grpc.StatusCode if code.value[0] == status.code]
    waits = [wait for wait in map(_retry_after, status.details) if wait is not None]
    return ServerError(known[0] if known else grpc.StatusCode.UNKNOWN, status.message, waits[0] if waits else None)


class WheelStream:
    """Wheel queries on one call that stays open, answered in the order in which they were sent: Client.stream.

    Not for two threads at once. What the server refuses raises ServerError from the receive() that was to have its
    answer, and the stream goes on; after any other error it is at its end, and all that is called but close() raises
    that error. At most 1000 queries may be left to receive.
    """

    def __init__(self, connection: Connection, method: Any, query: Query) -> None:
        self._connection, self._query = connection, query
        self._requests: Any = queue.SimpleQueue()
        self._responses: Any = queue.SimpleQueue()
        self._sent: collections.deque[tuple[int, tuple[int, ...]]] = collections.deque()
        self._sequence = 0
        self._closed = False
        self._end: Optional[Error] = None  # why nothing more is sent or received
        self._call = connection._open(method, iter(self._requests.get, None))
        # An answer is waited for no longer than its limit, which gRPC's own iterator cannot.
        self._reader = threading.Thread(target=self._read, name="grouser-stream", daemon=True)
        self._reader.start()

    def _read(self) -> None:
        try:
            for response in self._call:
                self._responses.put(response)
            self._responses.put(None)
        except grpc.RpcError as error:
            self._responses.put(error)

    def _ended(self, why: Error) -> Error:
        """The first reason counts."""
        self._end = self._end or why
        self._sent.clear()
        self._call.cancel()
        return self._end

    def _check_open(self) -> None:
        if self._closed:
            raise Error("stream: is closed, expected one that is open")
        if self._end is not None:
            raise self._end

    def send(self, states: States) -> None:
        """Asks n states; does not wait. Each is to be received."""
        self._check_open()
        if len(self._sent) >= _MOST_UNRECEIVED:
            raise Error(f"stream: {len(self._sent)} answers are left to receive, expected fewer than "
                        f"{_MOST_UNRECEIVED}")
        request, shape = self._query.request(states, self._sequence + 1)
        self._sequence += 1
        self._sent.append((self._sequence, shape))
        self._requests.put(request)

    def receive(self, *, deadline: Optional[float] = None) -> ServedAnswers:
        """The answers to the first states that were sent and not received; deadline: from now, by default the
        client's [s]. One that passes ends the stream."""
        limit = self._connection._limit(deadline)
        if self._end is not None:
            raise self._end
        if not self._sent:
            raise Error("stream: nothing is left to receive, expected send() before")
        until = time.monotonic() + limit
        try:
            got = self._responses.get(timeout=limit)
        except queue.Empty:
            raise self._ended(ServerError(
                grpc.StatusCode.DEADLINE_EXCEEDED,
                f"no answer within {limit:g} s on the stream (server {self._connection.address})")) from None
        if got is None:
            raise self._ended(Error(f"stream: the server {self._connection.address} has ended it"))
        if isinstance(got, grpc.RpcError):
            raise self._ended(self._connection._error_of(got, until))
        sequence, shape = self._sent.popleft()
        if got.sequence != sequence:
            raise self._ended(Error(f"stream: the server {self._connection.address} answered query {got.sequence}, "
                                    f"expected {sequence}"))
        if got.HasField("error"):
            raise _refusal(got.error)
        return self._query.answers(got, shape)

    def evaluate(self, states: States, *, deadline: Optional[float] = None) -> ServedAnswers:
        """send() and receive(). Raises Error where answers are left to receive."""
        self._check_open()
        if self._sent:
            raise Error(f"stream: {len(self._sent)} answers are left to receive, expected none")
        self.send(states)
        return self.receive(deadline=deadline)

    def close(self) -> None:
        """Ends it; what was not received is dropped."""
        self._closed = True
        self._requests.put(None)
        self._call.cancel()
        self._reader.join()

    def __enter__(self: T) -> T:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
