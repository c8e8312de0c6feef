#pragma once
#include "report.hpp"
#include <lambent/lambent.hpp>
#include <cstdint>
#include <vector>

#define LAMBENT_TEXT_(x) #x
#define LAMBENT_TEXT(x) LAMBENT_TEXT_(x)

/// The same work in both translation units; internal, so that each has its own.
static Report make_report() {
    using namespace lambent;
    Report report{LAMBENT_TEXT(LAMBENT_ABI), native_width<float>, LAMBENT_HAS_FMA != 0, {}, {}};

    float (*const products)(float, float, float, float) = &difference_of_products<float>;
    float (*const sum)(std::span<const float>) = &pairwise_sum<float>;
    report.functions = {reinterpret_cast<const void*>(products), reinterpret_cast<const void*>(sum)};

    std::vector<float> numbers(1000);
    std::uint32_t state = 1;
    for (float& x : numbers) {
        state = state * 747796405u + 2891336453u;
        x = float(state >> 8) * 0x1p-24f - 0.5f;
    }
    report.values.push_back(double(sum(numbers)));
    // Kahan's algorithm and exact products in double round alike where the result is no tie.
    report.values.push_back(double(products(1.0000001f, 3.0f, 1.5f, 2.0f)));

    CompensatedSum<float> compensated;
    for (const float x : numbers) compensated.add(x);
    report.values.push_back(double(compensated.value()));

    const Pack<float, 4> a = Pack<float, 4>::load(numbers.data()), b = Pack<float, 4>::load(&numbers[4]);
    report.values.push_back(double(lambent::sum(lambent::min(a, b) - lambent::max(a, b))));
    report.values.push_back(double(bits(a < b)));

    Bounds3<float> box;
    for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
        box.add(Vec3f(numbers[i], numbers[i + 1], numbers[i + 2]));
    report.values.push_back(double(box.max.x));

    const auto stream = SobolSampler<float>(7).at(3, 5, 11);
    report.values.push_back(double(stream.get_1d(4)));
    report.values.push_back(double(stream.get_2d(9).y));
    return report;
}
