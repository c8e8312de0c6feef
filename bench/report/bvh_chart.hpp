#pragma once
#include "plot.hpp"

/// The rays of bench_bvh.json: a line for each class and scene, on it a dot for each contender where its ratio to
/// Embree's single rays is; batches are rings, means large. Empty where there are no ratios. Doubles and compact trees,
/// which are about something else than speed, are left out, and so are runs on several threads. Rays that graze an edge
/// are decided by rounding: a cross is for more wrong ones than 1 in 10 000.
inline std::string bvh_chart(const std::vector<Row>& rows) {
    const auto is_drawn = [](const Row& row) {
        const std::string variant = get(row, "variant");
        const bool is_base = get(row, "library") == "embree" && variant == "high" && get(row, "batch") != "true";
        return number(row, "ratio_to_embree") > 0 && get(row, "class") != "build" && number(row, "threads") <= 1 &&
               variant != "double" && variant != "compact" && !is_base;
    };
    DotPlot plot{"Rays a second, one thread, in multiples of Embree's single rays (HIGH, not robust)",
                 {"times Embree's rays a second; right of 1 is faster"},
                 1};
    for (const bool mean : {false, true}) // the means come last
        for (const Row& row : rows) {
            const std::string scene = get(row, "scene"), ray_class = get(row, "class");
            if (!is_drawn(row) || (scene == "geomean") != mean) continue;
            const bool batch = get(row, "batch") == "true";
            const std::string name = get(row, "library") + " " + get(row, "variant") + (batch ? ", batch" : "");
            const std::string title =
                name + ", " + ray_class + ", " + scene + ": " + shown(get(row, "ratio_to_embree"));
            const bool many_wrong = number(row, "wrong") > 1e-4 * number(row, "rays") && number(row, "rays") > 0;
            plot.dots.push_back({ray_class, mean ? "geometric mean" : scene.substr(scene.find_last_of('/') + 1), name,
                                 number(row, "ratio_to_embree"), title, many_wrong, mean, batch});
        }
    return plot.svg();
}

/// The style sheet with each var(--name) as the palette has it: viewers other than browsers know no variables.
inline std::string with_colours(std::string css, const std::string& colours) {
    for (std::size_t at = 0; at < colours.size();) {
        const std::size_t colon = colours.find(':', at), end = colours.find(';', at);
        const std::string variable = "var(" + colours.substr(at, colon - at) + ")";
        for (std::size_t i = css.find(variable); i != std::string::npos; i = css.find(variable, i))
            css.replace(i, variable.size(), colours.substr(colon + 1, end - colon - 1));
        at = end + 1;
    }
    return css;
}

/// A chart as a file of its own, which needs a background, a namespace and its colours.
inline std::string as_file(std::string chart) {
    if (chart.empty()) return "";
    chart.insert(4, " xmlns='http://www.w3.org/2000/svg' font-family='sans-serif' font-size='12'");
    chart.insert(chart.find('\n') + 1, "<style>" + with_colours(plot_style(), palette("light")) +
                                           "</style>\n<rect width='100%' height='100%' fill='#fff'/>\n");
    return chart;
}
