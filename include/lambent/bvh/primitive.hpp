#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Triangles that a tree can be built over, wherever they live: how many there are, and the three corners of
/// one of them. Corners that neighbours share must come out with the same bits, or there is a crack.
template <class P>
concept TriangleSet = std::floating_point<typename P::Scalar> && requires(const P& set, std::size_t i) {
    { set.count() } -> std::convertible_to<std::size_t>;
    { set.vertices(i) } -> std::convertible_to<std::array<Vec3<typename P::Scalar>, 3>>;
};

template <class P, class T>
concept TrianglesOf = TriangleSet<P> && std::same_as<typename P::Scalar, T>;

namespace detail {
template <class C> struct IsSpan : std::false_type {};
template <class T, std::size_t n> struct IsSpan<std::span<T, n>> : std::true_type {};

/// What may be looked at after the call: an lvalue, or a view that owns nothing.
template <class C>
concept NotTemporary = std::is_lvalue_reference_v<C> || IsSpan<std::remove_cvref_t<C>>::value;

/// A container of the caller's by pointer, a span by value.
template <class C>
class ContainerView {
public:
    explicit ContainerView(const C& container) : container_(&container) {}
    std::size_t size() const { return std::size(*container_); }
    decltype(auto) operator[](std::size_t i) const { return (*container_)[i]; }

private:
    const C* container_;
};
template <class T, std::size_t n>
class ContainerView<std::span<T, n>> : public std::span<T, n> {
public:
    explicit ContainerView(std::span<T, n> view) : std::span<T, n>(view) {}
};

template <class V, class Projection>
using ProjectedScalar = typename std::remove_cvref_t<
    std::invoke_result_t<const Projection&, decltype(std::declval<const V&>()[0])>>::value_type;

struct AsIs {
    template <class V> constexpr const V& operator()(const V& v) const { return v; }
};
} // namespace detail

/// The triangles of an indexed mesh in the caller's own containers, which must outlive it; see triangles().
template <class Vertices, class Faces, class Projection>
class TriangleMesh {
public:
    using Scalar = detail::ProjectedScalar<Vertices, Projection>;

    TriangleMesh(const Vertices& vertices, const Faces& faces, Projection projection)
        : vertices_(vertices), faces_(faces), projection_(std::move(projection)) {
        if constexpr (flat) {
            require(faces_.size() % 3 == 0, [&] {
                return "triangles: " + std::to_string(faces_.size()) + " indices are not a multiple of 3";
            });
        }
        for (std::size_t i = 0; i < count(); ++i)
            for (std::size_t k = 0; k < 3; ++k)
                require(index(i, k) < vertices_.size(), [&] {
                    return "triangles: face " + std::to_string(i) + " refers to vertex " +
                           std::to_string(index(i, k)) + " of " + std::to_string(vertices_.size());
                });
    }

    std::size_t count() const {
        if constexpr (flat) {
            return faces_.size() / 3;
        } else {
            return faces_.size();
        }
    }

    std::array<Vec3<Scalar>, 3> vertices(std::size_t i) const {
        return {projection_(vertices_[index(i, 0)]), projection_(vertices_[index(i, 1)]),
                projection_(vertices_[index(i, 2)])};
    }

private:
    using Face = std::remove_cvref_t<decltype(std::declval<const Faces&>()[0])>;
    static constexpr bool flat = std::integral<Face>;

    std::size_t index(std::size_t i, std::size_t k) const {
        if constexpr (flat) {
            return std::size_t(faces_[3 * i + k]);
        } else {
            const Face& face = faces_[i];
            if constexpr (requires { face.length(); }) { // a GLM vector counts in int
                return std::size_t(face[int(k)]);
            } else {
                return std::size_t(face[k]);
            }
        }
    }

    detail::ContainerView<Vertices> vertices_;
    detail::ContainerView<Faces> faces_;
    Projection projection_;
};

/// Views the caller's triangles without copying them.
/// vertices    any random-access container (operator[], std::size), of any vertex type; a span, or an lvalue
///             that outlives the result: temporaries do not compile
/// faces       the same, of three indices each (UVec3, std::array<std::uint16_t, 3>, ...), or of plain
///             integers, three a face
/// projection  vertex → Vec3 of float or double; left out where the vertices are Vec3 themselves
/// throws      lambent::Error naming the first face with an index out of range
template <class Vertices, class Faces, class Projection = detail::AsIs>
    requires detail::NotTemporary<Vertices&&> && detail::NotTemporary<Faces&&>
auto triangles(Vertices&& vertices, Faces&& faces, Projection projection = {}) {
    return TriangleMesh<std::remove_cvref_t<Vertices>, std::remove_cvref_t<Faces>, Projection>(
        vertices, faces, std::move(projection));
}

/// Containers that die at the end of the statement; give an lvalue or a span.
template <class Vertices, class Faces, class... Projection>
    requires(!detail::NotTemporary<Vertices &&> || !detail::NotTemporary<Faces &&>)
void triangles(Vertices&&, Faces&&, Projection&&...) = delete;

/// Unit normal of a primitive's plane, on the side from which its vertices run counter-clockwise. A triangle
/// without area has no plane: it gets some unit vector at right angles to its longest edge.
template <TriangleSet Mesh>
auto geometric_normal(const Mesh& mesh, std::size_t primitive) {
    using T = typename Mesh::Scalar;
    const std::array<Vec3<T>, 3> p = mesh.vertices(primitive);
    Vec3<T> a = p[1] - p[0], b = p[2] - p[0];
    const T largest = glm::max(max_component(glm::abs(a)), max_component(glm::abs(b)));
    if (!(largest > 0)) return Vec3<T>(0, 0, 1);
    a /= largest; // so that the products below neither overflow nor vanish
    b /= largest;
    const Vec3<T> n = robust_cross(a, b);
    const T length = glm::length(n);
    if (length > 0) return n / length;
    const Vec3<T> edge = glm::dot(a, a) > glm::dot(b, b) ? a : b;
    Vec3<T> across(0);
    across[(largest_axis(edge) + 1) % 3] = 1;
    return glm::normalize(glm::cross(edge, across));
}

} // namespace LAMBENT_ABI
} // namespace lambent
