"""Blender's Cycles as a peer. Setting: a sampling pattern (BLUE_NOISE, TABULATED_SOBOL). One thread, no clamps, no
largest depth, caustics, light tree, box filter. Diffuse scenes are made from the exported triangles, others are
imported from their glTF file."""
import os
import sys

import numpy as np
from worker import Exported, own_standard_output, serve, timed

import bpy
from mathutils import Matrix, Vector


def blender_axes(v):
    return Vector((v[0], -v[2], v[1]))


def add_material(material):
    m = bpy.data.materials.new(material["name"])
    nodes, link = m.node_tree.nodes, m.node_tree.links.new
    nodes.clear()
    end = nodes.new("ShaderNodeOutputMaterial")
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*material["color"], 1)
    shader = diffuse.outputs[0]
    if max(material["emission"]) > 0:
        strength = max(material["emission"])
        emission = nodes.new("ShaderNodeEmission")
        emission.inputs["Color"].default_value = (*(c / strength for c in material["emission"]), 1)
        emission.inputs["Strength"].default_value = strength
        shader = emission.outputs[0]  # black otherwise
        if not material["double_sided"]:  # Cycles emits from both sides
            m.cycles.emission_sampling = "FRONT"
            front = nodes.new("ShaderNodeMixShader")
            link(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], front.inputs["Fac"])
            link(shader, front.inputs[1])
            shader = front.outputs[0]
        if max(material["color"]) > 0:
            both = nodes.new("ShaderNodeAddShader")
            link(diffuse.outputs[0], both.inputs[0])
            link(shader, both.inputs[1])
            shader = both.outputs[0]
    link(shader, end.inputs["Surface"])
    return m


def add_mesh(s, first=0):
    """The triangles from `first` on."""
    if first == len(s.triangles):
        return
    mesh = bpy.data.meshes.new("scene")
    vertices, triangles = np.unique(s.triangles[first:], return_inverse=True)
    p = s.positions[vertices]
    mesh.from_pydata(np.stack([p[:, 0], -p[:, 2], p[:, 1]], axis=1).tolist(), [], triangles.reshape(-1, 3).tolist())
    for material in s.materials:
        mesh.materials.append(add_material(material))
    mesh.polygons.foreach_set("material_index", s.triangle_materials[first:].astype(np.int32))
    mesh.update()
    bpy.context.collection.objects.link(bpy.data.objects.new("scene", mesh))


def add_camera(s):
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "VERTICAL"
    data.angle_y = np.radians(s.camera["vertical_fov"])
    data.clip_start, data.clip_end = 1e-4, 1e6
    camera = bpy.data.objects.new("camera", data)
    eye, target, up = (blender_axes(s.camera[k]) for k in ("eye", "target", "up"))
    back = (eye - target).normalized()
    right = up.cross(back).normalized()
    camera.matrix_world = Matrix.Translation(eye) @ Matrix((right, back.cross(right), back)).transposed().to_4x4()
    bpy.context.collection.objects.link(camera)
    bpy.context.scene.camera = camera


def add_world(sky):
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    nodes, link = world.node_tree.nodes, world.node_tree.links.new
    background = nodes["Background"]
    background.inputs["Color"].default_value = (0, 0, 0, 1)
    if not sky:
        return
    rgba = np.ones((sky["height"], sky["width"], 4), np.float32)
    rgba[..., :3] = sky["map"][::-1]
    image = bpy.data.images.new("sky", sky["width"], sky["height"], alpha=False, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(rgba.ravel())
    image.pack()
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    turn = nodes.new("ShaderNodeMapping")
    turn.inputs["Rotation"].default_value[2] = np.radians(sky["rotation"])
    link(nodes.new("ShaderNodeTexCoord").outputs["Generated"], turn.inputs["Vector"])
    link(turn.outputs[0], texture.inputs["Vector"])
    link(texture.outputs[0], background.inputs["Color"])


def set_up(s, pattern):
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = s.width, s.height
    scene.render.resolution_percentage = 100
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.render.use_persistent_data = True
    scene.render.use_compositing = scene.render.use_sequencer = False
    scene.render.dither_intensity = 0
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.exr_codec = "NONE"
    c = scene.cycles
    c.device = "CPU"
    c.use_adaptive_sampling = c.use_denoising = c.use_fast_gi = c.use_auto_tile = False
    c.sample_clamp_direct = c.sample_clamp_indirect = c.blur_glossy = 0
    c.caustics_reflective = c.caustics_refractive = True
    c.use_light_tree = True
    c.pixel_filter_type = "BOX"
    c.sampling_pattern = pattern
    for bounces in ("max", "diffuse", "glossy", "transmission", "transparent_max", "volume"):
        setattr(c, bounces + "_bounces", 1024)


def main():
    out = own_standard_output()
    s = Exported(sys.argv[1])
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if s.diffuse or not s.file:
        add_mesh(s)
    else:
        bpy.ops.import_scene.gltf(  # COMPAT: lux and candela as Blender's units, not as watts of 683 lumens
            filepath=s.file, export_import_convert_lighting_mode="COMPAT")
        add_mesh(s, s.own_triangles)
    add_camera(s)
    add_world(s.sky)
    set_up(s, sys.argv[2])
    exr = os.path.join(s.folder, f"cycles_{os.getpid()}.exr")

    def render(spp, seed):
        scene = bpy.context.scene
        scene.cycles.samples, scene.cycles.seed = spp, seed
        _, seconds = timed(bpy.ops.render.render)
        bpy.data.images["Render Result"].save_render(exr)
        image = bpy.data.images.load(exr)
        rgba = np.empty(s.width * s.height * 4, np.float32)
        image.pixels.foreach_get(rgba)
        bpy.data.images.remove(image)
        os.remove(exr)
        return rgba.reshape(s.height, s.width, 4)[::-1, :, :3], seconds

    serve(render, out)


main()
