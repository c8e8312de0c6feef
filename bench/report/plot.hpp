#pragma once
#include "html.hpp"
#include <array>
#include <cmath>

// Charts as SVG. Colours are the classes of palette(); whatever failed its check is a red cross.

/// What an SVG needs of style sheets: in the page's sheet, and in a file of its own. Series past the eighth are dashed.
inline std::string palette(const char* scheme) {
    static const char* const light[] = {"#1b6ca8", "#c8553d", "#3f7f32", "#8e5ea2",
                                        "#a86d10", "#1f8278", "#6b7280", "#b23a6b"};
    static const char* const dark[] = {"#6cb2eb", "#f08a6f", "#86c96f", "#c39bd3",
                                       "#e3b55a", "#5fd0c0", "#a8b0bb", "#ec7fae"};
    const bool is_dark = std::string(scheme) == "dark";
    std::string css =
        is_dark ? "--text:#e4e4e4;--soft:#9a9a9a;--line:#3a3a3a;--bad:#ff6b6b;--back:#161616;--stripe:#202020;"
                : "--text:#1c1c1c;--soft:#666;--line:#ddd;--bad:#b00020;--back:#fff;--stripe:#f5f5f5;";
    for (std::size_t i = 0; i < 8; ++i) css += "--s" + std::to_string(i) + ":" + (is_dark ? dark : light)[i] + ";";
    return css;
}
inline std::string plot_style() {
    std::string css =
        "svg text{fill:var(--text);stroke:none}svg .soft{fill:var(--soft)}svg .title{font-weight:bold}"
        "svg .grid{stroke:var(--line)}svg .base{stroke:var(--text)}svg polyline{fill:none!important;stroke-width:1.7}"
        "svg .dashed{stroke-dasharray:5 3}"
        "svg .failed{stroke:var(--bad);stroke-width:2.5;fill:none}";
    for (int i = 0; i < 8; ++i) {
        const std::string s = std::to_string(i);
        css += "svg .s" + s + "{stroke:var(--s" + s + ");fill:var(--s" + s + ")}";
    }
    return css + "svg .ring{fill:var(--back);stroke-width:2}";
}

struct Axis {
    std::string label;
    bool logarithmic = true;
};

/// Places values between two ends of a chart.
class Scale {
public:
    Scale(const Axis& axis, double from, double to) : axis_(axis), from_(from), to_(to) {}

    /// Nothing where a logarithm has none.
    void include(double value) {
        if (!std::isfinite(value) || (axis_.logarithmic && !(value > 0))) return;
        const double x = inner(value);
        low_ = std::min(low_, x);
        high_ = std::max(high_, x);
    }
    /// Once all are included.
    void close() {
        if (!(high_ >= low_)) low_ = high_ = axis_.logarithmic ? 0 : 1;
        const double least = axis_.logarithmic ? 0.25 : 1e-9, room = std::max(least, 0.04 * (high_ - low_));
        if (axis_.logarithmic) low_ -= room;
        high_ += room;
    }
    bool shows(double value) const { return std::isfinite(value) && (!axis_.logarithmic || value > 0); }
    double operator()(double value) const { return from_ + (to_ - from_) * (inner(value) - low_) / (high_ - low_); }

    std::vector<double> ticks() const {
        std::vector<double> found;
        const double span = high_ - low_;
        if (!axis_.logarithmic) {
            const double rough = span / 5, power = std::pow(10, std::floor(std::log10(rough)));
            const double step = power * (rough > 5 * power ? 10 : rough > 2 * power ? 5 : rough > power ? 2 : 1);
            for (double t = std::ceil(low_ / step) * step; t <= high_; t += step) found.push_back(t);
            return found;
        }
        const std::vector<double> all = span > 12  ? std::vector<double>{1}
                                        : span > 6 ? std::vector<double>{1, 3}
                                        : span > 3 ? std::vector<double>{1, 2, 5}
                                                   : std::vector<double>{1, 1.25, 1.5, 2, 2.5, 3, 4, 5, 6, 8};
        for (double decade = std::floor(low_ / std::log2(10)); decade <= std::ceil(high_ / std::log2(10)); ++decade)
            for (const double digit : all)
                if (const double t = digit * std::pow(10, decade); std::log2(t) >= low_ && std::log2(t) <= high_)
                    found.push_back(t);
        return found;
    }

private:
    double inner(double value) const { return axis_.logarithmic ? std::log2(value) : value; }

    Axis axis_;
    double from_, to_, low_ = 1e300, high_ = -1e300;
};

