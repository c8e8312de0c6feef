// A user's program: a mesh of its own, an image of its own, and the file formats of the components it asked for.
#include <lambent/lambent.hpp>
#if defined(CONSUMER_WITH_EXR)
#include <lambent/io/exr.hpp>
#endif
#if defined(CONSUMER_WITH_IMAGE)
#include <lambent/io/image.hpp>
#endif
#if defined(CONSUMER_WITH_GLTF) && defined(CONSUMER_WITH_EXR)
#include <lambent/io/gltf.hpp>
#endif
#include <vector>

int main() {
    const std::vector<lambent::Vec3f> vertices{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<unsigned> faces{0, 1, 2};
    const auto mesh = lambent::triangles(vertices, faces);
    if (mesh.count() != 1 || lambent::geometric_normal(mesh, 0).z != 1) return 1;

    std::vector<float> pixels(12, 0.5f);
    const lambent::PixelView<const float, 3> image(pixels.data(), 2, 2);
    return image.load(1, 1).y == 0.5f ? 0 : 1;
}
