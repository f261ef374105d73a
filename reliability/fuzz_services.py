"""Bad requests to the services of a live node, most of all for its parameters."""

from __future__ import annotations

import time

import numpy as np
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter as RclpyParameter
from std_srvs.srv import Trigger

from cloth_ros.scene.parameter import PARAMETERS

from .junk import DEFAULTS, NAMES
from .live import Live, to_set
from .tally import Tally, is_clear

FIXED = [name for name in NAMES if PARAMETERS[name].fixed]
_OTHERS = ['', '.', 'sheet', 'rates', 'a b', 'é', 'x' * 10_000, 'use_sim_time', 'sheet.rows.x']
_REALS = [np.nan, np.inf, -np.inf, 5e-324, 1e308, -1.0, -0.0, 0.0, 1e-9, 0.5, 1.0, 2.5, 1e3, 1e9]
_WHOLE = [0, 1, -1, 2, 3, 7, 65, 1024, 2**31, 2**53 + 1, 2**63 - 1, -(2**63)]
_TEXTS = [
    *(
        '',
        ' ',
        'auto',
        'magic',
        'double',
        'single',
        'coarsen',
        '0,0',
        '0,:',
        '99,0',
        '::0,0',
        'a,b',
    ),
    *('9' * 200 + ',0', '9' * 5000, '\n', 'x' * 100_000, '-1,-1', '1:1,0', 'é', '0,0,0'),
]
_LENGTHS = [0, 1, 2, 3, 3, 3, 4, 5, 5000]


def value(generator: np.random.Generator, kind: int) -> ParameterValue:
    """Return a value of a kind of `ParameterType`, which may be one that there is not."""

    def some(choices: list) -> list:
        length = generator.choice(_LENGTHS)
        return [choices[i] for i in generator.integers(len(choices), size=length)]

    result = ParameterValue(type=kind)
    if kind == ParameterType.PARAMETER_BOOL:
        result.bool_value = bool(generator.integers(2))
    elif kind == ParameterType.PARAMETER_INTEGER:
        result.integer_value = int(generator.choice(_WHOLE))
    elif kind == ParameterType.PARAMETER_DOUBLE:
        result.double_value = float(generator.choice(_REALS))
    elif kind == ParameterType.PARAMETER_STRING:
        result.string_value = _TEXTS[generator.integers(len(_TEXTS))]
    elif kind == ParameterType.PARAMETER_BYTE_ARRAY:
        result.byte_array_value = some([b'\0', b'\xff', b'a'])
    elif kind == ParameterType.PARAMETER_BOOL_ARRAY:
        result.bool_array_value = some([True, False])
    elif kind == ParameterType.PARAMETER_INTEGER_ARRAY:
        result.integer_array_value = some(_WHOLE)
    elif kind == ParameterType.PARAMETER_DOUBLE_ARRAY:
        result.double_array_value = some(_REALS)
    elif kind == ParameterType.PARAMETER_STRING_ARRAY:
        result.string_array_value = some(_TEXTS)[:1000]
    return result


def _kind_of(default: object) -> int:
    """Return the kind that a parameter has."""
    coerce_types = default if not isinstance(default, tuple) else list(default)
    return int(RclpyParameter('', value=coerce_types).type_.value)


def _parameter(generator: np.random.Generator) -> Parameter:
    """Return a parameter, most often of the right kind."""
    if generator.random() < 0.1:
        name = _OTHERS[generator.integers(len(_OTHERS))]
        return Parameter(name=name, value=value(generator, int(generator.integers(11))))
    name = NAMES[generator.integers(len(NAMES))]
    right = generator.random() < 0.7
    kind = _kind_of(DEFAULTS[name]) if right else int(generator.choice([*range(11), 99, 255]))
    return Parameter(name=name, value=value(generator, kind))


def _all(running: Live) -> list[ParameterValue]:
    request = GetParameters.Request(names=NAMES)
    return running.listener.call(GetParameters, '/cloth/get_parameters', request).values


