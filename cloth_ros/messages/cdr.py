"""
A message that is serialised once, and whose numbers are then overwritten in place.

rclpy fills and serialises a list of points one Python object at a time: 0.6 s for the triangles
of a 128 × 128 sheet.  `Publisher.publish` also takes serialised bytes.  So a message is
serialised once with placeholders, each sequence of numbers is stretched to its length, and from
then on NumPy writes into the bytes.

The form is plain CDR (OMG DDS-XTypes 1.3, section 7.4.3): after an encapsulation header of 4
bytes, every number is aligned to its own size.  A sequence may be stretched by whole multiples of
8 bytes without moving what follows it out of alignment; `block` sees to that.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from numpy.typing import NDArray
from rclpy.serialization import serialize_message

_HEADER = 4

# Placeholders: values that no message has by chance.
STAMP = Time(sec=0x5EC0_4DB1, nanosec=0x2F4A_91C7)


class SerializedMessage:
    """
    A serialised message with places in it.

    Parameters
    ----------
    message
        Any ROS message, with `STAMP` in every header that is to be stamped.

    """

    def __init__(self, message: Any) -> None:
        self._bytes: Any = bytearray(serialize_message(message))
        self._stamps = self._find_stamps()

    def _find_stamps(self) -> list[int]:
        mark = np.array([STAMP.sec, STAMP.nanosec], np.uint32).tobytes()
        places, start = [], self._bytes.find(mark)
        while start >= 0:
            places.append(start)
            start = self._bytes.find(mark, start + 1)
        return places

    def _find(self, mark: bytes) -> int:
        if self._bytes.count(mark) != 1:
            raise AssertionError(f'placeholder found {self._bytes.count(mark)} times, not once')
        return int(self._bytes.find(mark))

    def stretch(self, placeholder: bytes, elements: int, count: int) -> int:
        """
        Repeat the placeholder of a sequence, and return the offset of its first byte.

        Parameters
        ----------
        placeholder
            The whole content of the sequence, and nowhere else in the message; a multiple of 8
            bytes long.
        elements
            Number of its elements, more than 0.
        count
            How often it is to stand there.

        """
        place = self._find(placeholder)
        # The length stands in front of the first element; where that is aligned to 8 bytes, 4
        # bytes of padding may lie between.  Padding is not zero but whatever was in memory, so
        # the farther place is looked at first: with the length there, the nearer is padding.
        aligned = (place - _HEADER) % 8 == 0 and len(placeholder) // elements >= 8
        for length_place in (place - 8, place - 4) if aligned else (place - 4,):
            if self._word(length_place) == elements:
                break
        else:
            raise AssertionError('the length of the placeholder is not in front of it')
        self._bytes[length_place : length_place + 4] = np.uint32(elements * count).tobytes()
        self._bytes[place : place + len(placeholder)] = placeholder * count
        self._stamps = self._find_stamps()
        return place

    def _word(self, place: int) -> int:
        return int(np.frombuffer(self._bytes[place : place + 4], np.uint32)[0])

    def place(self, mark: bytes) -> int:
        """Return the offset of a placeholder that stays as long as it is."""
        return self._find(mark)

    def freeze(self) -> None:
        """
        End the stretching: the bytes stay where they are from here on.

        They are laid into memory so that what is aligned in CDR is aligned for NumPy too.
        """
        memory = np.zeros(len(self._bytes) + 16, np.uint8)
        shift = -(memory.ctypes.data + _HEADER) % 8
        frozen = memory[shift : shift + len(self._bytes)]
        frozen[:] = np.frombuffer(self._bytes, np.uint8)
        self._bytes = frozen

    def view(self, place: int, dtype: Any, shape: tuple[int, ...]) -> NDArray[Any]:
        """Return an array that shares the bytes from `place` on; only after `freeze`."""
        size = int(np.prod(shape)) * np.dtype(dtype).itemsize
        array: NDArray[Any] = self._bytes[place : place + size].view(dtype).reshape(shape)
        return array

    def stamp(self, seconds: int, nanoseconds: int) -> None:
        """Write a time into every header that was made with `STAMP`."""
        for place in self._stamps:
            self.view(place, np.uint32, (2,))[:] = seconds % 2**32, nanoseconds

    def tobytes(self) -> bytes:
        """Return the message as `Publisher.publish` takes it."""
        return self._bytes.tobytes()  # type: ignore[no-any-return]
