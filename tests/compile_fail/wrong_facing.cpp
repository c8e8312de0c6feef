// names: CullBackFaces, CullFrontFaces and OwnEdges are for trees of triangles
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/facing.hpp>

struct Boxes { // leaves of something else
    using Scalar = float;
    struct Block {
        std::uint32_t primitive[4];
    };
    struct Query {
        explicit Query(const lambent::Rayf&) {}
    };
    template <lambent::detail::Query query, class Accept>
    bool meet(const Query&, const Block*, int, const Accept&, lambent::Hit<float>&) const {
        return false;
    }
};

void use() {
    const lambent::BasicBvh<float, Boxes> bvh;
#ifdef RIGHT
    (void)bvh.intersect(lambent::Rayf{});
#else
    (void)bvh.intersect(lambent::Rayf{}, lambent::front_faces_only);
#endif
}
