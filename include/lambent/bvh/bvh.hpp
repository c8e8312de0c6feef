#pragma once
#include <lambent/bvh/builder.hpp>
#include <lambent/bvh/node.hpp>
#include <lambent/bvh/primitive.hpp>
#include <lambent/bvh/triangle.hpp>
#include <lambent/core/bounds.hpp>
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/parallel.hpp>
#include <lambent/core/ray.hpp>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

struct BuildOptions {};

namespace detail {
struct AcceptAll {
    template <class T>
    constexpr bool operator()(std::uint32_t, T, T, T) const { return true; }
};
} // namespace detail

/// A tree over triangles that answers which of them a ray meets. It keeps its own copy of the vertices, so
/// queries need nothing of the caller's. Watertight: see triangle.hpp and node.hpp. Triangles that are not
/// finite or have no area are dropped and counted; a closed mesh stays closed without them.
/// A ray that is not finite, or whose direction is 0, meets nothing.
template <class T>
class BasicBvh {
public:
    using Scalar = T;

    BasicBvh() = default; ///< empty

    /// throws lambent::Error above 2^28 blocks. cost O(n log n), on the calling thread for now: the
    /// executor is there for the day that the build is parallel.
    template <PrimitiveSet Mesh, Executor E>
    static BasicBvh build(const Mesh& mesh, const BuildOptions&, E&) {
        return BasicBvh(mesh);
    }
    template <PrimitiveSet Mesh>
    static BasicBvh build(const Mesh& mesh, const BuildOptions& options = {}) {
        SerialExecutor serial;
        return build(mesh, options, serial);
    }

    bool empty() const { return blocks_.empty(); }
    const Bounds3<T>& bounds() const { return bounds_; }
    std::size_t dropped() const { return dropped_; }
    std::size_t triangle_count() const { return triangles_; }
    std::size_t bytes() const { return nodes_.size() * sizeof(nodes_[0]) + blocks_.size() * sizeof(blocks_[0]); }

    /// The nearest hit; `accept(primitive, u, v, t)` may refuse a hit as if there were no surface.
    template <class Accept = detail::AcceptAll>
    Hit<T> intersect(const Ray<T>& ray, const Accept& accept = {}) const {
        Hit<T> hit;
        hit.t = ray.t_max;
        traverse(ray, hit.t, [&](const TriangleBlock<T>& block, const BlockHit<T>& met, unsigned lane) {
            const int i = int(lane);
            if (!(met.t[i] < hit.t)) return false;
            const T u = met.u[i] / met.determinant[i], v = met.v[i] / met.determinant[i];
            if (!accept(block.primitive[lane], u, v, met.t[i])) return false;
            hit = {met.t[i], u, v, block.primitive[lane], 0};
            return false;
        });
        if (!hit) hit.t = std::numeric_limits<T>::infinity();
        return hit;
    }

    /// Whether there is any hit.
    template <class Accept = detail::AcceptAll>
    bool occluded(const Ray<T>& ray, const Accept& accept = {}) const {
        T t_max = ray.t_max;
        return traverse(ray, t_max, [&](const TriangleBlock<T>& block, const BlockHit<T>& met, unsigned lane) {
            const int i = int(lane);
            return accept(block.primitive[lane], met.u[i] / met.determinant[i], met.v[i] / met.determinant[i],
                          met.t[i]);
        });
    }

private:
    template <class Mesh>
    explicit BasicBvh(const Mesh& mesh) {
        const std::size_t n = mesh.count();
        require(n < ChildRef::max_index, [&] { return "Bvh: " + std::to_string(n) + " triangles are too many"; });
        std::vector<detail::BuildItem<T>> items;
        items.reserve(n);
        for (std::size_t i = 0; i < n; ++i) {
            const std::array<Vec3<T>, 3> p = mesh.vertices(i);
            if (!has_area(p)) {
                ++dropped_;
                continue;
            }
            Bounds3<T> box;
            for (const Vec3<T>& v : p) box.add(v);
            items.push_back({box, box.min / T(2) + box.max / T(2), std::uint32_t(i)});
            bounds_.add(box);
        }
        triangles_ = items.size();
        if (items.empty()) return;
        largest_coordinate_ = glm::max(max_component(Vec3<T>(abs(bounds_.min))), max_component(Vec3<T>(abs(bounds_.max))));
        const std::vector<detail::BinaryNode<T>> binary = detail::BinnedBuilder<T>(items).take();
        collapse(mesh, items, binary);
    }

    static bool has_area(const std::array<Vec3<T>, 3>& p) {
        if (!is_finite(p[0]) || !is_finite(p[1]) || !is_finite(p[2])) return false;
        const Vec3<T> a = p[1] - p[0], b = p[2] - p[0];
        const T scale = glm::max(max_component(Vec3<T>(abs(a))), max_component(Vec3<T>(abs(b))));
        return scale > 0 && is_finite(scale) && !is_black(robust_cross(a / scale, b / scale));
    }

