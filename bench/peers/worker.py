"""What bench_error_time and a peer say to each other: see peer.hpp.

The folder argv[1] holds scene.json and arrays of it; argv[2] is the peer's setting. Each line "SPP SEED FILE" on
standard input is answered by the image in FILE (float32, rows from the top, R G B) and a line of JSON.
"""
import json
import os
import resource
import sys
import time

import numpy as np


class Exported:
    """A scene of bench_error_time: triangles by material, camera, sky."""

    def __init__(self, folder):
        with open(os.path.join(folder, "scene.json"), encoding="utf-8") as f:
            self.__dict__.update(json.load(f))
        self.folder = folder
        self.positions = self.array("positions.f32", np.float32).reshape(-1, 3)
        self.triangles = self.array("triangles.u32", np.uint32).reshape(-1, 3)
        self.triangle_materials = self.array("triangle_materials.u32", np.uint32)
        if self.sky:
            self.sky["map"] = self.array("sky.f32", np.float32).reshape(self.sky["height"], self.sky["width"], 3)

    def array(self, name, kind):
        return np.fromfile(os.path.join(self.folder, name), kind)

    def area(self, material):
        p = self.positions[self.triangles[self.triangle_materials == material]].astype(np.float64)
        return np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum() / 2


def peak_mib():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def serve(render, out):
    """render(spp, seed) -> (image, CPU seconds); `out` is where answers go."""
    def answer(seconds):
        print(json.dumps({"seconds": seconds, "peak_mib": peak_mib()}), file=out, flush=True)

    render(1, 0)
    answer(0.0)
    for line in sys.stdin:
        spp, seed, path = line.rstrip("\n").split(" ", 2)
        image, seconds = render(int(spp), int(seed))
        np.ascontiguousarray(image, np.float32).tofile(path)
        answer(seconds)


def timed(work):
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def own_standard_output():
    """Standard output for answers alone: whatever the peer prints goes to standard error."""
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    return out
