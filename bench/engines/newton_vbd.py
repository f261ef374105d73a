"""
Newton: vertex block descent on the CPU, through Warp.

As in Newton's cloth examples, the sheet is a grid of elastic triangles with coloured vertices, and
the substeps of a tick are captured once and replayed.  The examples use 10 substeps of 10
iterations.  More substeps of one iteration cost less at equal strain; their number is the least
that keeps the largest strain after 1 s below 0.3, up to 64 × 64.  Newton's springs could have the
stencil of this sheet, but were not faster at equal strain, and unstable with some numbers of
substeps and iterations.

The dropped sheet collides by its particles, so that the edges of a box enter between them by up to
half a spacing less the particles' radius.  On the box at 16 × 16, where half a spacing is 33 mm,
the depth at rest was 24 mm with a radius of 5 mm, 21 with 10, 13 with 20 and 4 with 30.  Contacts
of whole triangles (`enable_rigid_soft_full_surface_contact`) left 4 to 8 mm with a radius of 5 mm,
and 3 mm with 10, but took 2.4 times as long, found once a tick, and 5 times, found in each
substep.  Particles of 0.45 spacings, found once a tick, are therefore the fastest; a stiffness of
1e4 N/m sinks in less than one of 1e3, and costs nothing.  Substeps: 2 at 16 × 16, 6 at 32 × 32 are
finite, but sink in by 9 and 5 mm, and stretch to 0.23 and 0.19; 18 at 64 × 64 to 0.17.
"""

from __future__ import annotations

from typing import Any

from ..drop import BOX_EDGE, FRICTION, HEIGHT
from ..fold import THICKNESS, start

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


# Of the dropped sheet.
_DROP_SUBSTEPS = {16: 4, 32: 8, 64: 18}
_RADIUS = 0.45  # spacings
_GAP = 0.05  # m beyond the radius in which contacts are found, further than a tick's motion
_CONTACT_STIFFNESS = 1e4  # N/m

# Of the sheet that falls on itself.
_FOLD_SUBSTEPS = {16: 6, 32: 12, 64: 24}
_FOLD_ITERATIONS = 2


class Sheet:
    """The benchmark's sheet of `size` × `size` particles."""

    def __init__(self, size: int, support: str = 'corners') -> None:
        import warp

        warp.config.quiet = True
        import newton

        warp.set_device('cpu')
        hanging = support == 'corners'
        folded = support == 'folded'
        substeps = _SUBSTEPS if hanging else _FOLD_SUBSTEPS if folded else _DROP_SUBSTEPS
        iterations = _FOLD_ITERATIONS if folded else 1
        self._substeps = substeps.get(size, 2 * (5 * size // 16))
        self.settings = f'VBD, triangles, {self._substeps} substeps a tick, {iterations} iteration'
        self.settings += 's' * (iterations > 1)
        if not (hanging or folded):
            self.settings += (
                f', contact of particles of radius {_RADIUS:g} spacings, found once a tick'
            )
        self._size = size
        self._launch = warp.capture_launch

        spacing = 1 / (size - 1)
        radius = 0.001 if hanging else THICKNESS / 2 if folded else _RADIUS * spacing
        builder = newton.ModelBuilder()
        contact = builder.default_shape_cfg
        contact.ke, contact.kd, contact.mu = _CONTACT_STIFFNESS, 0.0, FRICTION
        if support in ('table', 'folded'):
            builder.add_ground_plane()
        if support == 'box':
            half = BOX_EDGE / 2
            below = warp.transform(warp.vec3(0.0, 0.0, -half), warp.quat_identity())
            builder.add_shape_box(-1, xform=below, hx=half, hy=half, hz=half)
        builder.add_cloth_grid(
            pos=warp.vec3(-0.5, -0.5, 1.5 if hanging else HEIGHT),
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
            particle_radius=radius,
        )
        if hanging:
            for corner in (0, size - 1):
                builder.particle_mass[corner] = 0.0
                builder.particle_flags[corner] &= ~int(newton.ParticleFlags.ACTIVE)
        builder.color()
        self._model = model = builder.finalize()
        self._pipeline = self._contacts = None
        if not hanging:
            model.soft_contact_ke = _CONTACT_STIFFNESS
            model.soft_contact_kd = 0.0
            model.soft_contact_mu = FRICTION
            self._pipeline = newton.CollisionPipeline(
                model, broad_phase='nxn', soft_contact_gap=_GAP
            )
            self._contacts = self._pipeline.contacts()
        self._touches_itself = folded
        contact_with_itself = {
            'particle_enable_self_contact': True,
            'particle_self_contact_margin': THICKNESS,
            'particle_self_contact_gap': THICKNESS,
        }
        self._solver = newton.solvers.SolverVBD(
            model, iterations=iterations, **(contact_with_itself if folded else {})
        )
        self._control = model.control()
        self._state = model.state()
        self._next = model.state()
        self.triangles = model.tri_indices.numpy().reshape(-1, 3)

        # Warp loads code at the first launch, which cannot be captured: one tick, then a reset.
        self._begin()
        self._tick()
        self._begin()
        with warp.ScopedCapture() as capture:
            self._tick()
        self._graph = capture.graph
        self._begin()

    def _begin(self) -> None:
        self._state.assign(self._model.state())
        if self._touches_itself:
            self._state.particle_q.assign(start(self._size).reshape(-1, 3))

    def _tick(self) -> None:
        if self._touches_itself:
            self._solver.rebuild_bvh(self._state)
        if self._pipeline is not None:
            self._pipeline.collide(self._state, self._contacts)
        h = _TICK / self._substeps
        for _ in range(self._substeps):
            self._state.clear_forces()
            self._solver.step(self._state, self._next, self._control, self._contacts, h)
            self._state, self._next = self._next, self._state

    def advance(self) -> None:
        """Simulate 1/60 s."""
        self._launch(self._graph)

    def positions(self) -> Any:
        """Return the positions, m, shape (size, size, 3)."""
        return self._state.particle_q.numpy().reshape(self._size, self._size, 3).copy()
