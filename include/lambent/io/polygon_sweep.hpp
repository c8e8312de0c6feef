#pragma once
#include <lambent/core/vec.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <set>
#include <span>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {
namespace detail {

/// Twice the signed area of a triangle: positive where it turns counter-clockwise.
inline double turn(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Cuts a simple polygon into triangles by sweeping a vertical line over it from left to right.
///
/// Where the line meets the polygon's inside there are intervals, each above one edge that runs to the right. The part
/// of an interval's polygon that is not cut yet, left of the line, is bounded by a chain of corners from that lower
/// edge to the upper one, and no triangle fits into any bend of it except at its newest corner. The next corner sees
/// that one, and cuts off whatever bends of the chain it sees on the way from there.
/// cost    O(n log n) for n corners, whatever their shape
/// source  Hertel, Mehlhorn, Fast triangulation of simple polygons, FCT 1983
class PolygonSweep {
public:
    using Triangle = std::array<std::uint32_t, 3>;

    PolygonSweep() = default;
    PolygonSweep(const PolygonSweep&) = delete; // status_ refers to its sweep
    PolygonSweep& operator=(const PolygonSweep&) = delete;

    /// Fills `triangles` with the n - 2 of a counter-clockwise polygon.
    /// returns false, with triangles of no use, where it touches or crosses itself so that they do not fill it
    bool operator()(std::span<const Vec2d> corners, std::vector<Triangle>& triangles) {
        triangles.clear();
        triangles_ = &triangles;
        drop_repeated(corners);
        sum_ = size_ = 0;
        status_.clear();
        nodes_.clear();
        interval_of_.assign(points_.size(), status_.end());
        order_.resize(points_.size());
        std::iota(order_.begin(), order_.end(), 0u);
        std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) { return left(a, b); });
        for (const std::uint32_t v : order_)
            if (!pass(v)) return false;
        return triangles.size() == corners.size() - 2 && filled();
    }

private:
    /// A corner in an interval's chain; a corner at which an interval splits is in both chains.
    struct Node {
        std::uint32_t corner, below, above;
    };
    static constexpr std::uint32_t none = 0xffffffffu;

    /// `front` is the chain's end at the lower edge, `back` the one at the upper edge, `newest` the rightmost node.
    struct Interval {
        std::uint32_t from, to; ///< corners of the lower edge, left to right
        mutable std::uint32_t front = none, back = none, newest = none;
    };

    bool left(std::uint32_t a, std::uint32_t b) const {
        const Vec2d &p = points_[a], &q = points_[b];
        return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : a < b;
    }

    /// A corner at the place of the one before it gets a triangle without area and takes no part in the sweep.
    void drop_repeated(std::span<const Vec2d> corners) {
        points_.clear();
        index_.clear();
        const std::size_t n = corners.size();
        for (std::size_t i = 0; i < n; ++i)
            if (corners[i] == corners[(i + n - 1) % n]) {
                triangles_->push_back({std::uint32_t((i + n - 1) % n), std::uint32_t(i), std::uint32_t((i + 1) % n)});
            } else {
                points_.push_back(corners[i]);
                index_.push_back(std::uint32_t(i));
            }
    }

    double turn_of(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
        return turn(points_[a], points_[b], points_[c]);
    }

    /// From below to above; `corner` among them: whose lower edge is below it.
    struct Lower {
        using is_transparent = void;
        const PolygonSweep* sweep;

        bool operator()(const Interval& a, const Interval& b) const {
            if (a.from == b.from) return false;
            if (sweep->left(a.from, b.from)) {
                const double side = sweep->turn_of(a.from, a.to, b.from);
                return side != 0 ? side > 0 : sweep->turn_of(a.from, a.to, b.to) > 0;
            }
            const double side = sweep->turn_of(b.from, b.to, a.from);
            return side != 0 ? side < 0 : sweep->turn_of(b.from, b.to, a.to) < 0;
        }
        bool operator()(const Interval& a, std::uint32_t corner) const {
            return sweep->turn_of(a.from, a.to, corner) > 0;
        }
    };
    using Status = std::set<Interval, Lower>;

    Status::iterator interval_around(std::uint32_t corner) {
        const auto above = status_.lower_bound(corner);
        return above == status_.begin() ? status_.end() : std::prev(above);
    }

    Status::iterator open(std::uint32_t from, std::uint32_t to) {
        const auto [interval, is_new] = status_.insert(Interval{from, to});
        if (!is_new) return status_.end();
        return interval_of_[from] = interval;
    }

    /// Takes the interval over the edge that ends at v, if it is still there, out of those to be looked up.
    Status::iterator closing(std::uint32_t before) {
        const auto interval = interval_of_[before];
        interval_of_[before] = status_.end();
        return interval;
    }

    std::uint32_t add_node(std::uint32_t corner, std::uint32_t below, std::uint32_t above) {
        const std::uint32_t node = std::uint32_t(nodes_.size());
        nodes_.push_back({corner, below, above});
        if (below != none) nodes_[below].above = node;
        if (above != none) nodes_[above].below = node;
        return node;
    }