namespace svg {

inline std::string series_class(std::size_t index) { return {'s', char('0' + index % 8)}; }

inline std::string start(double width, double height, const std::string& title) {
    std::ostringstream out;
    out << "<svg viewBox='0 0 " << width << ' ' << height << "' width='" << width << "' role='img' aria-label='"
        << escaped(title) << "'>\n<text class='title' x='8' y='16'>" << escaped(title) << "</text>\n";
    return out.str();
}
inline std::string text(double x, double y, const std::string& words, const char* more = "") {
    std::ostringstream out;
    out << "<text x='" << x << "' y='" << y << "' " << more << ">" << escaped(words) << "</text>";
    return out.str();
}
inline std::string line(double x1, double y1, double x2, double y2, const char* style) {
    std::ostringstream out;
    out << "<line class='" << style << "' x1='" << x1 << "' y1='" << y1 << "' x2='" << x2 << "' y2='" << y2 << "'/>";
    return out.str();
}
/// A circle, or a cross where a check failed; `title` is what pointing at it shows.
inline std::string mark(double x, double y, double radius, const std::string& style, const std::string& title,
                        bool bad) {
    std::ostringstream out;
    if (bad)
        out << "<path class='failed' d='M" << x - 5 << ' ' << y - 5
            << "l10 10m0 -10l-10 10'><title>FAILED: " << escaped(title) << "</title></path>";
    else
        out << "<circle class='" << style << "' cx='" << x << "' cy='" << y << "' r='" << radius << "'><title>"
            << escaped(title) << "</title></circle>";
    return out.str();
}
/// Lines and numbers of an axis below.
inline std::string ticks_below(const Scale& x, double top, double bottom, double base) {
    std::string out;
    double last = -1e9;
    for (const double t : x.ticks()) {
        out += line(x(t), top, x(t), bottom, t == base ? "base" : "grid");
        if (x(t) - last < 30) continue;
        last = x(t);
        out += text(x(t), bottom + 16, shown(t), "text-anchor='middle'");
    }
    return out + "\n";
}

} // namespace svg

/// Lines through points.
struct LinePlot {
    struct Point {
        double x, y;
        std::string title;
        bool failed = false;
    };
    struct Series {
        std::string name, note; ///< the note stands behind the name
        std::size_t color;
        std::vector<Point> points{};
    };
    std::string title;
    Axis x, y;
    std::vector<Series> series{};

    std::string svg() const {
        constexpr double width = 760, left = 66, right = 250, top = 30, bottom = 46;
        const double height = std::max(380.0, top + bottom + 18 * double(series.size() + 1));
        Scale across(x, left, width - right), up(y, height - bottom, top);
        std::size_t drawn = 0;
        for (const Series& s : series)
            for (const Point& p : s.points) across.include(p.x), up.include(p.y), ++drawn;
        if (drawn == 0) return "";
        across.close();
        up.close();
        std::ostringstream out;
        out << svg::start(width, height, title) << svg::ticks_below(across, top, height - bottom, 0);
        for (const double t : up.ticks())
            out << svg::line(left, up(t), width - right, up(t), "grid")
                << svg::text(left - 6, up(t) + 4, shown(t), "text-anchor='end'");
        out << svg::text((left + width - right) / 2, height - 8, x.label, "class='soft' text-anchor='middle'")
            << "<text class='soft' text-anchor='middle' transform='translate(14 " << height / 2 << ") rotate(-90)'>"
            << escaped(y.label) << "</text>\n";
        for (std::size_t i = 0; i < series.size(); ++i) {
            const Series& s = series[i];
            const std::string style = svg::series_class(s.color);
            const char* const dash = s.color >= 8 ? "dashed" : "";
            std::ostringstream line, marks;
            for (const Point& p : s.points) {
                if (!across.shows(p.x) || !up.shows(p.y)) continue;
                line << across(p.x) << ',' << up(p.y) << ' ';
                marks << svg::mark(across(p.x), up(p.y), 3, style, p.title, p.failed);
            }
            const double y_of = top + 10 + 18 * double(i);
            out << "<polyline class='" << style << ' ' << dash << "' points='" << line.str() << "'/>" << marks.str()
                << svg::line(width - right + 12, y_of, width - right + 32, y_of, (style + " " + dash).c_str())
                << svg::text(width - right + 38, y_of + 4, s.name + (s.note.empty() ? "" : "  " + s.note)) << "\n";
        }
        out << "</svg>\n";
        return out.str();
    }
};

/// A line for each row of each group, on it a dot for each series.
struct DotPlot {
    struct Dot {
        std::string group, row, series;
        double x;
        std::string title;
        bool failed = false, large = false, ring = false;
    };
    std::string title;
    Axis x;
    double base = 0; ///< a value whose line is dark, such as 1 for ratios
    std::vector<Dot> dots{};
    std::size_t first_color = 0;

