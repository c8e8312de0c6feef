#pragma once
#include <lambent/bvh/interleaved.hpp>
#include <lambent/bvh/occlusion_group.hpp>
#include <lambent/bvh/packet.hpp>
#include <lambent/bvh/traverse.hpp>
#include <algorithm>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// From how many bytes on a tree is far enough from the processor for interleaved rays to gain anything.
inline constexpr std::size_t large_tree = std::size_t(4) << 20;

/// From how many nodes and leaves a ray on they do: on a shorter way single rays are the faster ones, which for any hits
/// they are for longer.
/// measured  with 2 MiB of cache a core, speed in multiples of single rays': closest .75 to .9 at 6 steps, 1.1 to 1.3 at 9,
///           1.2 to 1.5 at 15 to 25; any .7 at 4, .8 at 5 to 6, .85 to 1 at 9 to 12, 1.2 to 1.5 at 16 to 27
template <Query query>
inline constexpr std::size_t long_way = query == Query::any ? 11 : 7;

/// All of a batch: rays that go the same way together, the others interleaved or one by one.
template <Query query, class T, class Leaves, class Accept, class RayOf, class Report>
class Batch {
public:
    using Tree = WideTree<T, typename Leaves::Block>;

    Batch(const Tree& tree, const Leaves& leaves, const Accept& accept, const RayOf& ray_of, const Report& report)
        : tree_(tree), leaves_(leaves), accept_(accept), ray_of_(ray_of), report_(report) {}

    void run(std::size_t count) {
        if constexpr (std::same_as<Leaves, StoredTriangles<T>>) {
            if (!tree_.nodes.empty()) {
                if constexpr (query == Query::closest) return run_in_packets(count);
                if constexpr (OcclusionGroup<T, Accept>::pays) return run_in_groups(count);
            }
        }
        scattered(count, [](std::size_t i) { return i; });
    }

private:
    using Kind = RayKind<T>;
    static constexpr std::size_t most_skipped = 15;

    /// Rays that go by themselves, of one part of the batch after the other.
    struct Rest {
        std::uint32_t rays[4096];
        std::size_t count = 0;

        void add(std::size_t ray) { rays[count++] = std::uint32_t(ray); }
        /// For the next `coming` rays.
        bool has_room(std::size_t coming) const { return count + coming <= std::size(rays); }
    };

    void trace(Rest& rest) {
        scattered(rest.count, [&](std::size_t i) { return std::size_t(rest.rays[i]); });
        rest.count = 0;
    }

    /// part(begin, end, rest) traces the rays of a part of the batch together and leaves the others to `rest`; false if
    /// that did not pay. Such parts are followed by more of their like: fewer and fewer are then tried.
    template <class Part>
    void in_parts(std::size_t count, std::size_t size, const Part& part) {
        Rest rest;
        std::size_t skip = 0, to_skip = 0;
        for (std::size_t begin = 0; begin < count; begin += size) {
            const std::size_t end = std::min(count, begin + size);
            if (!rest.has_room(size)) trace(rest);
            if (to_skip > 0) {
                --to_skip;
                for (std::size_t i = begin; i < end; ++i) rest.add(i);
            } else {
                skip = part(begin, end, rest) ? 0 : std::min(2 * skip + 1, most_skipped);
                to_skip = skip;
            }
        }
        trace(rest);
    }

    void run_in_packets(std::size_t count) {
        using Bundle = Packet<T, Accept>;
        constexpr int fewest = 12; // rays that make a packet worthwhile
        static_assert(Bundle::capacity == 64); // a bit each
        Bundle packet(tree_, accept_);
        in_parts(count, Bundle::capacity, [&](std::size_t begin, std::size_t end, Rest& rest) {
            std::uint64_t by_kind[Kind::count + 1] = {};
            for (std::size_t i = begin; i < end; ++i) by_kind[Kind::of(ray_of_(i))] |= 1ull << (i - begin);
            bool any = false;
            for (int kind = 0; kind <= Kind::count; ++kind) {
                if (by_kind[kind] == 0) continue;
                std::uint32_t members[Bundle::capacity];
                int size = 0;
                for (std::uint64_t left = by_kind[kind]; left != 0; left &= left - 1)
                    members[size++] = std::uint32_t(begin + std::size_t(std::countr_zero(left)));
                if (kind < Kind::count && size >= fewest && Bundle::promising(members, size, kind, ray_of_) &&
                    packet.run(members, size, kind, ray_of_)) {
                    for (int i = 0; i < size; ++i) report_(members[i], packet.hit(i));
                    any = true;
                } else {
                    for (int i = 0; i < size; ++i) rest.add(members[i]);
                }
            }
            return any;
        });
    }

