#include "support/random.hpp"
#include <algorithm>
#include <bit>
#include <cstdint>
#include <doctest/doctest.h>
#include <lambent/core/numerics.hpp>
#include <lambent/core/simd_order.hpp>
#include <utility>
#include <vector>

using namespace lambent;

namespace {

template <class P>
struct Shape;
template <class T, int N>
struct Shape<Pack<T, N>> {
    using Scalar = T;
    static constexpr int width = N;
};

} // namespace

TEST_CASE_TEMPLATE("Lanes of every set come out in descending order, with what the table says of them", P,
                   Pack<float, 4>, Pack<float, 8>, Pack<float, 16>, Pack<double, 4>, Pack<double, 8>) {
    using T = typename Shape<P>::Scalar;
    using Bits = typename detail::FloatBits<T>::Type;
    constexpr int n = Shape<P>::width;
    constexpr std::uint64_t seed = 20;
    CAPTURE(seed);
    lambent_test::Random random(seed);
    std::uint32_t table[std::size_t(n)];
    for (std::uint32_t& entry : table) entry = std::uint32_t(random.bits());
    for (unsigned set = 0; set < 1u << n; ++set) {
        T keys[std::size_t(n)];
        for (T& key : keys) key = random.below(4) == 0 ? T(1) : T(random.uniform() * 1e3); // some equal but for their tags
        P lanes, in_set;
        for (int i = 0; i < n; ++i) {
            lanes.set(i, keys[i]);
            in_set.set(i, (set >> i & 1u) != 0 ? T(1) : T(0));
        }
        std::vector<std::pair<Bits, std::uint32_t>> expected; // tagged keys, and the table's entries
        for (int i = 0; i < n; ++i)
            if ((set >> i & 1u) != 0)
                expected.push_back({(std::bit_cast<Bits>(keys[i]) & ~Bits(n - 1)) |
                                        Bits(i), table[i]});
        std::sort(expected.rbegin(), expected.rend());

        T sorted[std::size_t(n)];
        std::uint32_t values[std::size_t(n)];
        store_descending(in_set > P(T(0)), lanes, table, sorted, values);
        bool same = true;
        for (std::size_t i = 0; i < expected.size(); ++i)
            same = same && std::bit_cast<Bits>(sorted[i]) == expected[i].first &&
                   values[i] == expected[i].second;
        CAPTURE(set);
        REQUIRE(same);

        std::uint32_t compressed[std::size_t(n)];
        compress_descending<n>(set, table, compressed);
        for (int lane = n - 1, place = 0; lane >= 0; --lane) {
            if ((set >> lane & 1u) == 0) continue;
            REQUIRE(compressed[place++] == table[lane]);
        }
    }
}
