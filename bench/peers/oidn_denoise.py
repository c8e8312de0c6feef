"""Open Image Denoise as a peer: quality "high" or "fast" on one thread, with albedo and normal.

The folder argv[1] holds size.txt ("WIDTH HEIGHT") and, before each request, color.f32, albedo.f32 and normal.f32
(float32, rows from the top, three channels). What a request says of samples and seed is of no use here.
"""
import os
import sys

import numpy as np
import pyoidn

import worker


class Denoiser:
    def __init__(self, folder, quality):
        self.folder = folder
        with open(os.path.join(folder, "size.txt"), encoding="utf-8") as f:
            width, height = map(int, f.read().split())
        self.images = {name: np.zeros((height, width, 3), np.float32)
                       for name in ("color", "albedo", "normal", "output")}
        self.device = pyoidn.Device()
        self.device.set_int("numThreads", 1)
        self.device.set_bool("setAffinity", False)
        self.device.commit()
        self.filter = pyoidn.Filter(self.device, pyoidn.OIDN_FILTER_TYPE_RT)
        for name, image in self.images.items():
            self.filter.set_image(name, image, pyoidn.OIDN_FORMAT_FLOAT3)
        self.filter.set_bool("hdr", True)
        self.filter.set_quality(quality)
        self.filter.commit()

    def denoise(self, *_):
        for name in ("color", "albedo", "normal"):
            planes = np.fromfile(os.path.join(self.folder, name + ".f32"), np.float32)
            self.images[name][:] = planes.reshape(self.images[name].shape)
        _, seconds = worker.timed(self.filter.execute)
        error = self.device.get_error()
        if error:
            raise RuntimeError(error)
        return self.images["output"], seconds


if __name__ == "__main__":
    answers = worker.own_standard_output()
    qualities = {"high": pyoidn.OIDN_QUALITY_HIGH, "fast": pyoidn.OIDN_QUALITY_FAST}
    worker.serve(Denoiser(sys.argv[1], qualities[sys.argv[2]]).denoise, answers)
