"""Mitsuba 3 as a peer. Settings: VARIANT:SAMPLER, as in llvm_ad_rgb:multijitter. Emitters are picked by power, paths
have no largest depth, pixels are boxes. Diffuse scenes only. libLLVM is found by DRJIT_LIBLLVM_PATH."""
import os
import struct
import sys

import numpy as np
from worker import Exported, own_standard_output, serve, timed

import drjit as dr
import mitsuba as mi


def write_ply(path, positions, triangles):
    used, indices = np.unique(triangles, return_inverse=True)
    faces = np.empty(len(triangles), np.dtype([("n", "u1"), ("i", "<i4", 3)]))
    faces["n"], faces["i"] = 3, indices.reshape(-1, 3)
    with open(path, "wb") as f:
        f.write((f"ply\nformat binary_little_endian 1.0\nelement vertex {len(used)}\nproperty float x\n"
                 f"property float y\nproperty float z\nelement face {len(triangles)}\n"
                 "property list uchar int vertex_indices\nend_header\n").encode())
        f.write(positions[used].astype("<f4").tobytes())
        f.write(faces.tobytes())


def luminance(rgb):
    return float(np.dot(rgb, (0.2126, 0.7152, 0.0722)))


def build(s, sampler):
    camera = s.camera
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": -1},
        "sensor": {
            "type": "perspective", "fov": camera["vertical_fov"], "fov_axis": "y", "near_clip": 1e-3,
            "to_world": mi.ScalarTransform4f().look_at(camera["eye"], camera["target"], camera["up"]),
            "film": {"type": "hdrfilm", "width": s.width, "height": s.height, "pixel_format": "rgb",
                     "component_format": "float32", "rfilter": {"type": "box"}},
            "sampler": {"type": sampler, "sample_count": 16},
        },
    }
    for i, material in enumerate(s.materials):
        own = s.triangles[s.triangle_materials == i]
        if len(own) == 0:
            continue
        ply = os.path.join(s.folder, f"mesh_{os.getpid()}.ply")
        write_ply(ply, s.positions, own)
        shape = {"type": "ply", "filename": ply, "face_normals": True,
                 "bsdf": {"type": "twosided", "bsdf": {
                     "type": "diffuse", "reflectance": {"type": "rgb", "value": material["color"]}}}}
        if max(material["emission"]) > 0:
            shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": material["emission"]},
                                "sampling_weight": luminance(material["emission"]) * s.area(i)}
        scene[f"mesh_{i}"] = mi.load_dict(shape)
        os.remove(ply)
    if s.sky:
        scene["sky"] = {"type": "envmap", "bitmap": mi.Bitmap(s.sky["map"]),
                        "to_world": mi.ScalarTransform4f().rotate([0, 1, 0], 90 - s.sky["rotation"])}
    return mi.load_dict(scene)


def main():
    out = own_standard_output()
    variant, sampler = sys.argv[2].split(":")
    mi.set_variant(variant)
    dr.set_thread_count(1)
    llvm = variant.startswith("llvm")
    if llvm:
        dr.set_flag(dr.JitFlag.KernelHistory, True)
    scene = build(Exported(sys.argv[1]), sampler)

    def render(spp, seed):
        while True:
            image, seconds = timed(lambda: np.array(mi.render(scene, spp=spp, seed=seed)))
            if not llvm or all(kernel.get("cache_hit", True) for kernel in dr.kernel_history()):
                return image, seconds  # else a kernel was compiled: once more

    serve(render, out)


main()