    /// Opens the child of largest area until a node is full.
    template <class Mesh>
    void collapse(const Mesh& mesh, const std::vector<detail::BuildItem<T>>& items,
                  const std::vector<detail::BinaryNode<T>>& binary) {
        constexpr int width = tree_width<T>;
        struct Task {
            std::uint32_t binary, wide;
        };
        nodes_.emplace_back();
        std::vector<Task> tasks{{0, 0}};
        while (!tasks.empty()) {
            const Task task = tasks.back();
            tasks.pop_back();
            std::array<std::uint32_t, width> children{task.binary};
            int count = 1;
            while (count < width) {
                int widest = -1;
                for (int i = 0; i < count; ++i)
                    if (binary[children[std::size_t(i)]].count == 0 &&
                        (widest < 0 || binary[children[std::size_t(i)]].box.half_area() >
                                           binary[children[std::size_t(widest)]].box.half_area()))
                        widest = i;
                if (widest < 0) break;
                const std::uint32_t opened = children[std::size_t(widest)];
                children[std::size_t(widest)] = opened + 1;
                children[std::size_t(count++)] = binary[opened].first;
            }
            for (int i = 0; i < count; ++i) {
                const detail::BinaryNode<T>& child = binary[children[std::size_t(i)]];
                if (child.count > 0) {
                    nodes_[task.wide].set(i, child.box, add_leaf(mesh, items, child.first, child.count));
                } else {
                    const auto index = std::uint32_t(nodes_.size());
                    nodes_.emplace_back();
                    nodes_[task.wide].set(i, child.box, ChildRef::node(index));
                    tasks.push_back({children[std::size_t(i)], index});
                }
            }
        }
    }

    template <class Mesh>
    ChildRef add_leaf(const Mesh& mesh, const std::vector<detail::BuildItem<T>>& items, std::uint32_t first,
                      std::uint32_t count) {
        constexpr std::uint32_t lanes = TriangleBlock<T>::lanes;
        const auto first_block = std::uint32_t(blocks_.size());
        const std::uint32_t blocks = (count + lanes - 1) / lanes;
        for (std::uint32_t b = 0; b < blocks; ++b) {
            TriangleBlock<T> block{};
            for (std::uint32_t lane = 0; lane < lanes; ++lane) {
                const std::uint32_t i = b * lanes + lane;
                const std::uint32_t primitive = items[first + std::min(i, count - 1)].primitive;
                const std::array<Vec3<T>, 3> p = mesh.vertices(primitive);
                block.primitive[lane] = primitive;
                for (std::size_t v = 0; v < 3; ++v)
                    for (int axis = 0; axis < 3; ++axis)
                        block.vertex[v][axis][lane] = p[i < count ? v : 0][axis];
            }
            blocks_.push_back(block);
        }
        return ChildRef::leaf(first_block, blocks);
    }

    /// Visits the leaves that the ray meets, near ones first, and hands each hit before t_max to `on_hit`, which
    /// may lower t_max and ends the traversal by true.
    template <class OnHit>
    bool traverse(const Ray<T>& ray, T& t_max, const OnHit& on_hit) const {
        constexpr int width = tree_width<T>;
        // A level of the tree leaves at most width - 1 siblings behind, and the wide tree is no deeper than
        // the binary one that it was collapsed from.
        constexpr std::size_t stack_size = std::size_t(detail::BinnedBuilder<T>::max_depth) * (width - 1) + 1;
        struct Entry {
            ChildRef ref;
            T t;
        };
        if (nodes_.empty() || !is_finite(ray.origin) || !is_finite(ray.direction) || is_black(ray.direction) ||
            !(ray.t_min < t_max))
            return false;
        using Lanes = Pack<T, width>;
        const BoxRay<T> box_ray(ray, largest_coordinate_);
        const ShearedRay<T> sheared(ray);
        const Lanes t_min = ray.t_min;
        std::array<Entry, stack_size> stack;
        std::size_t top = 0;
        ChildRef current = ChildRef::node(0);
        for (;;) {
            if (!current.is_leaf()) {
                const WideNode<T>& node = nodes_[current.index()];
                Lanes entry;
                unsigned met = box_ray.intersect(node, t_min, Lanes(t_max), entry);
                if (met != 0) {
                    std::array<T, std::size_t(width)> t;
                    entry.store(t.data());
                    const std::size_t base = top;
                    for (; met != 0; met &= met - 1) { // by insertion: the nearest comes to lie on top
                        const auto i = std::size_t(std::countr_zero(met));
                        std::size_t place = top++;
                        for (; place > base && stack[place - 1].t < t[i]; --place) stack[place] = stack[place - 1];
                        stack[place] = {node.child[i], t[i]};
                    }
                }
            } else {
                for (std::uint32_t b = current.index(), end = b + current.blocks(); b < end; ++b) {
                    const BlockHit<T> hit = lambent::intersect(sheared, blocks_[b], Pack<T, 4>(ray.t_min), Pack<T, 4>(t_max));
                    for (unsigned lanes = bits(hit.mask); lanes != 0; lanes &= lanes - 1)
                        if (on_hit(blocks_[b], hit, unsigned(std::countr_zero(lanes)))) return true;
                }
            }
            do {
                if (top == 0) return false;
                --top;
            } while (!(stack[top].t <= t_max));
            current = stack[top].ref;
        }
    }

    std::vector<WideNode<T>> nodes_;
    std::vector<TriangleBlock<T>> blocks_;
    Bounds3<T> bounds_;
    T largest_coordinate_ = 0;
    std::size_t triangles_ = 0, dropped_ = 0;
};

using Bvh = BasicBvh<float>;

} // namespace LAMBENT_ABI
} // namespace lambent
