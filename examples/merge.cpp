// Puts together what passes over one image saved: their samples, and the image of all of them.
#include "support/image_output.hpp"
#include "support/program.hpp"
#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

using namespace lambent;

namespace {

struct MergeOptions {
    std::string out;
    std::vector<std::string> inputs;
    std::string preview;
    double exposure = 0;
    unsigned threads = 0;
    bool quiet = false;
    ImageSettings image; ///< what is said here; the rest is as the passes had it
};

std::optional<MergeOptions> parse_options(int argc, char** argv) {
    MergeOptions o;
    CommandLine line("merge OUT.film IN.film... [options]     writes OUT.exr too, as the passes would have");
    bool help = false;
    add_image_options(line, o.image);
    line.add("--firefly off|seed[:S]", "as of render", [&](auto& v) { set_firefly(o.image, v); });
    line.add("--preview F.png", "an sRGB preview (none)", [&](auto& v) { o.preview = v; });
    line.add("--exposure EV", "of the preview, in stops (0)", [&](auto& v) { o.exposure = to_number(v); });
    line.add("--threads N", "0 = all of the machine's (0)", [&](auto& v) { o.threads = unsigned(to_integer(v, 0, 4096)); });
    line.add("--quiet", "say nothing but errors (off)", [&](auto&) { o.quiet = true; });
    line.add("--help", "this text", [&](auto&) { help = true; });
    std::vector<std::string> files = line.parse(argc, argv);
    line.add_example("the parts of a render", "merge all.film a.film b.film");
    line.add_example("denoised otherwise, with a picture to look at", "merge all.film a.film b.film --denoise fast --preview all.png");
    line.add_example("another image of one film", "merge again.film all.film --denoise none --float");
    if (help) {
        line.print_help();
        return std::nullopt;
    }
    if (files.size() < 2) throw UsageError("names of an output and of at least one input are needed");
    if (!files[0].ends_with(".film")) throw UsageError(files[0] + ": the output's name must end in .film");
    o.out = files[0];
    o.inputs.assign(files.begin() + 1, files.end());
    return o;
}

/// The film of all inputs; image settings are those of the input with the first sample, whatever the order.
class Merger {
public:
    void add(const std::string& path) {
        FilmState<float> next = read_film<float>(path);
        require(!next.film.blocks().empty(), [&] { return path + ": it holds no samples"; });
        const std::vector<SampleRange> ranges = next.film.ranges();
        if (inputs_.empty()) {
            merged_ = std::move(next);
        } else {
            const std::string differs = difference(next, merged_);
            require(differs.empty(), [&] { return path + " and " + inputs_[0].path + " are of different renders: its " + differs; });
            check_overlap(path, ranges);
            if (ranges[0].begin < merged_.film.ranges()[0].begin) merged_.settings = next.settings;
            try {
                merged_.film.merge(std::move(next.film));
            } catch (const Error& e) {
                fail(path + " and " + inputs_[0].path + ": " + e.what());
            }
        }
        inputs_.push_back({path, ranges});
    }

    FilmState<float>& state() { return merged_; }

private:
    struct Input {
        std::string path;
        std::vector<SampleRange> ranges;
    };

    void check_overlap(const std::string& path, const std::vector<SampleRange>& ranges) const {
        for (const Input& input : inputs_)
            for (const SampleRange& a : input.ranges)
                for (const SampleRange& b : ranges)
                    require(!a.overlaps(b), [&] {
                        return path + " and " + input.path + " overlap: samples " + describe(b) + " and " + describe(a);
                    });
    }

    FilmState<float> merged_;
    std::vector<Input> inputs_;
};

int run(const MergeOptions& o) {
    const std::string exr = with_extension(o.out, ".exr");
    for (const std::string& file : {o.out, exr}) check_writable(file);
    if (!o.preview.empty()) check_writable(o.preview);
    Merger merger;
    for (const std::string& input : o.inputs) merger.add(input);

    FilmState<float>& state = merger.state();
    for (const auto& [name, value] : o.image.given) state.settings[name] = value;
    ImageSettings settings;
    take_settings(settings, state.settings, o.out);
    write_film(o.out, state);
    ThreadExecutor threads(o.threads);
    const ImageReport report = write_image(state, settings, {exr, o.preview, o.exposure}, threads);
    std::uint64_t last = 0;
    for (const SampleRange& range : state.film.ranges()) last = std::max(last, range.end);
    for (const SampleRange& gap : state.film.missing({0, last}))
        std::fprintf(stderr, "merge: samples %s are missing: render --sample-range %llu:%llu makes them\n", describe(gap).c_str(),
                     static_cast<unsigned long long>(gap.begin), static_cast<unsigned long long>(gap.end));
    if (o.quiet) return 0;
    std::string ranges;
    for (const SampleRange& range : state.film.ranges()) ranges.append(" ").append(describe(range));
    std::printf("samples          %llu a pixel:%s\n", static_cast<unsigned long long>(state.film.sample_count()), ranges.c_str());
    if (report.estimated_error >= 0) std::printf("estimated error  %.4f\n", report.estimated_error);
    std::printf("wrote            %s, %s%s%s\n", o.out.c_str(), exr.c_str(), o.preview.empty() ? "" : ", ", o.preview.c_str());
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    return run_program("merge", [&] {
        const auto options = parse_options(argc, argv);
        return options ? run(*options) : 0;
    });
}
