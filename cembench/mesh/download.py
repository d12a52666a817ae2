"""Download a file within bounds: of its size, of the server's pace, and of time.

The server is asked in a thread, and the caller waits for what arrives. So Ctrl-C, a deadline or a
stop ends the wait at once, whatever the server does; the thread ends with its next byte, or with
the process.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field
from math import inf
from queue import Empty, Full, Queue
from time import monotonic
from typing import TYPE_CHECKING, BinaryIO, Protocol
from urllib.parse import urljoin

from cembench.core.errors import describe_error

if TYPE_CHECKING:
    from requests import Response

#: Bytes per second, over the seconds of a server's allowed silence, that it must send at least.
SLOWEST = 2**12
#: Bytes of a file whose publisher states no size.
LARGEST = 2**31
#: How often a server may name another address.
MAX_REDIRECTS = 10
_CHUNK, _WAITING_CHUNKS, _STEP = 2**12, 256, 0.1


class DownloadError(Exception):
    """A download failed or went beyond a bound; the message says why."""


class Progress(Protocol):
    """Receives the progress of a download in bytes."""

    total: int

    def update(self, count: int) -> None:
        """Receive the number of bytes that have arrived since the last call."""

    def close(self) -> None:
        """End the display."""


@dataclass(frozen=True)
class Bounds:
    """What a download may take.

    Parameters
    ----------
    size : int
        Bytes of the file.
    silence : float
        Seconds for an answer to begin, and in which :data:`SLOWEST` bytes each must arrive.
    until : float
        When the download must have ended, as :func:`time.monotonic` counts.
    stop : Event
        Ends the download once it is set.
    """

    size: int = LARGEST
    silence: float = 60.0
    until: float = inf
    stop: threading.Event = field(default_factory=threading.Event)


#: What the thread hands over: the announced size in bytes or 0, the bytes, the end or an error.
_Message = int | bytes | Exception | None


def download(url: str, file: BinaryIO, bounds: Bounds, progress: Progress | None = None) -> None:
    """Write what a server sends to a file.

    Raises
    ------
    DownloadError
        The server does not answer, breaks off, or a bound is reached.
    """
    messages: Queue[_Message] = Queue(_WAITING_CHUNKS)
    abandoned = threading.Event()
    asking = (url, bounds.silence, messages, abandoned)
    threading.Thread(target=_ask, args=asking, daemon=True).start()
    try:
        arrived = 0
        for message in _messages(messages, bounds):
            if isinstance(message, int):
                _check_size(message, bounds.size)
                if progress is not None:
                    progress.total = message
                continue
            arrived += len(message)
            _check_size(arrived, bounds.size)
            file.write(message)
            if progress is not None:
                progress.update(len(message))
        if progress is not None:
            progress.close()
    finally:
        abandoned.set()


def _check_size(size: int, most: int) -> None:
    if size > most:
        raise DownloadError(
            f"the server sends {size:,} bytes or more; the file has at most {most:,}"
        )


def _messages(messages: Queue[_Message], bounds: Bounds) -> Iterator[int | bytes]:
    """Yield what arrives, until the end."""
    begun, since, arrived = False, monotonic(), 0
    while True:
        now = monotonic()
        if bounds.stop.is_set() or now > bounds.until:
            raise DownloadError("it was stopped" if bounds.stop.is_set() else "its time is over")
        if now > since + bounds.silence:
            if not begun:
                raise DownloadError(f"the server did not answer within {bounds.silence:g} s")
            if arrived < SLOWEST * bounds.silence:
                raise DownloadError(
                    f"the server sent {arrived:,} bytes in {bounds.silence:g} s; needed are "
                    f"{SLOWEST:,} a second"
                )
            since, arrived = now, 0
        try:
            message = messages.get(timeout=_STEP)
        except Empty:
            continue
        if message is None:
            return
        if isinstance(message, Exception):
            raise DownloadError(describe_error(message)) from message
        if isinstance(message, int):
            begun, since = True, monotonic()
        else:
            arrived += len(message)
        yield message


def _ask(url: str, timeout: float, messages: Queue[_Message], abandoned: threading.Event) -> None:
    """Hand over a server's answer, as long as somebody waits for it."""

    def hand_over(message: _Message) -> bool:
        while not abandoned.is_set():
            try:
                messages.put(message, timeout=_STEP)
            except Full:
                continue
            return True
        return False

    try:
        with closing(_answer(url, timeout)) as answer:
            answer.raise_for_status()
            hand_over(int(answer.headers.get("Content-Length", 0)))
            for chunk in answer.raw.stream(_CHUNK, decode_content=False):
                if not hand_over(chunk):
                    return
        hand_over(None)
    except Exception as error:  # whatever a server's answer makes the libraries raise
        hand_over(error)


def _answer(url: str, timeout: float) -> Response:
    """Return a server's answer, whose content is not read yet; redirections are followed.

    ``requests.get`` would read the content of a redirection, of any length, to its end.
    """
    import requests

    with requests.Session() as session:
        for _ in range(MAX_REDIRECTS):
            asked = session.prepare_request(
                requests.Request("GET", url, headers={"Accept-Encoding": "identity"})
            )
            settings = session.merge_environment_settings(str(asked.url), {}, True, None, None)
            answer = session.get_adapter(url).send(asked, timeout=timeout, **settings)
            target = session.get_redirect_target(answer)
            if target is None:
                return answer
            answer.close()
            url = urljoin(url, target)
    raise DownloadError(f"the server names another address {MAX_REDIRECTS} times")
