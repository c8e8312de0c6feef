#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <lambent/core/numerics.hpp>
#include <lambent/core/ray.hpp>
#include <limits>
#include <span>
#include <vector>

/// Oracles for ray queries that share no code with the tree: every triangle is looked at.
namespace lambent_test {

using lambent::Hit;
using lambent::Ray;
using lambent::Vec3;

template <class T> using Corners = std::array<Vec3<T>, 3>;

/// The triangle test that lambent/bvh/triangle.hpp documents, one triangle at a time in scalar arithmetic: the
/// same roundings, so the same t to the bit.
template <class T>
class ScalarTest {
public:
    explicit ScalarTest(const Ray<T>& ray) : ray_(ray) {
        z_ = lambent::largest_axis(ray.direction);
        x_ = (z_ + 1) % 3;
        y_ = (z_ + 2) % 3;
        shear_x_ = ray.direction[x_] / ray.direction[z_];
        shear_y_ = ray.direction[y_] / ray.direction[z_];
        inverse_z_ = T(1) / ray.direction[z_];
    }

    /// Whether it hits with t_min <= t < t_max; fills in t.
    bool operator()(const Corners<T>& p, T t_max, T& t) const {
        T x[3], y[3], z[3];
        for (int i = 0; i < 3; ++i) {
            z[i] = p[std::size_t(i)][z_] - ray_.origin[z_];
            x[i] = sheared(shear_x_, z[i], p[std::size_t(i)][x_] - ray_.origin[x_]);
            y[i] = sheared(shear_y_, z[i], p[std::size_t(i)][y_] - ray_.origin[y_]);
        }
        const T w0 = lambent::difference_of_products(x[2], y[1], y[2], x[1]);
        const T w1 = lambent::difference_of_products(x[0], y[2], y[0], x[2]);
        const T w2 = lambent::difference_of_products(x[1], y[0], y[1], x[0]);
        if (!((w0 >= 0 && w1 >= 0 && w2 >= 0) || (w0 <= 0 && w1 <= 0 && w2 <= 0))) return false;
        const T sum = w0 + w1 + w2;
        if (sum == 0) return false;
        T depth = (w2 / sum) * z[2];
        if constexpr (LAMBENT_HAS_FMA) {
            depth = std::fma(w0 / sum, z[0], std::fma(w1 / sum, z[1], depth));
        } else {
            depth = (w0 / sum) * z[0] + ((w1 / sum) * z[1] + depth);
        }
        t = depth * inverse_z_;
        return t >= ray_.t_min && t < t_max;
    }

private:
    static T sheared(T shear, T z, T x) {
        if constexpr (LAMBENT_HAS_FMA) return std::fma(-shear, z, x);
        else if constexpr (sizeof(T) == 4) return T(double(x) - double(shear) * double(z));
        else return lambent::difference_of_products(x, T(1), shear, z);
    }

    Ray<T> ray_;
    int x_, y_, z_;
    T shear_x_, shear_y_, inverse_z_;
};

template <class T>
bool finite_triangle(const Corners<T>& p) {
    return lambent::is_finite(p[0]) && lambent::is_finite(p[1]) && lambent::is_finite(p[2]);
}

/// Whether a tree keeps it: see Bvh::dropped().
template <class T>
bool in_tree(const Corners<T>& p) {
    return finite_triangle(p) && p[0] != p[1] && p[1] != p[2] && p[2] != p[0];
}

/// The finite ones.
template <class Mesh>
auto corners(const Mesh& mesh) {
    std::vector<decltype(mesh.triangle(0))> result;
    for (std::size_t i = 0; i < mesh.faces.size(); ++i)
        if (finite_triangle(mesh.triangle(i))) result.push_back(mesh.triangle(i));
    return result;
}

/// t of the nearest hit; infinity for none.
template <class T>
T brute_force(std::span<const Corners<T>> triangles, const Ray<T>& ray) {
    const ScalarTest<T> test(ray);
    T nearest = ray.t_max;
    bool any = false;
    for (const Corners<T>& p : triangles) {
        T t;
        if (test(p, nearest, t)) {
            nearest = t;
            any = true;
        }
    }
    return any ? nearest : std::numeric_limits<T>::infinity();
}

/// Möller and Trumbore's test in double: another formula, another precision.
struct DoubleTest {
    double t, u, v;
    double sharpness; ///< |cosine| between ray and plane: below about 1e-3 nothing is certain
    bool plane;       ///< the triangle has area and is not seen edge-on
};

template <class T>
DoubleTest moller_trumbore(const Corners<T>& p, const Ray<T>& ray) {
    using V = Vec3<double>;
    const V a(p[0]), e1 = V(p[1]) - a, e2 = V(p[2]) - a, d(ray.direction), s = V(ray.origin) - a;
    const V h = cross(d, e2);
    const double det = dot(e1, h);
    const V n = cross(e1, e2);
    const double scale = length(n) * length(d);
    DoubleTest r{0, 0, 0, scale > 0 ? std::abs(det) / scale : 0, det != 0 && scale > 0};
    if (!r.plane) return r;
    const V q = cross(s, e1);
    r.u = dot(s, h) / det;
    r.v = dot(d, q) / det;
    r.t = dot(e2, q) / det;
    return r;
}

/// Prunes brute force without being clever: a median-split tree in double whose boxes are a thousandth of the
/// scene larger on every side than they have to be. For scenes too large to loop over; checked against the loop.
template <class T>
class PrunedBruteForce {
public:
    explicit PrunedBruteForce(std::vector<Corners<T>> triangles) : triangles_(std::move(triangles)) {
        std::erase_if(triangles_, [](const Corners<T>& p) { return !finite_triangle(p); });
        Box all = empty();
        for (const auto& p : triangles_) grow(all, p);
        for (int k = 0; k < 3; ++k) margin_ = std::max(margin_, 1e-3 * (all.max[k] - all.min[k]));
        if (!triangles_.empty()) split(0, triangles_.size());
    }

