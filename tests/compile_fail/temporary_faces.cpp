// names: deleted.*triangles
#include <lambent/bvh/primitive.hpp>
#include <vector>

std::vector<unsigned> make();

void use(const std::vector<lambent::Vec3d>& vertices) {
#ifdef RIGHT
    const std::vector<unsigned> faces = make();
    (void)lambent::triangles(vertices, faces).count();
#else
    (void)lambent::triangles(vertices, make()).count();
#endif
}
