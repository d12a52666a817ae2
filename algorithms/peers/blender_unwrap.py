"""Unwrap a mesh with Blender, as a program: MESH.npz UV.npz METHOD.

Run by a Python that has Blender as its module `bpy`, or by Blender itself::

    python blender_unwrap.py MESH.npz UV.npz ANGLE_BASED
    blender --background --factory-startup --python blender_unwrap.py -- MESH.npz UV.npz CONFORMAL

The script needs nothing from cembench, so it runs in whatever Python Blender has.
"""

import sys
import time

import numpy as np


def version() -> None:
    """Print Blender's version."""
    import bpy

    print(f"Blender {bpy.app.version_string}")


def main(given: str, left: str, method: str) -> None:
    """Read V and F, unwrap them as one island without a seam, and write a UV for each corner."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    with np.load(given) as arrays:
        V, F = arrays["V"], arrays["F"]
    mesh = bpy.data.meshes.new("surface")
    mesh.from_pydata(V.tolist(), [], F.tolist())
    surface = bpy.data.objects.new("surface", mesh)
    bpy.context.collection.objects.link(surface)
    bpy.context.view_layer.objects.active = surface
    surface.select_set(True)
    mesh.uv_layers.new(name="uv")
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    started = time.perf_counter()
    done = bpy.ops.uv.unwrap(method=method, margin=0.0)
    seconds = time.perf_counter() - started
    bpy.ops.object.mode_set(mode="OBJECT")
    if done != {"FINISHED"}:
        sys.exit(f"Blender did not unwrap: {done}")
    uv = np.empty(2 * len(mesh.loops), dtype=np.float32)
    mesh.uv_layers.active.data.foreach_get("uv", uv)
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    if not np.array_equal(corners.reshape(-1, 3), F):
        sys.exit("Blender changed the triangles that it was given")
    np.savez(left, uv=uv.reshape(-1, 2).astype(np.float64), fuv=np.arange(F.size).reshape(-1, 3))
    print(f"solve: {seconds:.9f} s")


if __name__ == "__main__":
    words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    if words:
        main(*words)
    else:
        version()
