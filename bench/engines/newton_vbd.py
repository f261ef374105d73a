"""
Newton: vertex block descent on the CPU, through Warp.

As in Newton's cloth examples, the sheet is a grid of elastic triangles with coloured vertices, and
the substeps of a tick are captured once and replayed.  The examples use 10 substeps of 10
iterations.  More substeps of one iteration cost less at equal strain; their number is the least
that keeps the largest strain after 1 s below 0.3, up to 64 × 64.  Newton's springs could have the
stencil of this sheet, but were not faster at equal strain, and unstable with some numbers of
substeps and iterations.
"""

from __future__ import annotations

from typing import Any

NAME = 'Newton VBD'

_TICK = 1 / 60

# Even: the two states are swapped in each substep, and a captured tick must end with the first.
_SUBSTEPS = {16: 6, 32: 12, 64: 28, 128: 80}

# In the continuum limit the springs of the sheet are a membrane of 950 N/m along rows and columns
# (500, 250 by the diagonals, 200 by the springs across two spacings) and of 250 N/m in shear and
# across.  Newton's parameters are Lamé's; these preserve the first, ka + 2 ke, and the last, ka.
_KE = 350.0
_KA = 250.0


def version() -> str:
    """Return the version of Newton."""
    import newton

    return str(newton.__version__)


class Sheet:
    """The benchmark's sheet of `size` × `size` particles."""

    def __init__(self, size: int) -> None:
        import warp

        warp.config.quiet = True
        import newton

        warp.set_device('cpu')
        self._substeps = _SUBSTEPS.get(size, 2 * (5 * size // 16))
        self.settings = f'VBD, triangles, {self._substeps} substeps a tick, 1 iteration'
        self._size = size
        self._launch = warp.capture_launch

        spacing = 1 / (size - 1)
        builder = newton.ModelBuilder()
        builder.add_cloth_grid(
            pos=warp.vec3(-0.5, -0.5, 1.5),
            rot=warp.quat_identity(),
            vel=warp.vec3(0.0, 0.0, 0.0),
            dim_x=size - 1,
            dim_y=size - 1,
            cell_x=spacing,
            cell_y=spacing,
            mass=0.2 / size**2,
            tri_ke=_KE,
            tri_ka=_KA,
            tri_kd=0.0,
            edge_ke=0.0,
            edge_kd=0.0,
            particle_radius=0.001,
        )
        for corner in (0, size - 1):
            builder.particle_mass[corner] = 0.0
            builder.particle_flags[corner] &= ~int(newton.ParticleFlags.ACTIVE)
        builder.color()
        self._model = builder.finalize()
        self._solver = newton.solvers.SolverVBD(self._model, iterations=1)
        self._control = self._model.control()
        self._state = self._model.state()
        self._next = self._model.state()

        # Warp loads code at the first launch, which cannot be captured: one tick, then a reset.
        self._tick()
        self._state.assign(self._model.state())
        with warp.ScopedCapture() as capture:
            self._tick()
        self._graph = capture.graph
        self._state.assign(self._model.state())

    def _tick(self) -> None:
        for _ in range(self._substeps):
            self._state.clear_forces()
            self._solver.step(self._state, self._next, self._control, None, _TICK / self._substeps)
            self._state, self._next = self._next, self._state

    def advance(self) -> None:
        """Simulate 1/60 s."""
        self._launch(self._graph)

    def positions(self) -> Any:
        """Return the positions, m, shape (size, size, 3)."""
        return self._state.particle_q.numpy().reshape(self._size, self._size, 3).copy()
