// names: closest_point: this tree's leaves hold no triangles
#include <lambent/bvh/closest_point.hpp>

struct Boxes { // leaves of something else
    using Scalar = float;
    struct Block {
        std::uint32_t primitive[4];
    };
};

void use() {
#ifdef RIGHT
    (void)closest_point(lambent::Bvh(), lambent::Vec3f(0));
#else
    (void)closest_point(lambent::BasicBvh<float, Boxes>(), lambent::Vec3f(0));
#endif
}
