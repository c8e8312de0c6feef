#include "support/meshes.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"
#include <cmath>
#include <cstddef>
#include <cstring>
#include <doctest/doctest.h>
#include <lambent/bvh/bvh.hpp>
#include <lambent/bvh/compact.hpp>
#include <lambent/bvh/primitive_leaves.hpp>
#include <lambent/bvh/serialize.hpp>
#include <lambent/bvh/sphere.hpp>
#include <lambent/bvh/statistics.hpp>
#include <limits>
#include <string>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

using Header = lambent::detail::SavedHeader;

template <class Tree, class T>
std::size_t count_different(const Tree& a, const Tree& b, const lambent_test::Mesh<T>& mesh, std::size_t& hits) {
    Random random(5);
    std::size_t different = 0;
    for (std::size_t i = 0; i < 5000; ++i) {
        const Ray<T> ray = hard_ray(mesh, i, random);
        const Hit<T> x = a.intersect(ray), y = b.intersect(ray);
        hits += std::size_t(bool(x));
        different += std::size_t(x.t != y.t || x.u != y.u || x.v != y.v || x.primitive != y.primitive);
        different += std::size_t(a.occluded(ray) != b.occluded(ray));
    }
    return different;
}

/// Bytes whose checksum is right, whatever else they are.
void stamp(std::vector<std::byte>& bytes) {
    Header h;
    if (bytes.size() < sizeof h) return;
    std::memcpy(&h, bytes.data(), sizeof h);
    h.checksum = lambent::detail::checksum(h, std::span<const std::byte>(bytes).subspan(sizeof h));
    std::memcpy(bytes.data(), &h, sizeof h);
}

