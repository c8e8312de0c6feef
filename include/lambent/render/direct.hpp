#pragma once
#include <lambent/render/path.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Light that was scattered at most once: emission, and direct light by both strategies.
struct DirectIntegrator : PathIntegrator<> {
    DirectIntegrator() : PathIntegrator<>{{.max_depth = 1}} {}
};

} // namespace LAMBENT_ABI
} // namespace lambent
