"""Fixtures: a private ROS domain for each test, and a node as a process in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from ros import NODE, Probe, Process, environment, free_domain, probing


@pytest.fixture
def domain() -> Iterator[int]:
    """A ROS domain that no other test on this machine uses meanwhile."""
    with free_domain() as number:
        yield number


@pytest.fixture
def start(domain: int) -> Iterator[Callable[..., Process]]:
    """Start a command in the domain, with environment variables; it is ended after the test."""
    started: list[Process] = []

    def start_process(*command: str, **variables: str) -> Process:
        process = Process(command, {**environment(domain), **variables})
        started.append(process)
        return process

    yield start_process
    for process in started:
        process.end()


@pytest.fixture
def start_cloth(start: Callable[..., Process]) -> Callable[..., Process]:
    """Start the node with parameters and other ROS arguments, and wait until it publishes."""

    def start_node(*ros_arguments: str, **parameters: object) -> Process:
        arguments = list(ros_arguments)
        for name, value in parameters.items():
            arguments += ['-p', f'{name.replace("__", ".")}:={value}']
        node = start(*NODE, '--ros-args', *arguments)
        node.wait_for_output('publishing')
        return node

    return start_node


@pytest.fixture
def probe(domain: int) -> Iterator[Probe]:
    """A node of the test's own in the domain."""
    with probing(domain) as node:
        yield node
