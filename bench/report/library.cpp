// Sections on the library's parts: rays, loading, compile times, small functions.
#include "bvh_chart.hpp"
#include "data.hpp"

std::string rays_section(const Data& data, const std::vector<Row>& rows) {
    DotPlot rates{"Millions of rays a second, one thread", {"Mrays/s, logarithmic"}},
        builds{"Millions of triangles built a second, one thread", {"Mtriangles/s, logarithmic"}};
    for (const Row& row : rows) {
        const std::string scene = get(row, "scene"), name = get(row, "library") + " " + get(row, "variant");
        const std::string short_scene = scene.substr(scene.find_last_of('/') + 1);
        const bool batch = get(row, "batch") == "true";
        if (!get(row, "mtris_per_s").empty())
            builds.dots.push_back({"build", short_scene, name, number(row, "mtris_per_s"),
                                   name + ": " + shown(number(row, "mtris_per_s"))});
        if (!get(row, "mrays_per_s").empty() && number(row, "threads") <= 1)
            rates.dots.push_back(
                {get(row, "class"), short_scene, name + (batch ? ", batch" : ""), number(row, "mrays_per_s"),
                 name + ", " + get(row, "class") + ", " + scene + ": " + shown(number(row, "mrays_per_s")), false,
                 false, batch});
    }
    std::string out =
        "<p>Queries over triangles alone, without shading: camera rays, ambient occlusion, shadow rays, first and "
        "second bounces. <em>wrong</em> counts answers unlike those of our tree in double precision, of "
        "<em>rays</em>: misses for hits, hits for misses, distances off by more than 1e-4. Embree's robust mode is "
        "off, its fastest. Rays that graze an edge are decided by rounding, so single precision is never without any; "
        "a "
        "cross has more than 1 in 10 000.</p>\n";
    const std::string chart = bvh_chart(rows);
    if (chart.empty()) out += "<p>No ratios: Embree is not there.</p>\n";
    out += figure(data, "bench_bvh", chart, "Rays a second of one thread in multiples of Embree's, ray by ray.");
    out += folded("Rays a second",
                  figure(data, "bench_bvh", rates.svg(), "Millions of rays a second by class and scene."));
    out += folded("Builds",
                  figure(data, "bench_bvh", builds.svg(), "Millions of triangles a second by quality of build."));
    return out + folded("All rows", table(rows));
}

std::string load_section(const Data& data, const std::vector<Row>& rows) {
    DotPlot plot{"Time to load a scene file, one thread", {"CPU seconds, logarithmic; left is faster"}};
    for (const Row& row : rows) {
        const std::string library = get(row, "library"), scene = get(row, "scene");
        const bool images = library.find("_images") != std::string::npos;
        plot.dots.push_back({scene, images ? "with images" : "without images",
                             library.substr(0, library.find("_images")), number(row, "seconds"),
                             library + ": " + shown(number(row, "seconds")) + " s", failed(row)});
    }
    return "<p>From a file to triangles, beside tinygltf with a bare copy of its arrays and tinyobjloader where it is "
           "found.</p>\n" +
           figure(data, "bench_load", plot.svg(), "CPU seconds to load a file, once it is in memory.") +
           folded("All rows", table(rows));
}

std::string compile_time_section(const Data& data, const std::vector<Row>& rows) {
    DotPlot plot{"Compiling a program that includes one header and does nothing", {"times <vector> alone"}, 1};
    const std::vector<Row> headers = with(rows, "header");
    for (const Row& row : headers) {
        const std::string header = get(row, "header"), ratio = shown(number(row, "ratio_to_vector"));
        plot.dots.push_back(
            {"", header, get(row, "mode"), number(row, "ratio_to_vector"),
             header + ", " + get(row, "mode") + ": " + ratio + ", " + shown(number(row, "seconds")) + " s",
             failed(row)});
        if (!get(row, "budget").empty())
            plot.dots.push_back({"", header, "budget", number(row, "budget"), header + ": budget", false, false, true});
    }
    std::string out = "<p>CPU time of the compiler, median of interleaved runs, in multiples of the same for "
                      "<code>&lt;vector&gt;</code>; a red cross is above its budget.</p>\n" +
                      figure(data, "bench_compile_time", plot.svg(), "Compile time in multiples of <vector>'s.");
    const std::vector<Row> programs = with(rows, "program");
    if (!programs.empty()) out += "<p>Programs of ours, as this build made them:</p>\n" + table(programs);
    return out + folded("All rows", table(headers));
}

std::string micro_section(const Data&, const std::vector<Row>& rows) {
    return "<p>Nanoseconds of CPU a call, by Google Benchmark; counters beyond times are in its JSON.</p>\n" +
           folded("All rows", table(rows));
}
