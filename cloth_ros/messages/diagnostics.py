"""The health of a running cloth, after REP-107."""

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
        Its stamp is the time of the diagnosis.
    name
        Full name of the node.
    message
        What is to be said of it in a few words.
    values
        What was measured, with units in the names.
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
