#pragma once
#include "report_rows.hpp"
#include <cmath>
#include <iterator>
#include <sstream>

/// Where a chart goes: into a page, or into a file of its own, which needs a background and a namespace.
enum class ChartUse { page, file };

/// The rays of bench_bvh.json as an SVG: a line for each class and scene, on it a dot for each contender where its
/// ratio to Embree's single rays is. Empty where there are no ratios. Doubles and compact trees, which are about
/// something else than speed, are left out, and so are runs on several threads.
class BvhChart {
public:
    explicit BvhChart(const std::vector<Row>& rows) {
        for (const Row& row : rows) {
            if (!drawn(row)) continue;
            rows_.push_back(row);
            const double x = std::log2(number(row, "ratio_to_embree"));
            low_ = std::min(low_, x - 0.08);
            high_ = std::max(high_, x + 0.08);
        }
        std::stable_sort(rows_.begin(), rows_.end(), [](const Row& a, const Row& b) { // the means come last
            return get(a, "scene") != "geomean" && get(b, "scene") == "geomean";
        });
        for (const Row& row : rows_) {
            add(scenes_, get(row, "scene"));
            add(contenders_, contender(row));
        }
        for (const Row& row : rows)
            if (has(get(row, "class"))) add(classes_, get(row, "class"));
    }

    std::string svg(ChartUse use) const {
        if (rows_.empty()) return "";
        const double plot_bottom = top + double(classes_.size()) * (double(scenes_.size()) * step + gap) - gap / 2;
        const double height = plot_bottom + 44;
        std::ostringstream out;
        out << "<svg viewBox='0 0 " << width << ' ' << height << "' width='" << width << "' role='img'";
        if (use == ChartUse::file) out << " xmlns='http://www.w3.org/2000/svg' font-family='sans-serif' font-size='12'";
        out << ">\n";
        if (use == ChartUse::file) out << "<rect width='100%' height='100%' fill='#fff'/>\n";
        out << "<g fill='#222'>";
        write_axis(out, plot_bottom);
        write_lines(out);
        out << "</g>\n";
        for (std::size_t c = 0; c < contenders_.size(); ++c) write_contender(out, c);
        out << "</svg>\n";
        return out.str();
    }

private:
    static constexpr double width = 860, left = 180, right = 240, top = 34, step = 16, gap = 18;

    static bool drawn(const Row& row) {
        const std::string variant = get(row, "variant");
        const bool is_base = get(row, "library") == "embree" && variant == "high" && get(row, "batch") != "true";
        return number(row, "ratio_to_embree") > 0 && get(row, "class") != "build" && number(row, "threads") <= 1 &&
               variant != "double" && variant != "compact" && !is_base;
    }
    static std::string contender(const Row& row) {
        const std::string name = get(row, "library") + " " + get(row, "variant");
        return get(row, "batch") == "true" ? name + ", batch" : name;
    }
    static void add(std::vector<std::string>& names, const std::string& name) {
        if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
    bool has(const std::string& ray_class) const {
        return std::any_of(rows_.begin(), rows_.end(), [&](const Row& r) { return get(r, "class") == ray_class; });
    }
    static std::size_t place(const std::vector<std::string>& names, const std::string& name) {
        return std::size_t(std::find(names.begin(), names.end(), name) - names.begin());
    }

    double x_of(double logarithm) const {
        return left + (width - left - right) * (logarithm - low_) / (high_ - low_);
    }
    double y_of(const std::string& ray_class, const std::string& scene) const {
        return top + double(place(classes_, ray_class)) * (double(scenes_.size()) * step + gap) +
               (double(place(scenes_, scene)) + 0.5) * step;
    }

    void write_axis(std::ostream& out, double bottom) const {
        out << "<text x='" << left << "' y='18' font-weight='bold'>Rays a second, in multiples of Embree's single "
            << "rays (HIGH, not robust), one thread</text>\n";
        for (const double tick : {0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0}) {
            const double x = x_of(std::log2(tick));
            if (std::log2(tick) < low_ || std::log2(tick) > high_) continue;
            out << "<line x1='" << x << "' x2='" << x << "' y1='" << top - 6 << "' y2='" << bottom << "' stroke='"
                << (tick == 1.0 ? "#222" : "#ddd") << "'/><text x='" << x << "' y='" << bottom + 16
                << "' text-anchor='middle'>" << tick << "</text>\n";
        }
    }

    void write_lines(std::ostream& out) const {
        for (const std::string& ray_class : classes_) {
            out << "<text x='8' y='" << y_of(ray_class, scenes_.front()) + 4 << "' font-weight='bold'>"
                << escaped(ray_class) << "</text>\n";
            for (const std::string& scene : scenes_) {
                const double y = y_of(ray_class, scene);
                const bool mean = scene == "geomean";
                const std::string label = mean ? "geometric mean" : scene.substr(scene.find_last_of('/') + 1);
                out << "<text x='" << left - 8 << "' y='" << y + 4 << "' text-anchor='end' font-weight='"
                    << (mean ? "bold" : "normal") << "'>" << escaped(label) << "</text><line x1='" << left << "' x2='"
                    << width - right << "' y1='" << y << "' y2='" << y
                    << "' stroke='" << (mean ? "#bbb" : "#eee") << "'/>\n";
            }
        }
    }

    /// Ours are blue and green, others red and brown; batches are rings; means are larger.
    void write_contender(std::ostream& out, std::size_t index) const {
        const char* const ours[] = {"#1b6ca8", "#2a9d8f", "#6a4c93", "#4a8f3c"};
        const char* const theirs[] = {"#c8553d", "#d99a2b", "#7a7a7a", "#b23a6b", "#8a6d3b", "#333"};
        const auto is_ours = [](const std::string& name) { return name.rfind("lambent", 0) == 0; };
        const std::string& name = contenders_[index];
        const auto rank = std::size_t(std::count_if(contenders_.begin(), contenders_.begin() + std::ptrdiff_t(index),
                                                    [&](const std::string& c) { return is_ours(c) == is_ours(name); }));
        const char* const color = is_ours(name) ? ours[rank % std::size(ours)] : theirs[rank % std::size(theirs)];
        const bool batch = name.ends_with(", batch");
        out << "<g fill='" << (batch ? "#fff" : color) << "' stroke='" << color << "' stroke-width='" << (batch ? 2 : 1)
            << "'>";
        for (const Row& row : rows_) {
            if (contender(row) != name) continue;
            const std::string ray_class = get(row, "class"), scene = get(row, "scene");
            out << "<circle cx='" << x_of(std::log2(number(row, "ratio_to_embree"))) << "' cy='"
                << y_of(ray_class, scene) << "' r='" << (scene == "geomean" ? 5.5 : 3.5) << "'><title>" << escaped(name)
                << ", " << escaped(ray_class) << ", " << escaped(scene) << ": " << shown(get(row, "ratio_to_embree"))
                << "</title></circle>";
        }
        const double y = top + 4 + 18 * double(index);
        out << "<circle cx='" << width - right + 18 << "' cy='" << y << "' r='4'/><text fill='" << color
            << "' stroke='none' x='" << width - right + 30 << "' y='" << y + 4 << "'>" << escaped(name) << "</text></g>\n";
    }

    std::vector<Row> rows_;
    std::vector<std::string> classes_, scenes_, contenders_;
    double low_ = std::log2(0.8), high_ = std::log2(1.25);
};

inline std::string bvh_chart(const std::vector<Row>& rows, ChartUse use = ChartUse::page) {
    return BvhChart(rows).svg(use);
}
