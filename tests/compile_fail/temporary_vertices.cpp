// names: deleted.*triangles
#include <lambent/bvh/primitive.hpp>
#include <vector>

std::vector<lambent::Vec3f> make();

void use(const std::vector<lambent::UVec3>& faces) {
#ifdef RIGHT
    const std::vector<lambent::Vec3f> vertices = make();
    (void)lambent::triangles(vertices, faces).count();
#else
    (void)lambent::triangles(make(), faces).count();
#endif
}