    std::string svg() const {
        if (dots.empty()) return "";
        constexpr double width = 960, left = 310, right = 230, top = 34, step = 17, gap = 12;
        std::vector<std::array<std::string, 2>> rows;
        std::vector<std::string> groups, names;
        const auto add = [](auto& list, const auto& value) {
            if (std::find(list.begin(), list.end(), value) == list.end()) list.push_back(value);
        };
        Scale across(x, left, width - right);
        if (base > 0 || !x.logarithmic) across.include(base);
        for (const Dot& d : dots) {
            add(groups, d.group);
            add(names, d.series);
            across.include(d.x);
        }
        across.close();
        for (const std::string& group : groups)
            for (const Dot& d : dots)
                if (d.group == group) add(rows, std::array{group, d.row});
        const auto y_of = [&](const Dot& d) {
            const auto row = std::find(rows.begin(), rows.end(), std::array{d.group, d.row}) - rows.begin();
            const auto group = std::find(groups.begin(), groups.end(), d.group) - groups.begin();
            return top + (double(row) + 0.5) * step + double(group) * gap;
        };
        const double bottom = top + double(rows.size()) * step + double(groups.size() - 1) * gap;
        const double height = std::max(bottom + 44, top + 18 * double(names.size()) + 10);
        std::ostringstream out;
        out << svg::start(width, height, title) << svg::ticks_below(across, top - 4, bottom, base);
        out << svg::text((left + width - right) / 2, bottom + 34, x.label, "class='soft' text-anchor='middle'") << "\n";
        std::vector<std::string> named;
        std::vector<std::array<std::string, 2>> labelled;
        for (const Dot& d : dots) {
            const double y = y_of(d);
            if (std::find(labelled.begin(), labelled.end(), std::array{d.group, d.row}) == labelled.end()) {
                labelled.push_back({d.group, d.row});
                out << svg::line(left, y, width - right, y, "grid")
                    << svg::text(left - 8, y + 4, d.row,
                                 d.large ? "text-anchor='end' class='title'" : "text-anchor='end'");
                if (std::find(named.begin(), named.end(), d.group) == named.end()) {
                    named.push_back(d.group);
                    out << svg::text(8, y + 4, d.group, "class='title'");
                }
                out << "\n";
            }
        }
        for (const std::string& name : names) {
            const auto index = std::size_t(std::find(names.begin(), names.end(), name) - names.begin());
            const std::string color = svg::series_class(index + first_color);
            const bool ring =
                std::any_of(dots.begin(), dots.end(), [&](const Dot& d) { return d.series == name && d.ring; });
            const std::string style = color + (ring ? " ring" : "");
            for (const Dot& d : dots)
                if (d.series == name && across.shows(d.x))
                    out << svg::mark(across(d.x), y_of(d), d.large ? 5.5 : 4, style, d.title, d.failed);
            if (names.size() > 1) {
                const double y = top + 4 + 18 * double(index);
                out << svg::mark(width - right + 18, y, 4, style, name, false)
                    << svg::text(width - right + 30, y + 4, name);
            }
            out << "\n";
        }
        out << "</svg>\n";
        return out.str();
    }
};

/// Bars of parts that add up, from zero.
struct StackPlot {
    struct Bar {
        std::string name, note;
        std::vector<double> parts;
        bool failed = false;
    };
    std::string title, label;
    std::vector<std::string> parts;
    std::vector<Bar> bars{};

    std::string svg() const {
        if (bars.empty()) return "";
        constexpr double width = 900, left = 190, right = 190, top = 50, step = 26;
        const double bottom = top + step * double(bars.size());
        Scale across({label, false}, left, width - right);
        across.include(0);
        for (const Bar& b : bars) {
            double sum = 0;
            for (const double p : b.parts) sum += p;
            across.include(sum);
        }
        across.close();
        std::ostringstream out;
        out << svg::start(width, bottom + 44, title) << svg::ticks_below(across, top - 4, bottom, 0)
            << svg::text((left + width - right) / 2, bottom + 34, label, "class='soft' text-anchor='middle'");
        double x = left;
        for (std::size_t i = 0; i < parts.size(); ++i, x += 110)
            out << "<rect class='" << svg::series_class(i) << "' x='" << x << "' y='26' width='11' height='11'/>"
                << svg::text(x + 16, 36, parts[i]);
        for (std::size_t b = 0; b < bars.size(); ++b) {
            const double y = top + step * double(b);
            double from = 0;
            out << "\n" << svg::text(left - 8, y + 16, bars[b].name, "text-anchor='end'");
            for (std::size_t i = 0; i < bars[b].parts.size(); ++i) {
                const double to = from + bars[b].parts[i];
                out << "<rect class='" << svg::series_class(i) << "' x='" << across(from) << "' y='" << y + 4
                    << "' width='" << std::max(0.0, across(to) - across(from)) << "' height='" << step - 8
                    << "'><title>" << escaped(bars[b].name + ", " + parts[i] + ": " + shown(bars[b].parts[i]))
                    << "</title></rect>";
                from = to;
            }
            out << svg::text(across(from) + 8, y + 16, (bars[b].failed ? "FAILED  " : "") + bars[b].note);
        }
        out << "</svg>\n";
        return out.str();
    }
};
