"""What serialised messages (CDR) with a header begin with, read without their types."""
from __future__ import annotations

import struct
from typing import NamedTuple


class Header(NamedTuple):
    t_ns: int
    frame: str
    end: int  # bytes up to the end of the header


def header(message: bytes) -> Header:
    """@throws ValueError where the message ends early."""
    order = "<" if len(message) > 1 and message[1] & 1 else ">"
    try:
        seconds, nanoseconds, length = struct.unpack_from(order + "iII", message, 4)
    except struct.error as error:
        raise ValueError("the message ends early") from error
    end = 16 + length
    if length < 1 or end > len(message):
        raise ValueError("the message ends early")
    return Header(seconds * 10**9 + nanoseconds, message[16:end - 1].decode("utf-8", "replace"), end)


def body(message: bytes) -> bytes:
    """What follows the header: equal bodies of a frame say the same, whenever they were sent."""
    return bytes(message[header(message).end:])
