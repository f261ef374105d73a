"""Packets of contacts: a sweep over them is one over their contacts, one after the other."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cloth_ros.model.kernels.jit import kernel
from cloth_ros.model.self_contact import sheet_contacts as layout
from cloth_ros.model.self_contact.contact_order import pack, write_packets
from cloth_ros.model.self_contact.sheet_contacts import SheetContacts

Array = NDArray[np.float32]

LENGTH = np.float32(1e-3)  # s


@kernel
def _sweep(length, position, velocity, former, contacts):  # type: ignore[no-untyped-def]
    """Make a sweep as the kernel of kicks and drifts does."""
    for group in range(3):
        layout.copy_particles(group, length, position, velocity, former, contacts)
        layout.sweep(group, length, contacts)
    for group in range(3):
        layout.write_back(group, length, position, velocity, contacts)


class Pile:
    """Particles and contacts at random: flat arrays, and numbers about contacts."""

    def __init__(self, seed: int, count: int, particles: int, *, supported: bool) -> None:
        random = np.random.default_rng(seed)
        self.count, self.particles = count, particles
        self.position = random.normal(size=(3, particles)).astype(np.float32)
        self.former = random.normal(size=(3, particles)).astype(np.float32)
        kick = random.normal(size=(3, particles))
        self.velocity = (self.former + 0.1 * kick).astype(np.float32)
        self.supports = np.zeros((particles, 4), np.float32)
        self.supports[:, 3] = -np.inf
        if supported:
            chosen = random.random(particles) < 0.3
            self.supports[chosen] = 0.0, 0.0, 1.0, 0.0
        every = np.tile(np.arange(particles), (count, 1))
        self.contacts = random.permuted(every, axis=1)[:, : layout.CORNERS]
        weights = random.random((count, 4)).astype(np.float32)
        self.rows = np.zeros((count, layout.ROW), np.float32)
        self.rows[:, layout.WEIGHTS : layout.WEIGHTS + 3] = -weights[:, 1:]
        self.rows[:, layout.INVERSE_MASSES : layout.INVERSE_MASSES + 4] = weights
        normal = random.normal(size=(count, 3))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        self.rows[:, layout.NORMAL : layout.NORMAL + 3] = normal
        self.rows[:, layout.REST] = 0.1
        self.rows[:, layout.MASS] = 1.0
        self.rows[:, layout.LACK] = random.choice([0.0, 0.03, 0.09], count)
        self.rows[:, layout.HARDNESS] = 1.0
        touched = (self.supports[self.contacts, 3] == 0.0).any(axis=1)
        self.rows[:, layout.SUPPORTED] = touched

    def packets(self, *, divided: bool) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
        """Return the contacts of each packet, and where groups begin."""
        slots = np.zeros((self.count, layout.LANES), np.int32)
        starts = np.zeros(4, np.int64)
        after = np.zeros(self.particles, np.int32)
        following, filled = np.zeros((2, self.count + 1), np.int32)
        pack(
            self.contacts, self.rows, self.count, divided, self.position, after, following, filled,
            slots, starts,
        )  # fmt: skip
        assert not after.any()
        return slots[: starts[3]], starts

    def swept(self, slots: NDArray[np.int32], starts: NDArray[np.int64]) -> tuple[Array, Array]:
        """Return positions and velocities after a sweep over packets."""
        contacts = SheetContacts(
            np.zeros((len(slots), layout.CORNERS * layout.LANES), np.uint32),
            np.zeros((len(slots), layout.PACKET), np.float32),
            starts,
            np.zeros(self.particles, np.uint32),
            np.zeros(4, np.int64),
            np.zeros((self.particles + 1, layout.PARTICLE), np.float32),
            0.5,
        )
        known = np.zeros(self.particles, np.int32)
        write_packets(
            self.contacts, self.rows, slots, starts, self.supports, known, contacts.places,
            contacts.rows, contacts.particles, contacts.firsts, contacts.copies,
        )  # fmt: skip
        assert not known.any()
        position, velocity = self.position.copy(), self.velocity.copy()
        _sweep(LENGTH, position, velocity, self.former, contacts)
        return position, velocity

    def order(self, slots: NDArray[np.int32], starts: NDArray[np.int64]) -> list[int]:
        """Return the contacts in the order in which a sweep treats those that share particles."""
        much = self.rows[:, layout.LACK] > 0.06
        result: list[int] = []
        for first, last in pairwise(starts):
            group = slots[first:last].ravel()
            result += sorted(group[group >= 0], key=lambda c: (much[c], c))
        return result


piles = st.builds(
    Pile,
    st.integers(0, 2**32 - 1),
    st.integers(0, 60),
    st.integers(4, 80),
    supported=st.booleans(),
)


@given(pile=piles, divided=st.booleans())
def test_packets_hold_every_contact_once_and_no_particle_twice(pile: Pile, divided: bool) -> None:
    slots, starts = pile.packets(divided=divided)
    contacts = slots[slots >= 0]
    assert sorted(contacts) == list(range(pile.count))
    for each in slots:
        particles = pile.contacts[each[each >= 0]].ravel()
        assert len(np.unique(particles)) == len(particles) > 0
    groups = [pile.contacts[each[each >= 0]] for each in np.split(slots, starts[1:3])]
    assert not np.intersect1d(groups[0], groups[1]).size


@settings(max_examples=30)
@given(pile=piles, divided=st.booleans())
def test_a_sweep_is_that_of_one_contact_after_the_other(pile: Pile, divided: bool) -> None:
    packets = pile.packets(divided=divided)
    order = pile.order(*packets)
    alone = np.full((pile.count, layout.LANES), -1, np.int32)
    alone[:, 0] = order
    # Each in a packet of its own, all in the last group.
    one_by_one = pile.swept(alone, np.array([0, 0, 0, pile.count]))
    for together, expected in zip(pile.swept(*packets), one_by_one, strict=True):
        np.testing.assert_array_equal(together, expected)


def test_contacts_that_share_nothing_fill_packets() -> None:
    pile = Pile(0, 40, 200, supported=False)
    pile.contacts = np.random.default_rng(0).permutation(200)[:160].reshape(40, 4)
    slots, _ = pile.packets(divided=False)
    assert len(slots) <= 40 // layout.LANES + 1


@pytest.mark.parametrize('supported', [False, True])
def test_what_is_not_pushed_keeps_its_bits(supported: bool) -> None:
    pile = Pile(1, 30, 60, supported=supported)
    pile.rows[:, layout.REST] = -10.0  # all far apart
    position, velocity = pile.swept(*pile.packets(divided=True))
    np.testing.assert_array_equal(position, pile.position)
    np.testing.assert_array_equal(velocity, pile.velocity)


@given(seed=st.integers(0, 2**32 - 1))
def test_a_push_conserves_momentum_and_stops_the_approach(seed: int) -> None:
    pile = Pile(seed, 1, layout.CORNERS, supported=False)
    weights = np.array([1.0, -0.2, -0.3, -0.5])  # a vertex above a triangle
    row, particles = pile.rows[0], pile.contacts[0]
    row[layout.WEIGHTS : layout.WEIGHTS + 3] = weights[1:]
    row[layout.INVERSE_MASSES : layout.INVERSE_MASSES + 4] = weights
    row[layout.MASS], row[layout.LACK] = 1 / (weights @ weights), 0.0
    normal = row[layout.NORMAL : layout.NORMAL + 3]
    # At its distance at rest before the drift, as fast before the kick as after it.
    pile.former[:] = pile.velocity
    start = pile.position - LENGTH * pile.velocity
    row[layout.REST] = normal @ (start[:, particles] @ weights)
    approach = normal @ (pile.velocity[:, particles] @ weights)
    position, velocity = pile.swept(*pile.packets(divided=False))
    np.testing.assert_allclose(velocity.sum(axis=1), pile.velocity.sum(axis=1), atol=1e-4)
    after = normal @ (velocity[:, particles] @ weights)
    # Up to the rounding of positions, in a drift.
    assert after == pytest.approx(max(approach, 0.0), abs=2e-6 / float(LENGTH))
    change = velocity - pile.velocity
    np.testing.assert_allclose(position, pile.position + LENGTH * change, atol=1e-5)
