"""
MuJoCo: a two-dimensional flex on a grid, whose elasticity is integrated implicitly.

MuJoCo rejects its implicit integrators for an elastic flex and requires `discrete`.  Contacts are
disabled.  Edge constraints, the other model of cloth, were slower at equal stiffness.  One step
per tick is stable and four times as fast as this, but dissipates so much energy that the sheet
falls too slowly: after 1 s its lowest point is 0.63 m below the pins instead of 0.15 m.  With 2
and 4 steps it is 0.34 and 0.21 m; this benchmark uses 4.  From 128 × 128 on MuJoCo warns that the
inertia matrix is nearly singular, and the motion differs from that of coarser sheets.
"""

from __future__ import annotations

from typing import Any

NAME = 'MuJoCo flex'

_TICK = 1 / 60
_STEPS = 4

# In the continuum limit the springs of the sheet are a membrane of 950 N/m along rows and columns
# (500, 250 by the diagonals, 200 by the springs across two spacings): E d / (1 - nu**2).
_THICKNESS = 1e-3
_POISSON = 0.25
_YOUNG = 950 * (1 - _POISSON**2) / _THICKNESS

_MODEL = """
<mujoco>
  <option timestep="{step}" integrator="discrete">
    <flag contact="disable"/>
  </option>
  <worldbody>
    <flexcomp name="sheet" type="grid" dim="2" count="{size} {size} 1" mass="0.2" pos="0 0 1.5"
              spacing="{spacing} {spacing} {spacing}" radius="0.001">
      <contact selfcollide="none" contype="0" conaffinity="0"/>
      <elasticity young="{young}" poisson="{poisson}" thickness="{thickness}"
                  elastic2d="stretch"/>
      <pin id="0 {corner}"/>
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

    def __init__(self, size: int) -> None:
        import mujoco

        self.settings = (
            f'flex elasticity (stretch), discrete integrator, {_STEPS} steps of '
            f'{1e3 * _TICK / _STEPS:.1f} ms a tick'
        )
        model = mujoco.MjModel.from_xml_string(
            _MODEL.format(
                step=_TICK / _STEPS,
                size=size,
                spacing=1 / (size - 1),
                young=_YOUNG,
                poisson=_POISSON,
                thickness=_THICKNESS,
                # The first index of MuJoCo's grid is that along y.
                corner=size * (size - 1),
            )
        )
        self._size = size
        self._model = model
        self._data = mujoco.MjData(model)
        self._step = mujoco.mj_step
        mujoco.mj_forward(model, self._data)

    def advance(self) -> None:
        """Simulate 1/60 s."""
        self._step(self._model, self._data, _STEPS)

    def positions(self) -> Any:
        """Return the positions, m, shape (size, size, 3)."""
        grid = self._data.flexvert_xpos.reshape(self._size, self._size, 3)
        return grid.swapaxes(0, 1).copy()
