#pragma once
#include "support/directions.hpp"
#include <lambent/material/standard.hpp>

namespace lambent_test {

/// Share of the energy from wo that is scattered: the mean weight over evenly spread samples.
template <class T>
Vec3d scattered(const lambent::StandardPoint<T>& point, const Vec3d& wo, int n) {
    const lambent::StandardBsdf<T> bsdf(point);
    Vec3d sum(0);
    for (int i = 0; i < n; ++i) {
        const CubePoint c(i);
        const auto s = bsdf.sample(lambent::Vec3<T>(wo), T(c.pick), lambent::Vec2<T>(c.u));
        if (s.pdf > 0) sum += Vec3d(s.weight) * double(s.eta_scale);
    }
    return sum / double(n);
}

} // namespace lambent_test
