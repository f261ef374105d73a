"""The health of a running cloth, after REP-107."""

from __future__ import annotations

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header


def diagnostics_message(
    header: Header, name: str, warning: str, values: Mapping[str, object]
) -> DiagnosticArray:
    """
    Return a diagnostic array with one status.

    Arguments
    ---------
    header
        Its stamp is the time of the diagnosis.
    name
        Full name of the node.
    warning
        What is wrong, or an empty string.
    values
        What was measured, with units in the names.

    """
    status = DiagnosticStatus(
        level=DiagnosticStatus.WARN if warning else DiagnosticStatus.OK,
        name=f'{name}: simulation',
        message=warning or 'running in real time',
        hardware_id='none',
        values=[
            KeyValue(key=key, value=f'{value:.6g}' if isinstance(value, float) else str(value))
            for key, value in values.items()
        ],
    )
    return DiagnosticArray(header=header, status=[status])
