"""Pins and colliders of one cloth in the scene; handles to drag and turn the colliders."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh
import viser

from .marker_shapes import Shape, Shapes
from .pose import Pose, commanded_pose

_COLOUR, _PLANE_COLOUR, _PIN_COLOUR = (74, 125, 196), (226, 228, 231), (242, 191, 38)
_GRIPPER_COLOUR = (60, 160, 90)
# Pins are drawn larger than their markers, up to this diameter, m, but not smaller than a share of
# the distance between them: those of fine grids would not be seen.
_PIN_ENLARGED, _LARGE_PIN, _LEAST_SHARE = 1.6, 0.022, 0.014

# Called with the name of a collider and the pose that the page commands.
Move = Callable[[str, Pose], None]


class ColliderView:
    """
    Draw pins and colliders.

    Parameters
    ----------
    scene
        Of the page.
    path
        Of the parent in the scene tree.
    move
        Called in a thread of the page when a handle is dragged.

    """

    def __init__(self, scene: viser.SceneApi, path: str, move: Move) -> None:
        self._scene, self._path, self._move = scene, path, move
        self._handles: dict[str, viser.TransformControlsHandle] = {}
        self._pins: viser.SceneNodeHandle | None = None
        self._with_handles = True
        self._parts: dict[str, list[Shape]] = {}
        self._pinned = np.empty((0, 3), np.float32)

    @property
    def has_plane(self) -> bool:
        """True if a plane is shown, which is ground enough."""
        return any(part.is_plane for parts in self._parts.values() for part in parts)

    def show(self, shapes: Shapes) -> None:
        """Show other pins and colliders; those that have not changed stay, also in a drag."""
        if not np.array_equal(shapes.pins, self._pinned):
            self._pinned = shapes.pins
            if self._pins is not None:
                self._pins.remove()
            self._pins = self._add_pins(shapes) if len(shapes.pins) else None
        for name in [*self._handles]:
            if name not in shapes.colliders or not _alike(
                shapes.colliders[name][1], self._parts[name]
            ):
                self._handles.pop(name).remove()
        self._parts = {name: parts for name, (_, parts) in shapes.colliders.items()}
        for name, (pose, parts) in shapes.colliders.items():
            if name in self._handles:
                self.place(name, pose)
            else:
                self._add_collider(name, pose, parts)

    def place(self, name: str, pose: Pose) -> None:
        """Move a collider that others have moved."""
        handle = self._handles.get(name)
        if handle is not None:
            handle.position, handle.wxyz = pose.position, pose.wxyz

    def show_handles(self, visible: bool) -> None:
        """Show or hide what colliders are dragged by."""
        self._with_handles = visible
        for handle in self._handles.values():
            handle.active_axes = (visible,) * 3

    def _add_pins(self, shapes: Shapes) -> viser.SceneNodeHandle:
        own = shapes.pin_diameter
        diameter = min(_PIN_ENLARGED * own, max(own, _LARGE_PIN))
        diameter = max(diameter, _LEAST_SHARE * float(np.ptp(shapes.pins, 0).max()))
        ball = trimesh.creation.icosphere(1, diameter / 2)
        count = len(shapes.pins)
        return self._scene.add_batched_meshes_simple(
            f'{self._path}/pins',
            np.asarray(ball.vertices, np.float32),
            np.asarray(ball.faces, np.uint32),
            np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (count, 1)),
            shapes.pins,
            batched_colors=np.array(_PIN_COLOUR, np.uint8),
            lod='off',
        )

    def _add_collider(self, name: str, pose: Pose, parts: list[Shape]) -> None:
        path = f'{self._path}/colliders/{name}'
        largest = max(max(_extent(part)) for part in parts)
        plane = any(part.is_plane for part in parts)
        # Of a ball nobody sees how it is turned, but of what a gripper holds.
        sphere = all(part.kind == 'sphere' and part.opacity == 1 for part in parts)
        handle = self._scene.add_transform_controls(
            path,
            scale=0.3 if plane else float(np.clip(0.9 * largest, 0.12, 1.0)),
            line_width=3.0,
            disable_rotations=sphere,
            depth_test=False,
            active_axes=(self._with_handles,) * 3,
            position=pose.position,
            wxyz=pose.wxyz,
        )
        for number, part in enumerate(parts):
            self._add_part(f'{path}/part_{number}', part)

        async def dragged(event: viser.TransformControlsEvent) -> None:
            target = event.target
            commanded = commanded_pose(target.position.tolist(), target.wxyz.tolist())
            if commanded is not None:
                self._move(name, commanded)

        handle.on_update(dragged)
        self._handles[name] = handle

    def _add_part(self, path: str, part: Shape) -> None:
        colour = _PLANE_COLOUR if part.is_plane else _COLOUR
        x, y, z = part.size
        position, wxyz = part.pose
        if part.kind == 'sphere':
            opacity = None if part.opacity == 1 else part.opacity
            self._scene.add_icosphere(
                path, x / 2, colour if opacity is None else _GRIPPER_COLOUR, subdivisions=3,
                position=position, wxyz=wxyz, opacity=opacity,
            )  # fmt: skip
        elif part.kind == 'box':
            self._scene.add_box(
                path,
                colour,
                (x, y, z),
                position=position,
                wxyz=wxyz,
                cast_shadow=not part.is_plane,
            )
        elif part.kind == 'cylinder':
            self._scene.add_cylinder(
                path, x / 2, z, colour, radial_segments=48, position=position, wxyz=wxyz
            )
        else:
            corners = part.triangles.reshape(-1, 3)
            faces = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
            self._scene.add_mesh_simple(
                path, corners, faces, color=colour, flat_shading=True,
                side='double', position=position, wxyz=wxyz,
            )  # fmt: skip


def _extent(part: Shape) -> tuple[float, ...]:
    if part.kind == 'mesh' and len(part.triangles):
        return tuple(np.ptp(part.triangles, (0, 1)).tolist())
    return part.size


def _alike(some: list[Shape], others: list[Shape]) -> bool:
    """Return whether two colliders look the same, but for their poses."""
    return len(some) == len(others) and all(
        one.kind == other.kind
        and one.triangles.shape == other.triangles.shape
        and np.allclose(one.size, other.size, rtol=1e-4, atol=1e-6)
        and np.allclose(one.triangles, other.triangles, atol=1e-6)
        for one, other in zip(some, others, strict=True)
    )
