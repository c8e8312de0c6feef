#include <doctest/doctest.h>
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/sampling/stratified.hpp>
#include <lambent/sampling/stream_pack.hpp>
#include <type_traits>
#include <vector>

using namespace lambent;

TEST_CASE_TEMPLATE("streams side by side draw what each draws alone", S, SobolSampler<float>, StratifiedSampler<float>,
                   IndependentSampler<float>) {
    constexpr int width = 8;
    const auto sampler = [] {
        if constexpr (std::is_same_v<S, StratifiedSampler<float>>) return S(7, 16);
        else return S(7);
    }();
    using Stream = decltype(sampler.at(0, 0, 0));
    for (const int used : {width, 5})
        for (const std::uint32_t spread : {0u, 1u, 100u}) { // one pixel; neighbours, of two tiles; and pixels far apart
            StreamPack<Stream, width> pack;
            std::vector<Stream> streams;
            for (int i = 0; i < used; ++i)
                streams.push_back(sampler.at(5 + spread * std::uint32_t(i), 3, 9 + std::uint32_t(i)));
            for (int i = 0; i < used; ++i) pack.set(i, streams[std::size_t(i)]);
            for (std::uint32_t dimension = 0; dimension < 200; ++dimension) {
                const Pack<float, width> one = pack.get_1d(dimension);
                const Vec2<Pack<float, width>> two = pack.get_2d(dimension);
                for (int i = 0; i < used; ++i) {
                    const Stream& alone = streams[std::size_t(i)];
                    REQUIRE(one[i] == alone.get_1d(dimension));
                    REQUIRE(Vec2f(two.x[i], two.y[i]) == alone.get_2d(dimension));
                }
            }
        }
}
