#pragma once
#include <concepts>
#include <cstdint>
#include <lambent/core/vec.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// The numbers of one sample of one pixel: a pure function of (pixel, sample index, dimension, seed), so any
/// sample can be made again anywhere. `get_1d(d)` and `get_2d(d)` lie in [0, 1), never 1. Every dimension d
/// is drawn as one or as the other, never as both; the points of one 2D dimension are well spread over the
/// samples of a pixel, different dimensions of one sample are independent. A stream that draws four neighbouring dimensions
/// faster at once, from d = 4k + 2 on, says so by `four_at_once`, and has get_2d_of_four(d): see SobolSampler. One that draws
/// faster together with others has Together<N>: see StreamPack.
template <class S>
concept SampleStream = std::copyable<S> && requires(const S& stream, std::uint32_t dimension) {
    typename S::Scalar;
    { stream.get_1d(dimension) } -> std::same_as<typename S::Scalar>;
    { stream.get_2d(dimension) } -> std::same_as<Vec2<typename S::Scalar>>;
};

/// A small value that hands out streams. `at(x, y, index)` is the sample `index` of pixel (x, y).
template <class S>
concept Sampler = std::copyable<S> && requires(const S& sampler, std::uint32_t i) {
    { sampler.at(i, i, i) } -> SampleStream;
};

} // namespace LAMBENT_ABI
} // namespace lambent
