// names: set\.intersect\(i, ray\)
#include <lambent/bvh/primitive_leaves.hpp>

struct Mine {
    using Scalar = float;
    std::size_t count() const { return 1; }
    lambent::Bounds3<float> bounds(std::size_t) const { return {}; }
#ifdef RIGHT
    lambent::Hit<float> intersect(std::size_t, const lambent::Rayf&) const { return {}; }
#else
    lambent::Hit<float> intersects(std::size_t, const lambent::Rayf&) const { return {}; }
#endif
};

void use() { (void)lambent::PrimitiveBvh<Mine>::build(Mine{}); }
