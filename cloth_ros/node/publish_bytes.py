"""
Publish serialised messages while other threads of Python run.

rclpy publishes without releasing Python's global interpreter lock: all threads of the process
wait until DDS has taken a message.  The function that rclpy calls is therefore called from here,
through ctypes, which releases it.
"""

from __future__ import annotations

import ctypes
import functools

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.publisher import Publisher

_OK = 0


class _Allocator(ctypes.Structure):
    """`rcutils_allocator_t`."""

    _fields_ = tuple(
        (name, ctypes.c_void_p)
        for name in ('allocate', 'deallocate', 'reallocate', 'zero_allocate', 'state')
    )


class _SerializedMessage(ctypes.Structure):
    """`rcl_serialized_message_t`, which is `rcutils_uint8_array_t`."""

    _fields_ = (
        ('buffer', ctypes.c_char_p),
        ('length', ctypes.c_size_t),
        ('capacity', ctypes.c_size_t),
        ('allocator', _Allocator),
    )


class _ErrorString(ctypes.Structure):
    """`rcutils_error_string_t`."""

    _fields_ = (('text', ctypes.c_char * 1024),)


@functools.cache
def _libraries() -> tuple[ctypes.CDLL, ctypes.CDLL]:
    """Return rcl and rcutils, which rclpy has loaded."""
    rcl, rcutils = ctypes.CDLL('librcl.so'), ctypes.CDLL('librcutils.so')
    rcl.rcl_publish_serialized_message.argtypes = (
        ctypes.c_void_p,
        ctypes.POINTER(_SerializedMessage),
        ctypes.c_void_p,
    )
    rcutils.rcutils_get_error_string.restype = _ErrorString
    rcutils.rcutils_reset_error.restype = None
    return rcl, rcutils


def publish_bytes(publisher: Publisher, data: bytes) -> None:
    """
    Publish a message.

    Parameters
    ----------
    publisher
        Of any type of message.
    data
        A message of that type, serialised.

    Raises
    ------
    RCLError
        DDS has no room or time for it.
    InvalidHandle
        The publisher was destroyed.

    """
    rcl, rcutils = _libraries()
    message = _SerializedMessage(data, len(data), len(data), _Allocator())
    with publisher.handle:
        result = rcl.rcl_publish_serialized_message(
            publisher.handle.pointer, ctypes.byref(message), None
        )
    if result != _OK:
        # Errors are kept for each thread.
        text = rcutils.rcutils_get_error_string().text.decode(errors='replace')
        rcutils.rcutils_reset_error()
        raise rclpy_implementation.RCLError(f'failed to publish: {text}')
