"""
Services that command the cloth.

A new service is a module here, with a function that creates it, and one entry below.
"""

from __future__ import annotations

from collections.abc import Callable

from ..context import Context
from .pause import create_pause_service
from .reset import create_reset_service

SERVICES: tuple[Callable[[Context], None], ...] = (create_reset_service, create_pause_service)
