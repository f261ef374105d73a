"""
Services that command the cloth.

A new service is a module here, with a function that creates it, and one entry below.
"""

from __future__ import annotations

from collections.abc import Callable

from ..context import Context
from .load import create_load_service
from .pause import create_pause_service
from .reset import create_reset_service
from .save import create_save_service
from .simulation_interfaces import create_simulation_interfaces
from .step import create_step_service

SERVICES: tuple[Callable[[Context], None], ...] = (
    create_reset_service,
    create_pause_service,
    create_step_service,
    create_save_service,
    create_load_service,
    create_simulation_interfaces,
)
