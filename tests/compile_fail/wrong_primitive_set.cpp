// names: TriangleSet
#include <lambent/bvh/primitive.hpp>
#include <array>

struct Mine {
    using Scalar = float;
    std::size_t count() const { return 1; }
#ifdef RIGHT
    std::array<lambent::Vec3f, 3> vertices(std::size_t) const { return {}; }
#else
    lambent::Vec3f vertices(std::size_t) const { return {}; }
#endif
};

void use() { (void)lambent::geometric_normal(Mine{}, 0); }
