#pragma once
#include <lambent/core/vec.hpp>
#include <lambent/io/polygon_sweep.hpp>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Cuts polygons into triangles; keeps its buffers from one polygon to the next.
class Triangulator {
public:
    using Triangle = PolygonSweep::Triangle;

    /// Ears are clipped, in corners × reflex corners, from concave polygons of up to `few_corners`: fewer slivers than
    /// the sweep, which takes larger ones.
    static constexpr std::size_t few_corners = 128;

    /// Where the sweep can't, because a polygon crosses itself, ears are clipped up to this size; beyond it is a fan.
    static constexpr std::size_t most_corners = 256;

    /// The n - 2 triangles, with the polygon's orientation, as indices of its n corners: a fan where it is
    /// convex; else they overlap nowhere, unless it crosses itself.
    const std::vector<Triangle>& operator()(std::span<const Vec3d> corners) {
        triangles_.clear();
        if (corners.size() < 3) return triangles_;
        if (corners.size() > 3) project(corners);
        if (corners.size() == 3 || convex()) {
            fan(corners.size());
        } else if (corners.size() <= few_corners || !sweep_(points_, triangles_)) {
            triangles_.clear();
            if (corners.size() <= most_corners) {
                clip_ears();
            } else {
                fan(corners.size());
            }
        }
        return triangles_;
    }

private:
    enum class Corner : std::uint8_t { unknown, ear, no_ear };

    /// To the plane of the axes in which the polygon is largest, counter-clockwise.
    /// source  Newell's normal (Sutherland, Sproull, Schumacker, ACM Computing Surveys 6, 1974)
    void project(std::span<const Vec3d> corners) {
        Vec3d normal(0);
        const Vec3d base = corners[0];
        for (std::size_t i = 2; i < corners.size(); ++i) normal += cross(corners[i - 1] - base, corners[i] - base);
        const int axis = largest_axis(normal), u = (axis + 1) % 3, v = (axis + 2) % 3;
        const double sign = normal[axis] < 0 ? -1 : 1;
        points_.clear();
        for (const Vec3d& c : corners) points_.push_back({sign * (c[u] - base[u]), c[v] - base[v]});
    }

    void fan(std::size_t n) {
        for (std::uint32_t i = 2; i < n; ++i) triangles_.push_back({0, i - 1, i});
    }

    /// No corner turns right, and the outline goes round once: its x direction changes twice at most.
    bool convex() const {
        const std::size_t n = points_.size();
        int turns = 0;
        double last = 0, first = 0;
        for (std::size_t i = 0; i < n; ++i) {
            const Vec2d &a = points_[i], &b = points_[i + 1 < n ? i + 1 : 0],
                        &c = points_[i + 2 < n ? i + 2 : i + 2 - n];
            if (turn(a, b, c) < 0) return false;
            const double dx = b.x - a.x;
            if (dx == 0) continue;
            if (last * dx < 0) ++turns;
            if (first == 0) first = dx;
            last = dx;
        }
        return turns + (last * first < 0 ? 1 : 0) <= 2;
    }

    bool reflex(std::size_t i) const { return !(turn(points_[before_[i]], points_[i], points_[after_[i]]) > 0); }

    /// Convex, and no reflex corner lies in the triangle that it cuts off.
    bool is_ear(std::size_t i) const {
        const Vec2d &a = points_[before_[i]], &b = points_[i], &c = points_[after_[i]];
        if (!(turn(a, b, c) > 0)) return false;
        for (const std::uint32_t r : reflex_) {
            const Vec2d& p = points_[r];
            if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0 && present_[r] && p != a && p != b &&
                p != c)
                return false;
        }
        return true;
    }

    void clip_ears() {
        const std::size_t n = points_.size();
        before_.resize(n);
        after_.resize(n);
        reflex_.clear();
        present_.assign(n, true);
        state_.assign(n, Corner::unknown);
        for (std::uint32_t i = 0; i < n; ++i) {
            before_[i] = i > 0 ? i - 1 : std::uint32_t(n - 1);
            after_[i] = i + 1 < n ? i + 1 : 0;
        }
        for (std::uint32_t i = 0; i < n; ++i)
            if (reflex(i)) reflex_.push_back(i); // those that turn convex later only cost time
        std::uint32_t i = 0;
        std::size_t passed = 0;
        for (std::size_t left = n; left > 3;) {
            if (state_[i] == Corner::unknown) state_[i] = is_ear(i) ? Corner::ear : Corner::no_ear;
            if (state_[i] == Corner::no_ear && ++passed <= left) { // after a whole turn without an ear: any
                i = after_[i];
                continue;
            }
            const std::uint32_t a = before_[i], c = after_[i];
            triangles_.push_back({a, i, c});
            present_[i] = false;
            after_[a] = c;
            before_[c] = a;
            state_[a] = state_[c] = Corner::unknown;
            i = after_[c]; // not c: fans of slivers
            passed = 0;
            --left;
        }
        triangles_.push_back({before_[i], i, after_[i]});
    }

    PolygonSweep sweep_;
    std::vector<Triangle> triangles_;
    std::vector<Vec2d> points_;
    std::vector<std::uint32_t> before_, after_, reflex_;
    std::vector<char> present_;
    std::vector<Corner> state_;
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
