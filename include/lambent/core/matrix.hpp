#pragma once
#include <lambent/core/vec.hpp>
#include <glm/mat4x4.hpp>

/// GLM's matrices under our name; apart from vec.hpp, since few who need vectors need them.
namespace lambent {
inline namespace LAMBENT_ABI {

template <class T> using Mat4 = glm::mat<4, 4, T>; ///< column-major: m[column][row]
using Mat4d = Mat4<double>; ///< in double precision

} // namespace LAMBENT_ABI
} // namespace lambent
