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
/// they lose in steps; below, single rays are the faster ones. Any-hit rays wait for less.
/// measured  on one machine, with 512 KiB of cache a core and 32 MiB in common
template <Query query>
inline constexpr std::size_t large_tree = query == Query::any ? std::size_t(32) << 20 : std::size_t(12) << 20;

/// All of a batch: rays that go the same way in packets, the others interleaved or one by one.
template <Query query, class T, class Leaves, class Accept, class RayOf, class Report>
void traverse_batch(const WideTree<T, typename Leaves::Block>& tree, const Leaves& leaves, const Accept& accept,
                    std::size_t count, const RayOf& ray_of, const Report& report) {
    const std::size_t bytes =
        tree.nodes.size() * sizeof(WideNode<T>) + tree.blocks.size() * sizeof(typename Leaves::Block);
    const auto scattered = [&](std::size_t n, const auto& ray, const auto& tell) {
        if (n > Interleaved<query, T, Leaves, Accept>::lanes && bytes > large_tree<query>) {
            Interleaved<query, T, Leaves, Accept> interleaved(tree, leaves, accept);
            interleaved.run(n, ray, tell);
        } else {
            for (std::size_t i = 0; i < n; ++i) tell(i, traverse<query>(tree, leaves, ray(i), accept));
        }
    };
    if constexpr (!std::same_as<typename Leaves::Block, TriangleBlock<T>>) {
        scattered(count, ray_of, report);
    } else {
        if (tree.nodes.empty()) return scattered(count, ray_of, report);
        using Bundle = Packet<query, T, Accept>;
        constexpr std::size_t chunk = Bundle::capacity;
        constexpr int fewest = 12; // rays that make a packet worthwhile
        Bundle packet(tree, accept);
        std::uint32_t rest[16 * chunk];
        std::size_t rest_count = 0;
        const auto flush = [&] {
            scattered(
                rest_count, [&](std::size_t i) -> decltype(auto) { return ray_of(rest[i]); },
                [&](std::size_t i, const Hit<T>& hit) { report(rest[i], hit); });
            rest_count = 0;
        };
        for (std::size_t begin = 0; begin < count; begin += chunk) {
            const int size = int(std::min(chunk, count - begin));
            std::uint8_t kinds[chunk];
            for (int i = 0; i < size; ++i) kinds[i] = Bundle::kind(ray_of(begin + std::size_t(i)));
            std::uint64_t open = size == 64 ? ~0ull : (1ull << size) - 1;
            while (open != 0) {
                const std::uint8_t kind = kinds[std::countr_zero(open)];
                std::uint32_t members[chunk];
                int member_count = 0;
                for (std::uint64_t left = open; left != 0; left &= left - 1) {
                    const int i = std::countr_zero(left);
                    members[member_count] = std::uint32_t(begin + std::size_t(i));
                    const bool same = kinds[i] == kind;
                    member_count += same ? 1 : 0;
                    open ^= same ? left & (~left + 1) : 0;
                }
                if (kind != Bundle::no_kind && member_count >= fewest &&
                    Bundle::promising(members, member_count, kind, ray_of) &&
                    packet.gather(members, member_count, kind, ray_of)) {
                    packet.run();
                    for (int i = 0; i < member_count; ++i) report(members[i], packet.hit(i));
                } else {
                    for (int i = 0; i < member_count; ++i) rest[rest_count++] = members[i];
                }
            }
            if (rest_count + chunk > std::size(rest)) flush();
        }
        flush();
    }
}

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
