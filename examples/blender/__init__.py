"""Open a run of wavetank in Blender 4.4 or later, ready to be rendered with Cycles.

As an extension: zip this folder, Edit > Preferences > Get Extensions > Install from Disk; then File > Import > wavetank
run. As a script: blender --python examples/blender/__init__.py -- out/drop.usda
"""

import re
import sys
from pathlib import Path

import bpy

WATER_IOR = 1.333
SUN = 3.0  # W/m^2
SKY = (0.62, 0.7, 0.8, 1.0)
FOAM = ("spray", "foam", "bubbles")


def open_run(path):
    """Import the stage that `--export usd` wrote, and set up what USD's preview materials do not say.

    Water refracts, foam is white, frames and camera are those of the stage. Where there is a surface the particles are
    not rendered. Return the objects by the names of their prims.
    """
    scene, known = bpy.context.scene, set(bpy.data.objects)
    bpy.ops.wm.usd_import(filepath=str(path), set_frame_range=True, import_usd_preview=True)
    found = {one.name: one for one in bpy.data.objects if one not in known}
    head = Path(path).read_text("utf-8", "replace")  # USD as text, some hundred bytes
    told = {name: float(number) for name, number in re.findall(r"^ *(\w+TimeCode|\w+PerSecond) = ([\d.]+)", head, re.M)}
    scene.render.fps = max(1, round(told["timeCodesPerSecond"]))
    scene.frame_start, scene.frame_end = round(told["startTimeCode"]), round(told["endTimeCode"])
    surfaces = [one for one in found.values() if one.type == "MESH" and _prim(one).startswith("/World/surface/")]
    for one in surfaces:
        color = one.data.materials[0].diffuse_color if one.data.materials else (0.03, 0.21, 0.63, 1.0)
        _give(one, water(f"{one.name} water", color))
        one.data.shade_smooth()
    for name, one in found.items():
        if name.split(".")[0] in FOAM and one.type == "POINTCLOUD":
            _give(one, plain("wavetank foam", (0.9, 0.9, 0.9, 1.0)))
        elif name.startswith("particles") and one.type == "POINTCLOUD":
            _give(one, plain("wavetank particles", (0.03, 0.21, 0.63, 1.0), attribute="displayColor"))
            one.hide_render = bool(surfaces)
        elif one.type == "MESH" and one not in surfaces:
            one.data.set_sharp_from_angle(angle=0.6)
        elif one.type == "CAMERA":
            scene.camera = one
        elif one.type == "LIGHT":
            one.data.energy = SUN
    sky = bpy.data.worlds.new("wavetank sky")
    sky.use_nodes = True
    sky.node_tree.nodes["Background"].inputs["Color"].default_value = SKY
    scene.world = sky
    scene.render.engine = "CYCLES"
    scene.cycles.caustics_refractive = True
    _floor(scene)
    scene.frame_set(scene.frame_start)
    return found


def _prim(one):
    """Return the path of the animated prim that an object is of; nothing for others."""
    return next((modifier.object_path for modifier in one.modifiers if modifier.type == "MESH_SEQUENCE_CACHE"), "")


def water(name, color):
    """Return a material that refracts, as clear as water and tinted a little."""
    material, shader = _principled(name)
    shader.inputs["Base Color"].default_value = [0.5 + 0.5 * min(1.0, c) for c in color[:3]] + [1.0]
    shader.inputs["Transmission Weight"].default_value = 1.0
    shader.inputs["IOR"].default_value = WATER_IOR
    shader.inputs["Roughness"].default_value = 0.02
    return material


def plain(name, color, attribute=""):
    """Return a matt material of one colour, or of the colours that points have."""
    material, shader = _principled(name)
    shader.inputs["Base Color"].default_value = color
    shader.inputs["Roughness"].default_value = 0.6
    if attribute:
        node = material.node_tree.nodes.new("ShaderNodeAttribute")
        node.attribute_name = attribute
        material.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    return material


def _principled(name):
    material = bpy.data.materials.new(name)
    if not material.use_nodes:
        material.use_nodes = True
    return material, material.node_tree.nodes["Principled BSDF"]


def _give(one, material):
    one.data.materials.clear()
    one.data.materials.append(material)


def _floor(scene):
    """Put a floor below everything, which water without one would hang in nothing over."""
    corners = [
        one.matrix_world @ type(one.location)(corner)
        for one in scene.objects
        if one.type in ("MESH", "CURVES")
        for corner in one.bound_box
    ]
    if not corners:
        return
    low = min(corner.z for corner in corners)
    size = max(max(abs(corner.x), abs(corner.y)) for corner in corners)
    bpy.ops.mesh.primitive_plane_add(size=40.0 * size, location=(0.0, 0.0, low - 0.002 * size))
    floor = bpy.context.object
    floor.name = "floor"
    _give(floor, plain("wavetank floor", (0.6, 0.6, 0.58, 1.0)))


class IMPORT_OT_wavetank_run(bpy.types.Operator):  # noqa: N801 (Blender asks for such a name)
    """Open a run of wavetank: a .usda that `wavetank run --export usd` wrote."""

    bl_idname = "import_scene.wavetank_run"
    bl_label = "wavetank run"
    bl_options = {"REGISTER", "UNDO"}
    filepath: bpy.props.StringProperty(subtype="FILE_PATH")
    filter_glob: bpy.props.StringProperty(default="*.usda;*.usd", options={"HIDDEN"})

    def execute(self, context):
        """Open the file that was chosen."""
        open_run(Path(self.filepath))
        return {"FINISHED"}

    def invoke(self, context, event):
        """Ask for a file."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}


def _entry(menu, context):
    menu.layout.operator(IMPORT_OT_wavetank_run.bl_idname, text="wavetank run (.usda)")


def register():
    """Add the entry of the menu."""
    bpy.utils.register_class(IMPORT_OT_wavetank_run)
    bpy.types.TOPBAR_MT_file_import.append(_entry)


def unregister():
    """Take it away."""
    bpy.types.TOPBAR_MT_file_import.remove(_entry)
    bpy.utils.unregister_class(IMPORT_OT_wavetank_run)


if __name__ == "__main__" and "--" in sys.argv:
    for one in [*bpy.data.objects]:
        bpy.data.objects.remove(one)
    open_run(Path(sys.argv[sys.argv.index("--") + 1]).resolve())
