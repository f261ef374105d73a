"""The refinement study: its orders, and a short form of it from beginning to end."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tools import refinement
from tools.marked_block import marks
from tools.refinement import Convergence, Quantity

sizes = st.floats(0.01, 10.0)


@given(st.floats(-10.0, 10.0), sizes, st.floats(0.5, 4.0), st.booleans(), st.booleans())
def test_order_and_limit_are_those_of_a_power_law(limit, factor, order, known, below):
    values = tuple(limit + (-factor if below else factor) * 0.5 ** (order * n) for n in range(4))
    quantity = Quantity('a', 'm', 1e-10, limit if known else None)
    found = Convergence(quantity, (8, 16, 32, 64), values)
    assert found.orders == pytest.approx([order] * (3 if known else 2), rel=1e-6)
    assert found.limit == pytest.approx(limit, abs=1e-6 * factor)


@pytest.mark.parametrize(
    ('values', 'orders', 'limit'),
    [
        ((1.0, 1.0, 1.0 + 1e-14), [math.inf], 1.0),
        ((1.0, 2.0, 1.5), [None], None),  # it oscillates
        ((1.0, 2.0, 4.0), [-1.0], None),  # it grows
        ((1.0, 2.0, 2.0), [None], None),
    ],
)
def test_a_quantity_without_an_order_has_no_limit(values, orders, limit):
    found = Convergence(Quantity('a', 'm', 1e-10), (8, 16, 32), values)
    assert found.orders == orders
    assert found.limit == (None if limit is None else pytest.approx(limit))


@pytest.mark.slow
def test_the_short_form_converges_and_fills_the_page(tmp_path, capsys):
    begin, end = marks(refinement.NAME)
    page = tmp_path / 'refinement.md'
    page.write_text(f'before\n{begin}\nold\n{end}\nafter\n')
    found, measure = [], refinement.measure
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(refinement, 'measure', lambda cells: found.extend(measure(cells)) or found)
        refinement.main(['--quick', '--out', str(tmp_path)])
    names = [each.quantity.name for each in found]
    assert len(set(names)) == len(names) == 9
    for each in found:
        assert each.cells == (8, 16, 32)
        assert all(map(math.isfinite, each.values))
        if each.quantity.exact is None and 'halfway' not in each.quantity.name:
            assert each.orders[-1] > 0.7, each
    text = page.read_text()
    assert text == f'before\n{begin}\n{capsys.readouterr().out.strip()}\n{end}\nafter\n'
    assert all(name in text for name in names)
    assert '32² cells' in text
    assert (tmp_path / 'refinement.png').stat().st_size > 10_000
    assert (tmp_path / 'refinement.svg').read_text().startswith('<?xml')