def _set(running: Live, tally: Tally, parameters: list[Parameter], *, atomically: bool) -> None:
    """Set parameters; where one of several is refused atomically, all must be as before."""
    before = _all(running)
    listener = running.listener
    if atomically:
        service, kind = '/cloth/set_parameters_atomically', SetParametersAtomically
    else:
        service, kind = '/cloth/set_parameters', SetParameters
    answer = listener.call(kind, service, kind.Request(parameters=parameters))
    results = [answer.result] if atomically else answer.results
    # What each answer is to.
    asked = [parameters] if atomically else [[each] for each in parameters]
    if len(results) != len(asked):
        tally.blame(f'{len(results)} answers', parameters)
    for result, of in zip(results, asked, strict=False):
        reason = result.reason
        # What rclpy says of names that are none of the scene is its own.
        own = all(each.name in PARAMETERS for each in of)
        if result.successful:
            tally.accepted += 1
        elif is_clear(reason) if own else (reason.isprintable() and 0 < len(reason) < 1000):
            tally.refused += 1
        else:
            tally.blame(f'no clear reason: {reason[:200]!r}', of)
    if not any(result.successful for result in results) and _all(running) != before:
        tally.blame('refused, and changed', parameters)


def _counted(running: Live) -> int:
    """Return how many requests the node says that it has refused."""
    running.next_report()  # that one may be on its way from before the last request
    return int(running.next_report().values['rejected parameters'])


def parameters(running: Live, cases: int) -> Tally:
    """Send requests that set parameters, one to five at once, one by one or together."""
    tally = Tally('', 'set, or refused with a reason, counted, and all as before; it runs on')
    generator, requests = np.random.default_rng(0), 0
    before = _counted(running)
    while tally.cases < cases:
        requests += 1
        chosen = [_parameter(generator) for _ in range(generator.integers(1, 6))]
        _set(running, tally, chosen, atomically=bool(generator.integers(2)))
        if running.listener.not_finite:
            tally.blame('a state that is not finite', chosen)
            running.listener.not_finite = 0
    tally.what = f'answers to {requests:,} requests to set parameters of the node'
    counted = _counted(running) - before
    if counted < tally.refused:  # more where a request was sent again, as its answer was lost
        tally.blame(f'{counted} counted, of {tally.refused} refused', 'all requests')
    return tally


def restore(running: Live) -> None:
    """Set everything that is not fixed to its default, and wait until the node keeps real time."""
    changed = {name: DEFAULTS[name] for name in NAMES if name not in FIXED}
    changed |= {'rate': running.rate, 'use_sim_time': False}
    request = SetParametersAtomically.Request(parameters=to_set(changed).parameters)
    service = '/cloth/set_parameters_atomically'
    answer = running.listener.call(SetParametersAtomically, service, request)
    assert answer.result.successful, answer.result.reason
    running.listener.call(Trigger, '/cloth/reset', Trigger.Request())
    running.recover(time.monotonic())


def questions(running: Live, cases: int) -> Tally:
    """Ask for parameters that there are not."""
    tally = Tally(
        'requests to read parameters of the node', 'answered; it runs on', ('refused', 'answered')
    )
    generator = np.random.default_rng(0)
    asked = {
        GetParameters: '/cloth/get_parameters',
        GetParameterTypes: '/cloth/get_parameter_types',
        DescribeParameters: '/cloth/describe_parameters',
    }
    known = [*NAMES, *_OTHERS, *_TEXTS]
    for _ in range(cases):
        names = [known[i] for i in generator.integers(len(known), size=generator.integers(5))]
        if generator.integers(4):
            kind = list(asked)[generator.integers(len(asked))]
            running.listener.call(kind, asked[kind], kind.Request(names=names))
        else:
            depth = int(generator.choice(np.array([0, 1, 2**63, 2**64 - 1], np.uint64)))
            request = ListParameters.Request(prefixes=names, depth=depth)
            running.listener.call(ListParameters, '/cloth/list_parameters', request)
        tally.accepted += 1
    return tally
