// Sections on rendering: error against time, frames, memory, skipping.
#include "data.hpp"

namespace {

/// Of log y over log x, by least squares; NaN with less than two different x.
double slope(const std::vector<LinePlot::Point>& points) {
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (const LinePlot::Point& p : points) {
        if (!(p.x > 0 && p.y > 0)) continue;
        const double u = std::log(p.x), v = std::log(p.y);
        n += 1, x += u, y += v, xx += u * u, xy += u * v;
    }
    const double spread = n * xx - x * x;
    return spread > 1e-9 ? (n * xy - x * y) / spread : std::nan("");
}

std::string numbers(const Row& row, const std::vector<std::string>& keys) {
    std::string out;
    for (const std::string& key : keys)
        if (!get(row, key).empty()) out += (out.empty() ? "" : ", ") + key + " " + shown(number(row, key));
    return out;
}

} // namespace

std::string error_time_section(const Data& data, const std::vector<Row>& rows) {
    const std::vector<Row> curves = with(with(rows, "spp"), "rel_mse");
    const std::vector<std::string> methods = values(curves, "method");
    std::string out =
        "<p>Relative mean squared error against a converged image, over CPU seconds of all threads together, "
        "both logarithmic; a dot for each number of samples a pixel. Pixels that see an emitter are left out. "
        "Lower and further left is better. A slope of -1 is what independent samples have: twice the time, "
        "half the error; a denoiser's is flatter, as it starts from less. Efficiency is 1 / (error x "
        "seconds). Other renderers mean other things by materials that are not diffuse: in such scenes each is held to "
        "its own converged image.</p>\n";
    std::vector<Row> slopes;
    for (const std::string& scene : values(curves, "scene")) {
        LinePlot plot{scene, {"CPU seconds"}, {"relative MSE"}};
        for (std::size_t m = 0; m < methods.size(); ++m) {
            LinePlot::Series series{methods[m], "", m};
            Row last;
            for (const Row& row : where(where(curves, "scene", scene), "method", methods[m])) {
                series.points.push_back({number(row, "seconds"), number(row, "rel_mse"),
                                         methods[m] + ", " + numbers(row, {"spp", "seconds", "rel_mse"}), failed(row)});
                last = row;
            }
            if (series.points.empty()) continue;
            const double s = slope(series.points);
            if (std::isfinite(s)) series.note = "slope " + shown(std::round(100 * s) / 100);
            slopes.push_back({{"scene", scene},
                              {"method", methods[m]},
                              {"slope", std::isfinite(s) ? shown(s) : "none"},
                              {"most spp", get(last, "spp")},
                              {"efficiency", get(last, "efficiency")},
                              {"Msamples/s", get(last, "msamples_per_s")},
                              {"efficiency to best peer's", get(last, "ratio_to_best_peer")}});
            plot.series.push_back(series);
        }
        out += figure(data, "bench_error_time", plot.svg(), scene + ": relative MSE over CPU seconds.");
    }
    out += folded("Slopes and efficiency", table(slopes));
    const std::vector<Row> to_target = with(rows, "target");
    if (!to_target.empty()) out += folded("Seconds to a given relative MSE", table(to_target));
    const std::vector<Row> equal_time = with(rows, "equal_time_gain");
    if (!equal_time.empty()) out += folded("Denoised, against more samples in the same time", table(equal_time));
    return out + folded("All rows", table(curves));
}

std::string materials_section(const Data& data, const std::vector<Row>& rows) {
    std::string out = "<p>The same glTF files in both: ours, Cycles', and the difference over grey. Ours compensates for light "
                      "that meets several facets, as Cycles' materials do. Differences are shares of the luminance, over "
                      "squares of 4 x 4 pixels, noise included.</p>\n";
    for (const Row& row : rows) {
        const std::string scene = get(row, "scene"), differs = get(row, "differs");
        const std::filesystem::path picture = data.folder / "pictures" / (scene + "_beside_cycles.png");
        if (!std::filesystem::exists(picture)) continue;
        const std::string caption = scene + ": means' ratio " + shown(number(row, "mean_ratio")) +
                                    (differs.empty() ? "" : ". " + differs);
        out += "<figure>" + image(picture, caption) + "<figcaption>" + escaped(caption) + "</figcaption></figure>\n";
    }
    return out + folded("All rows", table(rows));
}