    T nearest(const Ray<T>& ray) const {
        const ScalarTest<T> test(ray);
        T best = ray.t_max;
        bool any = false;
        if (!nodes_.empty()) visit(0, ray, test, best, any);
        return any ? best : std::numeric_limits<T>::infinity();
    }
    std::span<const Corners<T>> triangles() const { return triangles_; }

private:
    struct Box {
        double min[3], max[3];
    };
    struct Node {
        Box box;
        std::size_t begin, end, right; ///< right: 0 in a leaf; the left child is the next node
    };

    static Box empty() {
        constexpr double inf = std::numeric_limits<double>::infinity();
        return {{inf, inf, inf}, {-inf, -inf, -inf}};
    }
    static void grow(Box& box, const Corners<T>& p) {
        for (const Vec3<T>& v : p)
            for (int k = 0; k < 3; ++k) {
                box.min[k] = std::min(box.min[k], double(v[k]));
                box.max[k] = std::max(box.max[k], double(v[k]));
            }
    }

    std::size_t split(std::size_t begin, std::size_t end) {
        const std::size_t index = nodes_.size();
        Box box = empty();
        for (std::size_t i = begin; i < end; ++i) grow(box, triangles_[i]);
        int axis = 0;
        for (int k = 1; k < 3; ++k)
            if (box.max[k] - box.min[k] > box.max[axis] - box.min[axis]) axis = k;
        for (int k = 0; k < 3; ++k) {
            box.min[k] -= margin_;
            box.max[k] += margin_;
        }
        nodes_.push_back({box, begin, end, 0});
        if (end - begin > 8) {
            const std::size_t middle = begin + (end - begin) / 2;
            const auto at = [&](std::size_t i) { return triangles_.begin() + std::ptrdiff_t(i); };
            std::nth_element(at(begin), at(middle), at(end), [axis](const Corners<T>& a, const Corners<T>& b) {
                return a[0][axis] + a[1][axis] + a[2][axis] < b[0][axis] + b[1][axis] + b[2][axis];
            });
            split(begin, middle);
            const std::size_t right = split(middle, end);
            nodes_[index].right = right;
        }
        return index;
    }

    /// Whether the line meets the box before `limit`, in the plainest way: axis by axis, by division.
    static bool meets(const Box& box, const Ray<T>& ray, double limit) {
        double from = -std::numeric_limits<double>::infinity(), to = limit;
        for (int k = 0; k < 3; ++k) {
            const double o = double(ray.origin[k]), d = double(ray.direction[k]);
            if (d == 0) {
                if (o < box.min[k] || o > box.max[k]) return false;
                continue;
            }
            const double a = (box.min[k] - o) / d, b = (box.max[k] - o) / d;
            from = std::max(from, std::min(a, b));
            to = std::min(to, std::max(a, b));
        }
        return from <= to;
    }

    void visit(std::size_t index, const Ray<T>& ray, const ScalarTest<T>& test, T& best, bool& any) const {
        const Node& node = nodes_[index];
        if (!meets(node.box, ray, double(best))) return;
        if (node.right == 0) {
            for (std::size_t i = node.begin; i < node.end; ++i) {
                T t;
                if (test(triangles_[i], best, t)) {
                    best = t;
                    any = true;
                }
            }
            return;
        }
        visit(index + 1, ray, test, best, any);
        visit(node.right, ray, test, best, any);
    }

    std::vector<Corners<T>> triangles_;
    std::vector<Node> nodes_;
    double margin_ = 0;
};

} // namespace lambent_test
