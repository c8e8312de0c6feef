// names: SampleStream
#include <lambent/sampling/sampler.hpp>

struct Stream {
    using Scalar = float;
    float get_1d(std::uint32_t) const { return 0; }
#ifdef RIGHT
    lambent::Vec2f get_2d(std::uint32_t) const { return {0, 0}; }
#else
    float get_2d(std::uint32_t) const { return 0; }
#endif
};
struct Mine {
    Stream at(std::uint32_t, std::uint32_t, std::uint32_t) const { return {}; }
};

void sample(lambent::Sampler auto) {}

void use() { sample(Mine{}); }
