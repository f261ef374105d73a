"""
MuJoCo: a two-dimensional flex on a grid, whose elasticity is integrated implicitly.

MuJoCo rejects its implicit integrators for an elastic flex and requires `discrete`.  Contacts of
the hanging sheet are disabled.  Edge constraints, the other model of cloth, were slower at equal
stiffness.  One step per tick is stable and four times as fast as this, but dissipates so much
energy that the sheet falls too slowly: after 1 s its lowest point is 0.63 m below the pins instead
of 0.15 m.  With 2 and 4 steps it is 0.34 and 0.21 m; this benchmark uses 4.  From 128 × 128 on
MuJoCo warns that the inertia matrix is nearly singular, and the motion differs from that of
coarser sheets.

The dropped sheet collides by its triangles, to which MuJoCo gives a radius.  On the box at
16 × 16, depth at rest and real-time factor with a radius of 5 mm were 17 mm and 4.5 with one step
per tick, 17 mm and 2.8 with two, 9 mm and 2.5 with four, 13 mm and 1.0 with eight; stiffer
contacts (`solref`, `solimp`), a margin, damping and passive contacts (`passive`) left 4 to 12 mm.
With a radius of 0.3 spacings, 20 mm, nothing sinks in, with one step as with more, and one is
about twice as fast as two; at 32 × 32 a radius of half as much leaves 7 mm.  Conjugate gradients
were as fast as the Newton solver at 16 × 16 and 1.2 to 1.5 times as fast at 32 × 32; `PGS` is
refused for a flex.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..drop import BOX_EDGE, FRICTION, HEIGHT
from ..fold import THICKNESS, start

NAME = 'MuJoCo flex'

_TICK = 1 / 60
_STEPS = 4

# In the continuum limit the springs of the sheet are a membrane of 950 N/m along rows and columns
# (500, 250 by the diagonals, 200 by the springs across two spacings): E d / (1 - nu**2).
_THICKNESS = 1e-3
_POISSON = 0.25
_YOUNG = 950 * (1 - _POISSON**2) / _THICKNESS

# Of the dropped sheet: half its thickness in spacings, and steps per tick.
_RADIUS = 0.3
_DROP_STEPS = 1

# Of the sheet that falls on itself.
_FOLD_STEPS = 1

_SUPPORTS = {
    'corners': '',
    'table': '<geom type="plane" size="2 2 1" friction="{friction}"/>',
    'folded': '<geom type="plane" size="2 2 1" friction="{friction}"/>',
    'box': (
        '<geom type="box" size="{half} {half} {half}" pos="0 0 -{half}" friction="{friction}"/>'
    ),
}

_MODEL = """
<mujoco>
  <option timestep="{step}" integrator="discrete" solver="{solver}">
    <flag contact="{contact}"/>
  </option>
  <worldbody>
    {support}
    <flexcomp name="sheet" type="grid" dim="2" count="{size} {size} 1" mass="0.2"
              pos="0 0 {height}" spacing="{spacing} {spacing} {spacing}" radius="{radius}">
      <contact selfcollide="{self}" contype="{collides}" conaffinity="{collides}"
               friction="{friction}"/>
      <elasticity young="{young}" poisson="{poisson}" thickness="{thickness}"
                  elastic2d="stretch"/>
      {pin}
    </flexcomp>
  </worldbody>
</mujoco>
"""


def version() -> str:
    """Return the version of MuJoCo."""
    import mujoco

    return str(mujoco.__version__)


class Sheet:
    """The benchmark's sheet of `size` × `size` particles."""

    def __init__(self, size: int, support: str = 'corners') -> None:
        import mujoco

        hanging = support == 'corners'
        folded = support == 'folded'
        self._steps = _STEPS if hanging else _FOLD_STEPS if folded else _DROP_STEPS
        self.settings = (
            f'flex elasticity (stretch), discrete integrator, {self._steps} '
            f'step{"s" * (self._steps > 1)} of {1e3 * _TICK / self._steps:.1f} ms a tick'
        )
        spacing = 1 / (size - 1)
        radius = 0.001 if hanging else _RADIUS * spacing
        if folded:
            radius = THICKNESS / 2
            self.settings += ', conjugate gradients'
        elif not hanging:
            self.settings += f', conjugate gradients, radius {_RADIUS:g} spacings'
        model = mujoco.MjModel.from_xml_string(
            _MODEL.format(
                step=_TICK / self._steps,
                solver='Newton' if hanging else 'CG',
                contact='disable' if hanging else 'enable',
                collides=int(not hanging),
                support=_SUPPORTS[support].format(half=BOX_EDGE / 2, friction=FRICTION),
                size=size,
                height=1.5 if hanging else HEIGHT,
                spacing=spacing,
                radius=radius,
                self='auto' if folded else 'none',
                friction=FRICTION,
                young=_YOUNG,
                poisson=_POISSON,
                thickness=_THICKNESS,
                # The first index of MuJoCo's grid is that along y.
                pin=f'<pin id="0 {size * (size - 1)}"/>' if hanging else '',
            )
        )
        self._size = size
        self._model = model
        self._data = mujoco.MjData(model)
        self._step = mujoco.mj_step
        if folded:  # coordinates are displacements from the rest shape
            mujoco.mj_forward(model, self._data)
            self._data.qpos[:] = (start(size) - self.positions()).swapaxes(0, 1).ravel()
        mujoco.mj_forward(model, self._data)
        self.triangles = self._triangles()

    def _triangles(self) -> Any:
        """Return corners by row and column of the sheet, shape (n, 3)."""
        index = np.arange(self._size**2).reshape(self._size, self._size).T.ravel()
        return index[self._model.flex_elem.reshape(-1, 3)]

    def advance(self) -> None:
        """Simulate 1/60 s."""
        self._step(self._model, self._data, self._steps)

    def positions(self) -> Any:
        """Return the positions, m, shape (size, size, 3)."""
        grid = self._data.flexvert_xpos.reshape(self._size, self._size, 3)
        return grid.swapaxes(0, 1).copy()