    void run_in_groups(std::size_t count) {
        using Group = OcclusionGroup<T, Accept>;
        constexpr std::size_t part = 512; // rays enough to fill groups, few enough to start near each other
        constexpr int fewest = 4;         // rays that make a group worthwhile
        constexpr unsigned lonely = 2;    // subtrees a ray, in which it went by itself: too many
        Group group(tree_, leaves_, accept_);
        in_parts(count, part, [&](std::size_t begin, std::size_t end, Rest& rest) {
            std::uint32_t waiting[Kind::count][Group::lanes];
            int waits[Kind::count] = {};
            const auto go = [&](int kind) {
                const std::uint32_t* const members = waiting[kind];
                const int size = std::exchange(waits[kind], 0);
                if (size < fewest) {
                    for (int i = 0; i < size; ++i) rest.add(members[i]);
                    return;
                }
                const unsigned occluded = group.run(members, size, kind, ray_of_);
                for (int i = 0; i < size; ++i) {
                    Hit<T> hit;
                    if ((occluded >> i & 1u) != 0) hit.primitive = 0; // some
                    report_(members[i], hit);
                }
            };
            for (std::size_t i = begin; i < end; ++i) {
                const int kind = Kind::of(ray_of_(i));
                if (kind == Kind::count) {
                    rest.add(i);
                    continue;
                }
                waiting[kind][waits[kind]++] = std::uint32_t(i);
                if (waits[kind] == Group::lanes) go(kind);
            }
            for (int kind = 0; kind < Kind::count; ++kind) go(kind);
            return group.take_alone() <= lonely * unsigned(end - begin);
        });
    }

    /// index_of(i) for i < count: rays of the batch. The first ones of some thousand tell how far the others go.
    template <class IndexOf>
    void scattered(std::size_t count, const IndexOf& index_of) {
        constexpr std::size_t part = 4096, first = 128, fewest = Interleaved<query, T, Leaves, Accept>::lanes;
        for (std::size_t begin = 0; begin < count; begin += part) {
            const std::size_t end = std::min(count, begin + part), probed = std::min(end, begin + first);
            if (tree_.bytes() <= large_tree || end - begin <= fewest) {
                one_by_one(begin, end, index_of);
            } else if (interleaved(begin, probed, index_of) < long_way<query> * (probed - begin)) {
                one_by_one(probed, end, index_of);
            } else {
                interleaved(probed, end, index_of);
            }
        }
    }

    template <class IndexOf>
    void one_by_one(std::size_t begin, std::size_t end, const IndexOf& index_of) {
        for (std::size_t i = begin; i < end; ++i) {
            const std::size_t index = index_of(i);
            report_(index, traverse<query>(tree_, leaves_, ray_of_(index), filter_of(accept_, index)));
        }
    }

    /// Returns the nodes and leaves that the rays looked into.
    template <class IndexOf>
    [[gnu::noinline]] std::size_t interleaved(std::size_t begin, std::size_t end, const IndexOf& index_of) {
        return Interleaved<query, T, Leaves, Accept>(tree_, leaves_, accept_)
            .run(end - begin, [&](std::size_t i) { return index_of(begin + i); }, ray_of_, report_);
    }

    const Tree& tree_;
    const Leaves& leaves_;
    const Accept& accept_;
    const RayOf& ray_of_;
    const Report& report_;
};

/// ray_of(i) -> Ray<T> for i < count; report(i, hit), once for each, in no order
template <Query query, class T, class Leaves, class Accept, class RayOf, class Report>
void traverse_batch(const WideTree<T, typename Leaves::Block>& tree, const Leaves& leaves, const Accept& accept,
                    std::size_t count, const RayOf& ray_of, const Report& report) {
    Batch<query, T, Leaves, Accept, RayOf, Report>(tree, leaves, accept, ray_of, report).run(count);
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
