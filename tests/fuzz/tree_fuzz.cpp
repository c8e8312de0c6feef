// libFuzzer target: saved trees, as they are and with the checksum that fits. Must give a tree that answers rays and
// can be saved and refitted, or an Error. Seeds: trees of every kind.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <lambent/bvh/compact.hpp>
#include <lambent/bvh/primitive_leaves.hpp>
#include <lambent/bvh/serialize.hpp>
#include <lambent/bvh/sphere.hpp>
#include <lambent/bvh/statistics.hpp>
#include <span>
#include <support/meshes.hpp>
#include <support/rays.hpp>
#include <vector>

namespace {

using namespace lambent;

void demand(bool holds) {
    if (!holds) std::abort();
}

template <class Tree, class T>
void answer(Tree& tree, const lambent_test::Mesh<T>& mesh) {
    lambent_test::Random random(1);
    const auto ask = [&] {
        for (std::size_t i = 0; i < 8; ++i) {
            const Ray<T> ray = lambent_test::hard_ray(mesh, i, random);
            const Hit<T> hit = tree.intersect(ray);
            demand(!hit || hit.primitive < tree.source_count());
            demand(tree.occluded(ray) == bool(hit));
        }
    };
    ask();
    (void)statistics(tree);
    const std::vector<std::byte> bytes = save(tree);
    demand(!bytes.empty());
}

template <class T>
void check_tree(std::span<const std::byte> bytes) {
    static const lambent_test::Mesh<T> mesh = lambent_test::soup<T>(60, 0.3, 2);
    static const std::vector<T> radii(mesh.vertices.size(), T(0.1));
    const auto set = triangles(mesh.vertices, mesh.faces);
    const auto balls = spheres(mesh.vertices, radii);
    const auto with = [&](auto&& load_tree, const auto& source) {
        try {
            auto tree = load_tree();
            answer(tree, mesh);
            if (tree.source_count() == source.count()) {
                tree.refit(source);
                answer(tree, mesh);
            }
        } catch (const Error&) {
        }
    };
    with([&] { return load<BasicBvh<T>>(bytes); }, set);
    with([&] { return load<CompactBvh<std::remove_const_t<decltype(set)>>>(bytes, set); }, set);
    with([&] { return load<PrimitiveBvh<std::remove_const_t<decltype(balls)>>>(bytes, balls); }, balls);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::span<const std::byte> given(reinterpret_cast<const std::byte*>(data), size);
    check_tree<float>(given);
    check_tree<double>(given);
    using Header = detail::SavedHeader;
    if (size < sizeof(Header)) return 0;
    std::vector<std::byte> bytes(given.begin(), given.end());
    Header header;
    std::memcpy(&header, bytes.data(), sizeof header);
    header.checksum = detail::checksum(header, std::span<const std::byte>(bytes).subspan(sizeof header));
    std::memcpy(bytes.data(), &header, sizeof header);
    check_tree<float>(bytes);
    check_tree<double>(bytes);
    return 0;
}
