// names: deleted.*spheres
#include <lambent/bvh/sphere.hpp>
#include <vector>

std::vector<float> make();

void use(const std::vector<lambent::Vec3f>& centers) {
#ifdef RIGHT
    const std::vector<float> radii = make();
    (void)lambent::spheres(centers, radii).count();
#else
    (void)lambent::spheres(centers, make()).count();
#endif
}
