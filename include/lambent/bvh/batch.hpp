#pragma once
#include <lambent/bvh/interleaved.hpp>
#include <lambent/bvh/packet.hpp>
#include <lambent/bvh/traverse.hpp>
#include <algorithm>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// From how many bytes on a tree is so far from the processor that interleaved rays gain more by waiting together than
/// they lose in steps; below, single rays are the faster ones, which for any hits they are for longer.
/// measured  on one machine, with 512 KiB of cache a core and 32 MiB in common
template <Query query>
inline constexpr std::size_t large_tree = query == Query::any ? std::size_t(16) << 20 : std::size_t(4) << 20;

/// All of a batch: rays that go the same way in packets, the others interleaved or one by one.
template <Query query, class T, class Leaves, class Accept, class RayOf, class Report>
class Batch {
public:
    using Tree = WideTree<T, typename Leaves::Block>;

    Batch(const Tree& tree, const Leaves& leaves, const Accept& accept, const RayOf& ray_of, const Report& report)
        : tree_(tree), leaves_(leaves), accept_(accept), ray_of_(ray_of), report_(report) {}

    void run(std::size_t count) {
        if constexpr (std::same_as<typename Leaves::Block, TriangleBlock<T>>) {
            if (!tree_.nodes.empty()) return run_in_packets(count);
        }
        scattered(count, ray_of_, report_);
    }

private:
    using Bundle = Packet<query, T, Accept>;
    static constexpr std::size_t chunk = Bundle::capacity, most_skipped = 15;
    static constexpr int fewest = 12; // rays that make a packet worthwhile
    static_assert(chunk == 64); // a bit each

    /// Chunks in which nothing goes the same way are followed by more of their like: fewer and fewer are looked at.
    void run_in_packets(std::size_t count) {
        Bundle packet(tree_, accept_);
        std::uint32_t rest[16 * chunk];
        std::size_t rest_count = 0, skip = 0, to_skip = 0;
        for (std::size_t begin = 0; begin < count; begin += chunk) {
            const std::size_t size = std::min(chunk, count - begin);
            std::uint64_t open = size == 64 ? ~0ull : (1ull << size) - 1;
            if (to_skip > 0) {
                --to_skip;
            } else {
                skip = form_packets(packet, begin, size, open) ? 0 : std::min(2 * skip + 1, most_skipped);
                to_skip = skip;
            }
            for (; open != 0; open &= open - 1)
                rest[rest_count++] = std::uint32_t(begin + std::size_t(std::countr_zero(open)));
            if (rest_count + chunk > std::size(rest) || begin + chunk >= count) {
                scattered(
                    rest_count, [&](std::size_t i) -> decltype(auto) { return ray_of_(rest[i]); },
                    [&](std::size_t i, const Hit<T>& hit) { report_(rest[i], hit); });
                rest_count = 0;
            }
        }
    }

    /// Takes what goes in packets out of `open`, a bit a ray; false if nothing does.
    bool form_packets(Bundle& packet, std::size_t begin, std::size_t size, std::uint64_t& open) {
        std::uint64_t by_kind[Bundle::kinds + 1] = {}; // the last for rays that hit nothing
        for (std::size_t i = 0; i < size; ++i) by_kind[Bundle::kind(ray_of_(begin + i))] |= 1ull << i;
        bool any = false;
        for (int kind = 0; kind < Bundle::kinds; ++kind) {
            if (std::popcount(by_kind[kind]) < fewest) continue;
            std::uint32_t members[chunk];
            int count = 0;
            for (std::uint64_t left = by_kind[kind]; left != 0; left &= left - 1)
                members[count++] = std::uint32_t(begin + std::size_t(std::countr_zero(left)));
            if (!Bundle::promising(members, count, kind, ray_of_) || !packet.gather(members, count, kind, ray_of_))
                continue;
            packet.run();
            for (int i = 0; i < count; ++i) report_(members[i], packet.hit(i));
            open &= ~by_kind[kind];
            any = true;
        }
        return any;
    }

    template <class Rays, class Tell>
    void scattered(std::size_t count, const Rays& ray, const Tell& tell) {
        const std::size_t bytes =
            tree_.nodes.size() * sizeof(WideNode<T>) + tree_.blocks.size() * sizeof(typename Leaves::Block);
        using Many = Interleaved<query, T, Leaves, Accept>;
        if (count > Many::lanes && bytes > large_tree<query>) {
            Many(tree_, leaves_, accept_).run(count, ray, tell);
        } else {
            for (std::size_t i = 0; i < count; ++i) tell(i, traverse<query>(tree_, leaves_, ray(i), accept_));
        }
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