    void emit(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        const double area = turn_of(a, b, c);
        sum_ += area;
        size_ += std::abs(area);
        triangles_->push_back({index_[a], index_[b], index_[c]});
    }

    /// The node, from `node` on upwards, that v has to be joined to after all that it sees is cut off.
    std::uint32_t cut_upwards(std::uint32_t v, std::uint32_t node) {
        for (std::uint32_t next; (next = nodes_[node].above) != none; node = next) {
            if (!(turn_of(nodes_[node].corner, v, nodes_[next].corner) > 0)) break;
            emit(nodes_[node].corner, v, nodes_[next].corner);
        }
        return node;
    }
    std::uint32_t cut_downwards(std::uint32_t v, std::uint32_t node) {
        for (std::uint32_t next; (next = nodes_[node].below) != none; node = next) {
            if (!(turn_of(nodes_[next].corner, v, nodes_[node].corner) > 0)) break;
            emit(nodes_[next].corner, v, nodes_[node].corner);
        }
        return node;
    }

    /// Moves the line over corner v.
    bool pass(std::uint32_t v) {
        const std::uint32_t n = std::uint32_t(points_.size());
        const std::uint32_t before = (v + n - 1) % n, after = (v + 1) % n;
        const bool from_left = left(before, v), to_right = left(v, after);
        if (!from_left && to_right) return turn_of(before, v, after) > 0 ? start(v, after) : split(v, after);
        if (from_left && !to_right) return turn_of(before, v, after) > 0 ? end(before, v) : merge(before, v);
        return from_left ? lower(before, v, after) : upper(v);
    }

    bool start(std::uint32_t v, std::uint32_t after) {
        const auto interval = open(v, after);
        if (interval == status_.end()) return false;
        interval->front = interval->back = interval->newest = add_node(v, none, none);
        return true;
    }

    bool lower(std::uint32_t before, std::uint32_t v, std::uint32_t after) {
        const auto old = closing(before);
        if (old == status_.end()) return false;
        const std::uint32_t top = cut_upwards(v, old->front);
        const std::uint32_t back = old->back;
        status_.erase(old);
        const auto interval = open(v, after);
        if (interval == status_.end()) return false;
        nodes_[top].below = none;
        interval->front = interval->newest = add_node(v, none, top);
        interval->back = back;
        return true;
    }

    bool upper(std::uint32_t v) {
        const auto interval = interval_around(v);
        if (interval == status_.end()) return false;
        const std::uint32_t bottom = cut_downwards(v, interval->back);
        nodes_[bottom].above = none;
        interval->back = interval->newest = add_node(v, bottom, none);
        return true;
    }

    bool end(std::uint32_t before, std::uint32_t v) {
        const auto interval = closing(before);
        if (interval == status_.end()) return false;
        for (std::uint32_t node = interval->front, next; (next = nodes_[node].above) != none; node = next)
            emit(nodes_[node].corner, v, nodes_[next].corner);
        status_.erase(interval);
        return true;
    }

    bool split(std::uint32_t v, std::uint32_t after) {
        const auto below = interval_around(v);
        if (below == status_.end()) return false;
        const auto above = open(v, after);
        if (above == status_.end()) return false;
        const std::uint32_t newest = below->newest, higher = nodes_[newest].above;
        above->back = higher == none ? none : below->back;
        // The newest corner goes into both chains, each with its own half of the rest.
        nodes_[newest].above = none;
        const std::uint32_t twin = add_node(nodes_[newest].corner, none, higher);
        if (above->back == none) above->back = twin;
        const std::uint32_t bottom = cut_downwards(v, newest), top = cut_upwards(v, twin);
        nodes_[bottom].above = nodes_[top].below = none;
        below->back = below->newest = add_node(v, bottom, none);
        above->front = above->newest = add_node(v, none, top);
        return true;
    }

    bool merge(std::uint32_t before, std::uint32_t v) {
        const auto above = closing(before);
        if (above == status_.end() || above == status_.begin()) return false;
        const auto below = std::prev(above);
        const std::uint32_t bottom = cut_downwards(v, below->back), top = cut_upwards(v, above->front);
        below->newest = add_node(v, bottom, top);
        below->back = above->back;
        status_.erase(above);
        return true;
    }

    /// Triangles that all turn the polygon's way and whose areas add up to its own overlap nowhere.
    bool filled() const {
        double whole = 0;
        for (std::size_t i = 2; i < points_.size(); ++i) whole += turn(points_[0], points_[i - 1], points_[i]);
        return size_ - sum_ <= 1e-9 * whole && std::abs(sum_ - whole) <= 1e-9 * whole;
    }

    std::vector<Vec2d> points_;
    std::vector<std::uint32_t> index_; ///< the polygon's corner, one a point
    std::vector<Triangle>* triangles_ = nullptr;
    double sum_ = 0, size_ = 0; ///< of the triangles' areas, with and without sign
    std::vector<std::uint32_t> order_;
    std::vector<Node> nodes_;
    Status status_{Lower{this}};
    std::vector<Status::iterator> interval_of_; ///< by the left corner of an edge that runs right
};

} // namespace detail
} // namespace LAMBENT_ABI
} // namespace lambent
