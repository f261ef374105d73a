"""Diagnostics of a running cloth as a DiagnosticArray, after REP-107."""

from __future__ import annotations

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header


def diagnostics_message(
    header: Header, name: str, message: str, values: Mapping[str, object], level: bytes
) -> DiagnosticArray:
    """
    Return a diagnostic array with one status.

    Parameters
    ----------
    header
        Its stamp is the time of the report.
    name
        Full name of the node.
    message
        State of the cloth in a few words.
    values
        Measured values by name; the names include the unit.
    level
        OK, WARN or ERROR of DiagnosticStatus.

    """
    status = DiagnosticStatus(
        level=level,
        name=f'{name}: simulation',
        message=message,
        hardware_id='none',
        values=[
            KeyValue(key=key, value=f'{value:.6g}' if isinstance(value, float) else str(value))
            for key, value in values.items()
        ],
    )
    return DiagnosticArray(header=header, status=[status])