template <class Change>
std::string refusal(std::vector<std::byte> bytes, const Change& change) {
    Header h;
    std::memcpy(&h, bytes.data(), sizeof h);
    change(h, bytes);
    std::memcpy(bytes.data(), &h, sizeof h);
    stamp(bytes);
    try {
        (void)load<Bvh>(bytes);
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

} // namespace

TEST_CASE_TEMPLATE("Trees come back as they were saved, full, compact and over spheres", T, float, double) {
    std::size_t hits = 0;
    for (const lambent_test::Mesh<T>& mesh : {sphere<T>(30, 20, 0.3, 1), degenerate<T>(500, 4), soup<T>(3, 1, 5)}) {
        const auto set = triangles(mesh.vertices, mesh.faces);
        const auto full = BasicBvh<T>::build(set);
        const std::vector<std::byte> bytes = save(full);
        const auto again = load<BasicBvh<T>>(bytes);
        CHECK(save(again) == bytes);
        CHECK(bytes == save(BasicBvh<T>::build(set)));
        CHECK(count_different(full, again, mesh, hits) == 0);
        CHECK(again.dropped() == full.dropped());
        CHECK(again.triangle_count() == full.triangle_count());
        CHECK(statistics(again).sah_cost == statistics(full).sah_cost);

        using Compact = CompactBvh<decltype(set)>;
        Compact compact = Compact::build(set), compact_again = load<Compact>(save(compact), set);
        CHECK(count_different(compact, compact_again, mesh, hits) == 0);
        lambent_test::Mesh<T> moved = mesh;
        for (Vec3<T>& v : moved.vertices) v *= T(2);
        compact.refit(triangles(moved.vertices, moved.faces));
        compact_again.refit(triangles(moved.vertices, moved.faces));
        CHECK(count_different(compact, compact_again, moved, hits) == 0);

        const std::vector<T> radii(mesh.vertices.size(), T(0.1));
        const auto balls = spheres(mesh.vertices, radii);
        using Spheres = PrimitiveBvh<decltype(balls)>;
        const Spheres tree = Spheres::build(balls);
        CHECK(count_different(tree, load<Spheres>(save(tree), balls), mesh, hits) == 0);
        CHECK_THROWS_AS((void)load<Spheres>(save(compact), balls), Error);
    }
    CHECK(hits > 10000);
    const auto empty = load<BasicBvh<T>>(save(BasicBvh<T>()));
    CHECK(empty.empty());
    CHECK(empty.bounds().empty());
}

TEST_CASE("A tree with duplicates knows them when it comes back") {
    const lambent_test::Mesh<float> mesh = slivers<float>(600, 3);
    const auto set = triangles(mesh.vertices, mesh.faces);
    const auto bvh = Bvh::build(set, {.quality = BuildQuality::best});
    REQUIRE(bvh.tree().duplicates > 0);
    const auto back = load<Bvh>(save(bvh));
    CHECK(back.tree().duplicates == bvh.tree().duplicates);
    CHECK(back.triangle_count() == bvh.triangle_count());
}

TEST_CASE("A tree refitted to triangles some of which cannot be hit is saved as it is") {
    lambent_test::Mesh<float> mesh = soup<float>(300, 0.3, 2);
    const auto set = triangles(mesh.vertices, mesh.faces);
    Bvh bvh = Bvh::build(set);
    const std::vector<Vec3f> sound = mesh.vertices;
    for (std::size_t i = 0; i < mesh.vertices.size(); i += 10) mesh.vertices[i].x = std::numeric_limits<float>::quiet_NaN();
    bvh.refit(set);
    Bvh again = load<Bvh>(save(bvh));
    std::size_t hits = 0;
    CHECK(count_different(bvh, again, mesh, hits) == 0);
    mesh.vertices = sound;
    again.refit(set);
    bvh.refit(set);
    CHECK(count_different(bvh, again, mesh, hits) == 0);
}

TEST_CASE("What is wrong with saved bytes is said") {
    const lambent_test::Mesh<float> mesh = soup<float>(100, 0.3, 2);
    const auto set = triangles(mesh.vertices, mesh.faces);
    const Bvh bvh = Bvh::build(set);
    const std::vector<std::byte> bytes = save(bvh);
    using Bytes = std::vector<std::byte>;
    CHECK(refusal(bytes, [](Header&, Bytes&) {}) == "");
    CHECK(refusal(bytes, [](Header& h, Bytes&) { h.magic[2] = 'x'; }) == "load: these bytes are not a saved tree");
    CHECK(refusal(bytes, [](Header& h, Bytes&) { h.byte_order = 0x04030201u; }) ==
          "load: the tree was saved on a machine of the other byte order");
    CHECK(refusal(bytes, [](Header& h, Bytes&) { h.version = 99; }) ==
          "load: the tree has version 99, and this library reads 1");
    CHECK(refusal(bytes, [](Header& h, Bytes&) { h.kind[0] = '\n'; }) ==
          "load: the tree's leaves hold '?orners', and 'corners' are wanted");
    CHECK(refusal(bytes, [](Header& h, Bytes&) { h.scalar_bytes = 8; }) ==
          "load: the tree's numbers have 8 bytes, and 4 are wanted");
    CHECK(refusal(bytes, [](Header& h, Bytes&) { h.node_width = 12; })
              .find("nodes have 12 children, and this build reads " + std::to_string(node_width<float>) +
                    ": it was saved by a build for other instructions") != std::string::npos);
    CHECK(refusal(bytes, [](Header& h, Bytes&) { h.block_bytes = 16; }).find("blocks of 16 bytes are not") !=
          std::string::npos);
    CHECK(refusal(bytes, [](Header& h, Bytes&) { h.primitives = 101; }) ==
          "load: 101 primitives, but only 100 places in leaves");
    CHECK(refusal(bytes, [](Header& h, Bytes&) { h.dropped = 101; }).find("of 100 primitives") != std::string::npos);
    for (const std::uint64_t absurd : {std::uint64_t(1) << 29, std::uint64_t(1) << 40, ~std::uint64_t(0)}) {
        CHECK(refusal(bytes, [&](Header& h, Bytes&) { h.nodes = absurd; }) != ""); // and no memory is asked for
        CHECK(refusal(bytes, [&](Header& h, Bytes&) { h.blocks = absurd; }) != "");
        CHECK(refusal(bytes, [&](Header& h, Bytes&) { h.count = absurd | std::uint64_t(1) << 30; }) != "");
    }
    CHECK(refusal(bytes, [](Header& h, Bytes&) { h.count = 50, h.primitives = 50; }).find("refers to primitive") !=
          std::string::npos);
    CHECK(refusal(bytes, [](Header& h, Bytes&) { h.bounds[1] = 0; }) == "load: node 0 is larger than the tree's bounds");
    CHECK(refusal(bytes, [](Header&, Bytes& b) { b.push_back({}); }).find("bytes, not") != std::string::npos);

    using Node = lambent::detail::WideNode<float>;
    using lambent::detail::Child;
    const auto with_node = [&](std::size_t i, const auto& change) {
        return refusal(bytes, [&](Header&, Bytes& b) {
            Node node;
            std::byte* const at = b.data() + sizeof(Header) + i * sizeof(Node);
            std::memcpy(&node, at, sizeof node);
            change(node);
            std::memcpy(at, &node, sizeof node);
        });
    };
    REQUIRE(bvh.tree().nodes.size() >= 3);
    int inner = -1, leaf = -1;
    for (int lane = 0; lane < node_width<float>; ++lane) {
        Bounds3<float> box;
        if (!lambent::detail::read_box(bvh.tree().nodes[0], lane, box)) continue;
        ((bvh.tree().nodes[0].child[lane] & Child::leaf_bit) == 0 ? inner : leaf) = lane;
    }
    REQUIRE(inner >= 0);
    CHECK(with_node(0, [&](Node& n) { n.child[inner] = 0; }) == "load: node 0 has a child out of range");
    CHECK(with_node(0, [&](Node& n) { n.child[inner] = 0x40000000u; }) == "load: node 0 has a child out of range");
    CHECK(with_node(0, [&](Node& n) { n.child[inner] = Child::leaf_bit | Child::index_mask; }) ==
          "load: node 0 has a leaf out of range");
    const int other = inner == 0 ? 1 : 0; // two ways to one node: a chain of such would take rays for ever
    CHECK(with_node(0, [&](Node& n) { n.child[other] = n.child[inner]; }) == "load: node 0 has another node's child");
    CHECK(with_node(0, [&](Node& n) { n.plane[2][inner] = std::numeric_limits<float>::quiet_NaN(); }) ==
          "load: node 0 has a box that is none");
    CHECK(with_node(0, [&](Node& n) { std::swap(n.plane[2][inner], n.plane[3][inner]); }) ==
          "load: node 0 has a box that is none");
    CHECK(with_node(0, [&](Node& n) {
              for (int p = 0; p < 6; ++p) n.plane[p][inner] = p % 2 == 0 ? INFINITY : -INFINITY;
              n.child[inner] = Child::leaf_bit;
          }).find("is nobody's child") != std::string::npos);
    CHECK(with_node(1, [&](Node& n) { n.child[0] = n.child[1]; }) != "");

    std::vector<std::byte> damaged = bytes;
    damaged[damaged.size() / 2] ^= std::byte(1);
    CHECK_THROWS_WITH_AS((void)load<Bvh>(damaged), "load: the tree is damaged: wrong checksum", Error);
    std::size_t accepted = 0;
    for (std::size_t n = 0; n < bytes.size(); n += 7) {
        try {
            std::vector<std::byte> part(bytes.begin(), bytes.begin() + std::ptrdiff_t(n)); // sanitizers see its end
            (void)load<Bvh>(part);
            ++accepted;
        } catch (const Error&) {
        }
    }
    CHECK(accepted == 0);

    using Compact = CompactBvh<decltype(set)>;
    const std::vector<UVec3> fewer(mesh.faces.begin(), mesh.faces.end() - 1);
    CHECK_THROWS_WITH_AS((void)load<Compact>(save(Compact::build(set)), triangles(mesh.vertices, fewer)),
                         "load: the tree was built over 100 primitives, not 99", Error);
    CHECK_THROWS_AS((void)load<Compact>(bytes, set), Error);
}

TEST_CASE_TEMPLATE("Fuzz: of bytes changed at random load throws, or makes a tree that answers and can be refitted", T,
                   float, double) {
    const lambent_test::Mesh<T> mesh = soup<T>(60, 0.3, 2);
    const auto set = triangles(mesh.vertices, mesh.faces);
    using Compact = CompactBvh<decltype(set)>;
    const std::vector<std::byte> full_bytes = save(BasicBvh<T>::build(set)), compact_bytes = save(Compact::build(set));
    const Header header = [&] {
        Header h;
        std::memcpy(&h, full_bytes.data(), sizeof h);
        return h;
    }();
    Random random(1);
    std::size_t refused = 0, loaded = 0, hits = 0;
    for (int i = 0; i < 25000; ++i) {
        const bool compact = random.index(2) == 0;
        std::vector<std::byte> bytes = compact ? compact_bytes : full_bytes;
        for (std::size_t n = 1 + random.index(3); n > 0; --n) {
            std::size_t at = random.index(bytes.size());
            if (random.index(4) == 0) at = random.index(sizeof(Header));
            bytes[at] ^= std::byte(1u << random.index(8));
            if (random.index(2) == 0) { // a plausible child
                using Node = lambent::detail::WideNode<T>;
                std::uint32_t child = std::uint32_t(random.index(header.nodes + 1));
                if (random.index(2)) child = std::uint32_t(random.index(header.blocks + 1)) | 0x80000000u;
                if (random.index(4) == 0) child |= 0x40000000u;
                std::memcpy(bytes.data() + sizeof(Header) + random.index(header.nodes) * sizeof(Node) +
                                offsetof(Node, child) + 4 * random.index(std::size_t(node_width<T>)),
                            &child, sizeof child);
            }
        }
        if (random.index(16) != 0) stamp(bytes);
        const auto use = [&](auto bvh) {
            ++loaded;
            for (int k = 0; k < 3; ++k) {
                const Ray<T> ray = hard_ray(mesh, std::size_t(i + k), random);
                hits += std::size_t(bool(bvh.intersect(ray))) + std::size_t(bvh.occluded(ray));
            }
            (void)statistics(bvh);
            if (bvh.source_count() == set.count()) bvh.refit(set);
            hits += std::size_t(bool(bvh.intersect(hard_ray(mesh, 3, random))));
        };
        try {
            if (compact) {
                use(load<Compact>(bytes, set));
            } else {
                use(load<BasicBvh<T>>(bytes));
            }
        } catch (const Error&) {
            ++refused;
        }
    }
    INFO("refused ", refused, ", loaded ", loaded);
    CHECK(refused > 5000);
    CHECK(loaded > 1000);
    CHECK(hits > 1000);
}
