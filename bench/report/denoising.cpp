// Sections on denoising: pictures, errors, filters, the seed document's experiments.
#include "data.hpp"

namespace {

constexpr const char* shown_spp = "4"; ///< samples a pixel of the pictures

std::string pictures(const Data& data, const std::vector<Row>& rows) {
    std::string out;
    const std::vector<Row> few = where(rows, "spp", shown_spp);
    for (const std::string& scene : values(few, "scene")) {
        const auto file = [&](const std::string& what) {
            return data.folder / "pictures" / (scene + "_" + what + ".png");
        };
        const std::filesystem::path before = file(std::string(shown_spp) + "_raw"),
                                    after = file(std::string(shown_spp) + "_best"), truth = file("reference");
        if (!std::filesystem::exists(before) || !std::filesystem::exists(after)) continue;
        const auto error = [&](const char* method) {
            const std::vector<Row> row = where(where(few, "scene", scene), "method", method);
            return row.empty() ? std::string("unknown") : shown(number(row.front(), "rel_mse"));
        };
        out += "<div class='pair'>" +
               slider(before, after,
                      scene + ", " + shown_spp + " samples a pixel: left as rendered (relative MSE " + error("raw") +
                          "), right denoised by best (" + error("best") + ")");
        if (std::filesystem::exists(truth))
            out += "<figure class='compare'><div>" + image(truth, scene + ": converged") + "</div><figcaption>" +
                   escaped(scene) + ", converged</figcaption></figure>";
        out += "</div>\n";
    }
    return out;
}

/// A line for each method: y over samples a pixel.
LinePlot by_samples(const std::string& title, const std::vector<Row>& rows, const char* y, const char* label) {
    LinePlot plot{title, {"samples a pixel"}, {label}};
    const std::vector<std::string> methods = values(rows, "method");
    for (std::size_t m = 0; m < methods.size(); ++m) {
        LinePlot::Series series{methods[m], "", m};
        for (const Row& row : where(rows, "method", methods[m]))
            if (!get(row, y).empty())
                series.points.push_back({number(row, "spp"), number(row, y),
                                         methods[m] + ", " + get(row, "spp") + " spp: " + shown(number(row, y)),
                                         failed(row)});
        if (!series.points.empty()) plot.series.push_back(series);
    }
    return plot;
}

} // namespace

std::string denoise_section(const Data& data, const std::vector<Row>& rows) {
    std::string out =
        "<p>Error of denoised frames against converged images, from which the converged images' own noise "
        "cancels out. Move the slider under a picture to see where rendering ends and denoising starts.</p>\n" +
        pictures(data, rows);
    for (const std::string& scene : values(rows, "scene")) {
        if (scene.rfind("mean of ", 0) != 0) continue;
        const std::vector<Row> means = where(rows, "scene", scene);
        out += figure(data, "bench_denoise",
                      by_samples("Relative MSE, geometric " + scene, means, "rel_mse", "relative MSE").svg(),
                      "Relative MSE over samples a pixel; lower is better. raw is the frame as rendered.");
        out += figure(data, "bench_denoise",
                      by_samples("Error over Open Image Denoise's, geometric " + scene, means, "ratio_to_oidn",
                                 "times OIDN's error")
                          .svg(),
                      "Relative MSE over that of Open Image Denoise (quality high); below 1 is better than it.");
    }
    DotPlot time{"Time of a denoiser for one frame", {"CPU milliseconds of one thread, logarithmic"}};
    for (const Row& row : with(rows, "seconds"))
        if (number(row, "seconds") > 0)
            time.dots.push_back(
                {get(row, "spp") + " spp", get(row, "scene"), get(row, "method"), 1e3 * number(row, "seconds"),
                 get(row, "method") + ", " + get(row, "scene") + ": " + shown(1e3 * number(row, "seconds")) + " ms",
                 failed(row)});
    out += folded("Times", figure(data, "bench_denoise", time.svg(), "CPU milliseconds a frame by scene and method."));
    return out + folded("All rows", table(rows));
}

std::string filter_section(const Data& data, const std::vector<Row>& rows) {
    std::string size,
        out = "<p>The cross-bilateral filter's forms beside the seed document's filter as a first program writes "
              "it (its time for the whole image by the time of taps all over it)";
    out += where(rows, "variant", "opencv_joint").empty()
               ? "; OpenCV was not found when the benchmarks were configured (it takes opencv_ximgproc), and is left "
                 "out.</p>\n"
               : " and OpenCV's joint bilateral filter, which has one guide instead of three.</p>\n";
    if (!rows.empty()) {
        const Row& r = rows.front();
        size = get(r, "width") + " x " + get(r, "height") + " pixels, kernel of " + get(r, "kernel") +
               " taps a side, " + get(r, "threads") + " thread(s)";
    }
    DotPlot plot{"Milliseconds a frame: " + size, {"ms, logarithmic; left is faster"}};
    for (const Row& row : rows) {
        const std::string variant = get(row, "variant");
        plot.dots.push_back({"", variant + ", " + shown(number(row, "ratio_to_naive")) + " x as fast as naive", "time",
                             number(row, "ms"), variant + ": " + shown(number(row, "ms")) + " ms", failed(row)});
    }
    return out +
           figure(data, "bench_filter", plot.svg(), "Time of each form, and by how much the naive program is slower.") +
           folded("All rows", table(rows));
}

std::string experiments_section(const Data& data, const std::vector<Row>& rows) {
    std::string out =
        "<p>What the seed document filtered, filtered again, with the error against a long reference. E1: the "
        "room at 1 to 20 samples a pixel. The program's first lines tell what the other names mean.</p>\n";
    out += figure(
        data, "bench_experiments",
        by_samples("E1: relative MSE of the room", where(rows, "experiment", "E1"), "rel_mse", "relative MSE").svg(),
        "Relative MSE over samples a pixel, raw and filtered.");
    return out + folded("All rows", table(rows));
}