std::string frame_section(const Data& data, const std::vector<Row>& rows) {
    const std::vector<std::string> parts = {"load", "build", "render", "denoise", "write"};
    StackPlot plot{"Stages of one run of render", "percent of the time in the program", {}};
    plot.parts = parts;
    plot.parts.push_back("other");
    for (const Row& row : rows) {
        const double total = number(row, "total_s");
        if (!(total > 0)) continue;
        StackPlot::Bar bar{
            get(row, "scene"), shown(total) + " s, " + shown(number(row, "peak_mib")) + " MiB", {}, failed(row)};
        double rest = 100;
        for (const std::string& part : parts) {
            bar.parts.push_back(100 * number(row, part + "_s") / total);
            rest -= bar.parts.back();
        }
        bar.parts.push_back(std::max(0.0, rest));
        plot.bars.push_back(bar);
    }
    return "<p>Whole runs of the example program, from a scene to a denoised EXR and a PNG, wall clock on all threads, "
           "medians, as <code>render --stats</code> reports them. Behind each bar stand its whole time and "
           "memory.</p>\n" +
           figure(data, "bench_frame", plot.svg(), "Shares of load, BVH build, render, denoise and write.") +
           folded("All rows", table(rows));
}

std::string memory_section(const Data& data, const std::vector<Row>& rows) {
    DotPlot plot{"Peak memory of whole processes", {"MiB, logarithmic"}};
    for (const Row& row : rows)
        plot.dots.push_back({"render", get(row, "scene"), "lambent", number(row, "peak_mib"),
                             get(row, "scene") + ": " + shown(number(row, "peak_mib")) + " MiB", failed(row)});
    for (const Row& row : with(data.of("bench_error_time"), "peak_mib")) {
        const std::string method = get(row, "method");
        plot.dots.push_back({get(row, "scene"), method, method == "render" ? "lambent" : "other renderers",
                             number(row, "peak_mib"), method + ": " + shown(number(row, "peak_mib")) + " MiB"});
    }
    return "<p>The most memory that a process had in use (resident), with the scene, the program and its libraries. "
           "Above, "
           "the runs of the last section; below, bench_error_time's scenes by renderer: ours for 512 x 512 pixels, "
           "others "
           "(where there are any) up to their last image.</p>\n" +
           figure(data, "bench_frame", plot.svg(), "Peak resident memory in MiB.");
}

/// A dot for each scene and feature.
std::string skip_plot(DotPlot plot, const std::vector<Row>& rows) {
    for (const Row& row : rows) {
        const std::string feature = get(row, "feature"), scene = get(row, "scene");
        plot.dots.push_back({scene, feature, feature == "adaptive" ? "samples where they are needed" : "code left out",
                             number(row, "ratio"), feature + ", " + scene + ": " + shown(number(row, "ratio")),
                             failed(row)});
    }
    return plot.svg();
}

std::string skip_section(const Data& data, const std::vector<Row>& rows) {
    const std::string plot =
        skip_plot({"Time without skipping over time with it", {"ratio of CPU seconds; right of 1 is saved"}, 1}, rows);
    return "<p>The same image by code that leaves out what the scene doesn't need, and by code that leaves nothing "
           "out, in "
           "turns on one thread. The images have to be equal (bits, or means where formulas differ). <em>adaptive</em> "
           "is "
           "the time of uniform sampling to the same error over that of sampling where it is noisy.</p>\n" +
           figure(data, "bench_skip", plot, "CPU seconds without a skip over those with it, by scene.") +
           folded("All rows", table(rows));
}

std::string instructions_section(const Data& data, const std::vector<Row>& rows) {
    const std::string plot =
        skip_plot({"Instructions without skipping over those with it", {"ratio; right of 1 is saved"}, 1}, rows);
    return "<p>The rows above by instructions a sample, which valgrind counts one by one: exact, and for AVX2.</p>\n" +
           figure(data, "bench_instructions", plot, "Instructions without a skip over those with it, by scene.") +
           folded("All rows", table(rows));
}
